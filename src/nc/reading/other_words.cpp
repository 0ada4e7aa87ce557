#include "nc/reading/other_words.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/units.hpp"

#include "nc/digits.hpp"

namespace trunnion::nc {
namespace {

// Inches to mm in whole numbers: 25.4 is 254 tenths.
constexpr std::int64_t kMmPerTenInches = 254;
constexpr std::int64_t kTen = 10;
static_assert(kMmPerInch * kTen == kMmPerTenInches);
// mm, inches or degrees: far beyond any machine, and what is made of them fits in 64 bits.
constexpr double kFarthest = 1e7;
constexpr std::int64_t kMostQuanta = std::numeric_limits<std::int64_t>::max() / (2 * kMmPerTenInches);

constexpr double kSamePlace_mm = 1e-6;  // far below the digits of any program, far above those of the reading
constexpr const char* kBeyond = ": beyond 10000000 mm, inches or degrees";

}  // namespace

bool OtherWords::is_beyond(std::int64_t quanta) const {
  return std::abs(static_cast<double>(quanta)) * format_.quantum(AxisLetter::X) > kFarthest;
}

std::optional<OtherWords::Code> OtherWords::code_of(const std::string& word) {
  if (word.empty()) return std::nullopt;
  Code out;
  out.letter = word.front();
  const char* p = word.data() + 1;
  const char* const end = word.data() + word.size();
  if (!is_letter(out.letter) || !scan_number(p, end, out.number) || p != end) return std::nullopt;
  return out;
}

void OtherWords::note(const std::string& word, Mode mode) {
  if (const auto code = code_of(word)) modes_.emplace_back(*code, mode);
}

OtherWords::OtherWords(const Controller& controller, const AxisFormat& format)
    : c_(controller), format_(format) {
  for (const std::string& word : c_.input.inch) note(word, Mode::inches);
  for (const std::string& word : c_.input.millimetre) note(word, Mode::millimetres);
  note(c_.incremental.on, Mode::increments);
  note(c_.incremental.off, Mode::absolute);
  if (c_.input.planes.size() == 3) {
    note(c_.input.planes[0], Mode::plane_xy);
    note(c_.input.planes[1], Mode::plane_zx);
    note(c_.input.planes[2], Mode::plane_yz);
  }
  note(c_.input.centers_absolute, Mode::centers_absolute);
  note(c_.input.centers_from_start, Mode::centers_from_start);
  note(c_.input.places.per_revolution, Mode::per_revolution);
  note(c_.input.places.zero_follows, Mode::zero_follows);
  note(c_.input.places.zero_stays, Mode::zero_stays);
  note(c_.rotary.shorter_way, Mode::shorter_way);
  note(c_.rotary.straight_way, Mode::straight_way);
  for (const auto& [code, mode] : modes_) groups_.emplace_back(code, group_of(mode));
  for (const std::string& word : {c_.feed.per_minute, c_.feed.inverse_time})
    if (const auto code = code_of(word)) groups_.emplace_back(*code, group_of(Mode::per_revolution));
}

bool OtherWords::claims(char letter, const Number& number) const {
  return std::any_of(modes_.begin(), modes_.end(), [&](const auto& mode) {
    return mode.first.letter == letter && equal(mode.first.number, number);
  });
}

void OtherWords::set(Mode mode) {
  switch (mode) {
    case Mode::inches:
    case Mode::millimetres:
      said_.inches = mode == Mode::inches;
      said_.unit_known = true;
      break;
    case Mode::increments:
    case Mode::absolute:
      said_.increments = mode == Mode::increments;
      break;
    case Mode::plane_xy:
    case Mode::plane_zx:
    case Mode::plane_yz:
      said_.plane = static_cast<std::uint8_t>(static_cast<int>(mode) - static_cast<int>(Mode::plane_xy));
      break;
    case Mode::centers_absolute:
    case Mode::centers_from_start:
      said_.centers_absolute = mode == Mode::centers_absolute;
      break;
    case Mode::per_revolution:
      said_.per_revolution = true;
      said_.feed_of_turn = 0;  // LinuxCNC wants F again
      break;
    case Mode::shorter_way:
    case Mode::straight_way:
      said_.shorter_way = mode == Mode::shorter_way;
      break;
    case Mode::zero_follows:
    case Mode::zero_stays:
      said_.zero_follows = mode == Mode::zero_follows;
      break;
  }
}

bool OtherWords::fail(std::uint32_t column, const std::string& message) {
  error = message;
  error_column = column;
  return false;
}

bool OtherWords::has_each_once(const ParsedLine& line) {
  error.clear();
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    const Word& word = line.words[i];
    if (word.letter == 'G' || word.letter == 'M' || !is_letter(word.letter)) continue;
    if (word.letter == 'F' && !c_.motion.modal) continue;  // F125 M128 F1000
    const std::uint32_t bit = 1U << (static_cast<unsigned>(word.letter - '@') & 31U);
    if ((seen & bit) != 0)
      return fail(word.column, std::string("two ") + word.letter + " words in one block");
    seen |= bit;
  }
  return true;
}

int OtherWords::group_of(Mode mode) {
  switch (mode) {
    case Mode::inches:
    case Mode::millimetres:
      return 0;
    case Mode::increments:
    case Mode::absolute:
      return 1;
    case Mode::plane_xy:
    case Mode::plane_zx:
    case Mode::plane_yz:
      return 2;
    case Mode::centers_absolute:
    case Mode::centers_from_start:
      return 3;
    case Mode::per_revolution:
      return 4;
    case Mode::shorter_way:
    case Mode::straight_way:
      return 5;
    case Mode::zero_follows:
    case Mode::zero_stays:
      return 6;
  }
  return -1;
}

bool OtherWords::has_one_of_each_group(const ParsedLine& line) {
  error.clear();
  std::array<std::optional<Number>, 7> said;
  const auto is_other = [&](int group, const Word& word) {
    auto& before = said[static_cast<std::size_t>(group)];
    if (before && !equal(*before, word.number)) return true;
    before = word.number;
    return false;
  };
  for (std::size_t i = 0; i < line.word_count; ++i) {
    const Word& word = line.words[i];
    bool is_second = false;
    for (const auto& [code, group] : groups_)
      is_second = is_second || (code.is(word) && is_other(group, word));
    if (is_second)
      return fail(word.column,
                  "a second word of one group in this block: controls differ in which one applies");
  }
  return true;
}

bool OtherWords::take_modes(ParsedLine& line) {
  error.clear();
  const bool inches = said_.inches;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    for (const auto& [code, mode] : modes_) {
      if (!code.is(word)) continue;
      set(mode);
      word.used = true;
    }
  }
  return said_.inches != inches;
}

bool OtherWords::wants_unit() {
  return !std::exchange(said_.unit_known, true) && !c_.input.inch.empty();
}

std::int64_t OtherWords::length(std::int64_t quanta) const {
  if (!said_.inches) return quanta;
  const std::int64_t tenths = std::clamp(quanta, -kMostQuanta, kMostQuanta) * kMmPerTenInches;
  return (tenths + (tenths < 0 ? -kTen / 2 : kTen / 2)) / kTen;
}

bool OtherWords::resolve(AxisWords& words, Means means, const AxisWords& position, std::uint32_t column) {
  error.clear();
  const AxisWords from = frames_.now.is_idle() ? position : frames_.now.program_of(position);
  for (const AxisLetter letter : kAllAxisLetters) {
    if (!words.has(letter)) continue;
    const std::uint16_t bit = AxisWords::bit(letter);
    if (is_beyond(words[letter])) return fail(column, std::string(1, letter_of(letter)) + kBeyond);
    std::int64_t value = is_rotary(letter) ? words[letter] : length(words[letter]);
    if ((means.ways & bit) != 0 || (said_.increments && (means.places & bit) == 0)) {
      if (!from.has(letter) || (said_.stale_places & bit) != 0) {
        return fail(column,
                    std::string("an increment of ") + letter_of(letter) + " ('" +
                        (c_.incremental.on.empty() ? c_.input.places.increment_prefix : c_.incremental.on) +
                        "') from a place that is not known" +
                        (from.has(letter) ? ": say a place in these coordinates first" : ""));
      }
      value += from[letter];
      if (is_beyond(value)) return fail(column, std::string(1, letter_of(letter)) + kBeyond);
    } else {
      said_.stale_places &= static_cast<std::uint16_t>(~bit);
    }
    words.set(letter, value);
  }
  if (frames_.now.is_idle()) return true;
  if (frames_.now.turns() && (words.mask & kPlaneWords) != 0) {
    for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) {
      if (words.has(letter)) continue;
      if (!from.has(letter))
        return fail(column, "X or Y alone in coordinates that are turned, from a place that is not known");
      words.set(letter, from[letter]);
    }
  }
  words = frames_.now.position_of(words);
  return true;
}

bool OtherWords::is_code(const Word& word, const std::string& text) const {
  const auto code = code_of(text);
  return code && code->is(word);
}

bool OtherWords::has_its_point(const Word& word, std::int64_t quanta) {
  return !c_.numbers.point_required || word.number.has_point || quanta == 0 ||
         fail(word.column,
              std::string("'") + word.letter +
                  "' has no decimal point: the control would take it for a number of increments");
}

bool OtherWords::quanta_of(const Word& word, std::int64_t& out) {
  if (!to_quanta(word.number, format_.decimals(AxisLetter::X), out))
    return fail(word.column, std::string("'") + word.letter + "' has too many decimals, or is too large");
  if (!has_its_point(word, out)) return false;
  if (is_beyond(out)) return fail(word.column, std::string(1, word.letter) + kBeyond);
  out = length(out);
  return true;
}

std::optional<FoundEvent> OtherWords::take_shape(ParsedLine& line, const PatternSet& patterns,
                                                 const AxisWords& position, bool in_cycle) {
  error.clear();
  if (auto circle = take_circle(line, position)) return circle;
  if (!error.empty()) return std::nullopt;
  return take_cycle(line, patterns, in_cycle);
}

std::optional<FoundEvent> OtherWords::take_circle(ParsedLine& line, const AxisWords& place) {
  std::optional<bool> clockwise = circle_;
  FoundEvent found;
  bool goes_on = false;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    if (word.used) continue;
    const bool is_clockwise = is_code(word, c_.input.clockwise);
    if (is_clockwise || is_code(word, c_.input.counterclockwise)) {
      circle_ = clockwise = is_clockwise;
      found.column = word.column;
      word.used = true;
    } else if (is_code(word, c_.motion.rapid) || is_code(word, c_.motion.linear)) {
      circle_.reset();
      return std::nullopt;
    } else if (word.letter == 'X' || word.letter == 'Y' || word.letter == 'Z') {
      goes_on = true;
    }
  }
  if (!clockwise || (found.column == 0 && !goes_on)) return std::nullopt;
  // Rotary axes do not turn with a circle; whoever does not know these words says so.
  arc_ = {};
  arc_.clockwise = *clockwise;
  arc_.plane = said_.plane;
  const AxisWords position = frames_.now.program_of(place);
  arc_.words = position;
  if ((position.mask & kXyz) != kXyz) return refuse(found.column, "an arc from a place that is not known");
  if (frames_.now.turns() && said_.plane != 0)
    return refuse(found.column, "an arc across another plane than X Y in coordinates that are turned");
  const auto [first, second, third] = plane_axes(said_.plane);
  std::optional<std::int64_t> radius;
  std::int64_t turns = 0;  // beside the part of one
  std::uint16_t absolute_centers = 0;
  std::array<std::optional<std::int64_t>, 3> center;  // of X, Y, Z
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    if (word.used) continue;
    std::int64_t value = 0;
    if (word.letter >= 'X' && word.letter <= 'Z') {
      if (!quanta_of(word, value)) return std::nullopt;
      const auto letter = static_cast<AxisLetter>(word.letter - 'X');
      if (is_relative(word) && (said_.stale_places & AxisWords::bit(letter)) != 0)
        return refuse(word.column, "an increment behind a shift: say a place in these coordinates first");
      if (!is_relative(word)) said_.stale_places &= static_cast<std::uint16_t>(~AxisWords::bit(letter));
      arc_.words.set(letter, value + (is_relative(word) ? position[letter] : 0));
    } else if (word.letter >= 'I' && word.letter <= 'K') {
      if (!quanta_of(word, value)) return std::nullopt;
      center[static_cast<std::size_t>(word.letter - 'I')] = value;
      const bool is_place =
          word.means == Word::Means::place ||
          (word.means == Word::Means::as_in_force && (said_.centers_absolute || c_.arcs.center_absolute));
      if (is_place) absolute_centers |= static_cast<std::uint16_t>(1U << (word.letter - 'I'));
    } else if (word.letter == 'R' && c_.input.arc_radius &&
               word.by_name == !c_.input.places.radius_name.empty()) {
      if (!quanta_of(word, value)) return std::nullopt;
      radius = value;
    } else if (word.letter == kTurns || c_.input.places.more_turns == std::string(1, word.letter)) {
      constexpr std::int64_t kMostTurns = 10000;
      if (!to_quanta(word.number, 0, turns) || turns < 0 || turns > kMostTurns ||
          (word.letter != kTurns && turns-- == 0))
        return refuse(word.column, "a number of turns that is none, or too large");
    } else {
      continue;
    }
    if (found.column == 0) found.column = word.column;
    word.used = true;
  }
  // Some take the radius, some refuse it.
  if (radius && (center[0] || center[1] || center[2]))
    return refuse(found.column, "an arc with its radius and its centre");
  found.event = {EventKind::arc, *clockwise ? 1 : 0};
  if (turns > 0 && frames_.now.turns())
    return refuse(found.column, "a helix of several turns in coordinates that are turned is not read");
  // Not every compiler lets a lambda capture a binding.
  const std::array<AxisLetter, 2> in_plane = {first, second};
  // Turned there and back a place is off by the last digits: where the circle ends where it begins the
  // control goes all the way round.
  const bool closes = frames_.now.turns() && std::all_of(in_plane.begin(), in_plane.end(), [&](AxisLetter l) {
                        return std::abs(format_.internal(l, arc_.words[l] - position[l])) < kSamePlace_mm;
                      });
  if (closes)
    for (const AxisLetter letter : in_plane) arc_.words.set(letter, position[letter]);
  const auto placed = [&] {
    arc_.words = frames_.now.position_of(arc_.words);
    if (closes)
      for (const AxisLetter letter : in_plane) arc_.words.set(letter, place[letter]);
    AxisWords center_at = position;
    center_at.set(in_plane[0], arc_.center[0]);
    center_at.set(in_plane[1], arc_.center[1]);
    center_at = frames_.now.position_of(center_at);
    arc_.center = {center_at[in_plane[0]], center_at[in_plane[1]]};
    set_turns(place, turns);
    return found;
  };
  if (radius) return place_center(position, *radius, found.column) ? std::optional(placed()) : std::nullopt;
  if (center[index(third)] || (!center[index(first)] && !center[index(second)]))
    return refuse(found.column, center[index(third)] ? "an arc whose centre is given across its plane"
                                                     : "an arc without its centre or its radius");
  for (std::size_t i = 0; i < 2; ++i) {
    const bool is_said = center[index(in_plane[i])].has_value();
    const bool absolute = (absolute_centers & AxisWords::bit(in_plane[i])) != 0;
    if (!is_said && (said_.centers_absolute || c_.arcs.center_absolute))
      return refuse(found.column, "an arc whose centre is not given in both directions of its plane");
    arc_.center[i] = center[index(in_plane[i])].value_or(0) + (absolute ? 0 : position[in_plane[i]]);
  }
  return placed();
}

// Each turn, then what is left, Z going on evenly with the angle.
void OtherWords::set_turns(const AxisWords& from, std::int64_t turns) {
  arcs_.clear();
  if (turns > 0) {
    const auto [first, second, third] = plane_axes(arc_.plane);
    const auto angle = [&, first = first, second = second](const AxisWords& at) {
      return std::atan2(format_.internal(second, at[second] - arc_.center[1]),
                        format_.internal(first, at[first] - arc_.center[0]));
    };
    double rest = (angle(arc_.words) - angle(from)) * (arc_.clockwise ? -1.0 : 1.0);
    constexpr double kNothing = 1e-9;
    while (rest < kNothing) rest += kTwoPi;
    const double whole = kTwoPi * static_cast<double>(turns);
    const auto rise = static_cast<double>(arc_.words[third] - from[third]);
    for (std::int64_t i = 1; i <= turns; ++i) {
      Arc turn = arc_;
      turn.words = from;
      turn.words.set(third,
                     from[third] + std::llround(rise * kTwoPi * static_cast<double>(i) / (whole + rest)));
      arcs_.push_back(turn);
    }
  }
  arcs_.push_back(arc_);
}

// Left of the way from start to end where the circle turns left and goes less than half way round.
bool OtherWords::place_center(const AxisWords& position, std::int64_t radius, std::uint32_t column) {
  const auto [first, second, third] = plane_axes(said_.plane);
  const double mm[2] = {format_.internal(first, arc_.words[first] - position[first]),
                        format_.internal(second, arc_.words[second] - position[second])};
  const double chord = std::hypot(mm[0], mm[1]);
  const double r = format_.internal(first, radius);
  if (chord == 0.0 || r == 0.0) return fail(column, "an arc by its radius that ends where it begins");
  const double beyond = 0.5 * chord - std::abs(r);
  if (beyond > c_.arc_radii_may_differ_mm()) {
    return fail(column, "an arc whose ends are " + std::to_string(chord) + " mm apart and whose radius is " +
                            std::to_string(r) + " mm");
  }
  const double height = std::sqrt(std::max(0.0, r * r - 0.25 * chord * chord));
  const double side = (arc_.clockwise ? -1.0 : 1.0) * (r < 0.0 ? -1.0 : 1.0);
  const double center[2] = {0.5 * mm[0] - side * height * mm[1] / chord,
                            0.5 * mm[1] + side * height * mm[0] / chord};
  arc_.center = {position[first] + format_.quanta(first, center[0]),
                 position[second] + format_.quanta(second, center[1])};
  return true;
}

std::pair<std::int64_t, bool> OtherWords::number_of(const std::string& tool) {
  constexpr std::int64_t kFirst = 1001;  // beyond the numbers that magazines have
  const auto it = std::find(tools_.begin(), tools_.end(), tool);
  const std::int64_t number = kFirst + (it - tools_.begin());
  const bool is_new = it == tools_.end();
  if (is_new) tools_.push_back(tool);
  return {number, is_new};
}

std::optional<FoundEvent> OtherWords::take_cycle(ParsedLine& line, const PatternSet& patterns,
                                                 bool in_cycle) {
  for (const Pattern& pattern : patterns.words) {
    if (pattern.event.kind != EventKind::cycle) continue;
    Word* code = nullptr;
    for (const PatternWord& wanted : pattern.words) {
      for (std::size_t i = 0; wanted.is_fixed && i < line.word_count; ++i) {
        Word& word = line.words[i];
        if (!word.used && word.letter == wanted.letter && equal(word.number, wanted.number)) code = &word;
      }
    }
    if (code == nullptr) continue;
    FoundEvent found;
    found.event = pattern.event;
    found.column = code->column;
    found.pattern = &pattern;
    if (said_.plane != 0)
      return refuse(code->column, "a drilling cycle across another plane than X Y ('" +
                                      c_.input.planes[said_.plane] + "') is not read");
    if (said_.increments)
      return refuse(code->column, "a drilling cycle in increments ('" + c_.incremental.on + "') is not read");
    code->used = true;
    bool says_place = false;
    for (const PatternWord& wanted : pattern.words) {
      if (wanted.is_fixed) continue;
      const auto word = std::find_if(
          line.words.begin(), line.words.begin() + line.word_count,
          [&](const Word& w) { return !w.used && w.letter == wanted.letter && w.means != Word::Means::way; });
      if (word != line.words.begin() + line.word_count) {
        word->used = true;
        found.captures.set(wanted.placeholder, word->number);
        says_place = says_place || (wanted.placeholder != Placeholder::feed && wanted.letter != 'P' &&
                                    wanted.letter != 'Q');
        continue;
      }
      const bool may_stand_before = wanted.placeholder == Placeholder::x ||
                                    wanted.placeholder == Placeholder::y ||
                                    wanted.placeholder == Placeholder::feed;
      if (may_stand_before) continue;
      if (!in_cycle || !cycle_.has(wanted.placeholder))
        return refuse(code->column, std::string("a drilling cycle without its ") + wanted.letter + " word");
      found.captures.set(wanted.placeholder, cycle_[wanted.placeholder]);
    }
    if (!says_place)
      return refuse(code->column,
                    "a drilling cycle without X, Y, Z and R: controls differ in whether it drills here");
    cycle_ = found.captures;
    circle_.reset();
    return found;
  }
  return std::nullopt;
}

bool OtherWords::is_rapid(const ParsedLine& line, bool so_far) const {
  for (std::size_t i = 0; i < line.word_count; ++i) {
    if (is_code(line.words[i], c_.motion.rapid)) return true;
    if (is_code(line.words[i], c_.motion.linear)) return false;
  }
  return so_far;
}

bool OtherWords::take_place_name(std::string& line, std::size_t from) const {
  const std::string& name = c_.input.machine_position;
  const auto at = line.find(name, from);
  if (at == std::string::npos || (at > 0 && is_of_name(line[at - 1])) ||
      (at + name.size() < line.size() && is_of_name(line[at + name.size()])) ||
      line.find(c_.comments.open, from) < at)
    return false;
  std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(at), name.size(), ' ');
  return true;
}

std::optional<OtherWords::MachineMotion> OtherWords::take_machine_motion(ParsedLine& line) {
  error.clear();
  MachineMotion out;
  bool reference = false;
  if (line.past_offsets) {
    out.to_position = true;
    out.column = 1;
  }
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    if (word.used) continue;
    if (line.past_offsets) break;
    const bool home = std::any_of(c_.input.reference.begin(), c_.input.reference.end(),
                                  [&](const std::string& text) { return is_code(word, text); });
    if (!home && !is_code(word, c_.input.machine_position)) continue;
    reference = home;
    out.to_position = !home;
    out.column = word.column;
    word.used = true;
  }
  if (out.column == 0) return std::nullopt;
  if (out.to_position && said_.increments)
    return refuse(out.column, "'" + c_.input.machine_position + "' under '" + c_.incremental.on +
                                  "': controls differ in where that leads");
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    const auto letter = axis_letter(std::string(1, word.letter));
    if (word.used || !letter) continue;
    if (word.means == Word::Means::way)
      return refuse(word.column, "a way in the line of a place of the machine");
    std::int64_t value = 0;
    if (!to_quanta(word.number, format_.decimals(*letter), value) || !has_its_point(word, value)) {
      if (error.empty()) fail(word.column, std::string("'") + word.letter + "' has too many decimals");
      return std::nullopt;
    }
    // An increment of nothing leads over no other place.
    if (reference && !(said_.increments && value == 0)) out.by_way_of.set(*letter, value);
    out.axes.set(*letter, is_rotary(*letter) ? value : length(value));
    word.used = true;
  }
  // Without axes all of them go.
  if (reference && out.axes.mask == 0) out.axes.mask = kAllAxes;
  circle_.reset();
  return out;
}

}  // namespace trunnion::nc
