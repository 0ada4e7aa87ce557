// What the coordinates of a program count from: shifts and turns (G52, G92, G68, TRANS, AROT, cycle 7), and
// poles (CC, C, CR, CP, LP).
#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "nc/reading/other_words.hpp"

namespace trunnion::nc {
namespace {

// Places of [input] frames.
constexpr std::size_t kTurnAnew = 2;

constexpr std::uint16_t bits_of(bool all) {
  return all ? kXyz : kPlaneWords;
}

Word* find_unused(ParsedLine& line, char letter) {
  const auto end = line.words.begin() + static_cast<std::ptrdiff_t>(line.word_count);
  const auto it =
      std::find_if(line.words.begin(), end, [&](const Word& w) { return !w.used && w.letter == letter; });
  return it == end ? nullptr : &*it;
}

constexpr double kNothing_rad = 1e-9;
constexpr std::array kLinearOfPlanes = {AxisLetter::X, AxisLetter::Y, AxisLetter::Z};

// The word at a place of its own, with a number behind it: where its number begins, or npos.
std::size_t find_value(const std::string& line, std::size_t from, std::string_view name) {
  for (std::size_t i = line.find(name, from); i != std::string::npos; i = line.find(name, i + 1)) {
    const std::size_t behind = i + name.size();
    const bool begins = i == 0 || !is_of_name(line[i - 1]);
    if (begins && behind < line.size() && begins_number(line[behind])) return behind;
  }
  return std::string::npos;
}

}  // namespace

bool OtherWords::angle_of(const Word& word, double& rad) {
  std::int64_t quanta = 0;
  if (!to_quanta(word.number, format_.decimals(AxisLetter::A), quanta) ||
      (c_.numbers.point_required && !word.number.has_point && quanta != 0))
    return fail(word.column,
                std::string("'") + word.letter +
                    "' is no angle: too many decimals, or no decimal point where the control wants one");
  rad = format_.internal(AxisLetter::A, quanta);
  return true;
}

// Nothing else may stand in the line: which of the two comes first need not be asked.
bool OtherWords::take_frame(ParsedLine& line, const AxisWords& position, const char* why_not) {
  error.clear();
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    if (word.used) continue;
    const bool shifts = is_code(word, c_.input.places.shift);
    const bool sets = is_code(word, c_.input.places.set_position);
    const bool turns = is_code(word, c_.input.places.turn);
    const bool ends_turn = is_code(word, c_.input.places.end_turn) && frames_.now.turns();
    const bool ends_shift = std::any_of(c_.input.places.end_shift.begin(), c_.input.places.end_shift.end(),
                                        [&](const std::string& text) { return is_code(word, text); });
    if (!shifts && !sets && !turns && !ends_turn && !ends_shift) continue;
    word.used = true;
    const std::string name(line.begin + word.column - 1, word.length);
    if (why_not != nullptr) return fail(word.column, "'" + name + "' " + why_not);
    if (frames_.now.turns() && !ends_turn)
      return fail(word.column, "'" + name + "' in coordinates that are turned ('" + c_.input.places.turn +
                                   "'): end that first");
    circle_.reset();
    if (ends_turn || ends_shift) {
      // A turn ends alone: the shift below it stays.
      if (ends_turn)
        frames_.now = frames_.below_turn;
      else
        frames_.now.reset();
      said_.stale_places |= bits_of(ends_shift);
    } else if (!(turns ? take_turn(line) : take_shift(line, position, sets))) {
      if (error_column == 0) error_column = word.column;
      return false;
    }
    for (std::size_t k = 0; k < line.word_count; ++k) {
      const Word& other = line.words[k];
      if (other.used) continue;
      if (axis_letter(std::string(1, other.letter)) || (other.letter >= 'I' && other.letter <= 'K'))
        return fail(other.column, std::string("'") + other.letter + "' in the line of '" + name + "'");
    }
    return true;
  }
  return true;
}

bool OtherWords::take_shift(ParsedLine& line, const AxisWords& position, bool sets_position) {
  bool any = false;
  error_column = 0;
  if (!sets_position && said_.increments)
    return fail(0, "a shift under '" + c_.incremental.on + "': controls differ in whether it is added");
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z}) {
    Word* word = find_unused(line, letter_of(letter));
    if (word == nullptr) {
      // Controls that keep the shift of an axis without a word, and others that end it.
      if (!sets_position && frames_.now.shift(letter) != 0)
        return fail(0, std::string("a shift without ") + letter_of(letter) +
                           ", which is shifted already: name all three");
      continue;
    }
    std::int64_t value = 0;
    if (word->means != Word::Means::as_in_force) return fail(word->column, "a shift is said by plain words");
    if (!quanta_of(*word, value)) return false;
    if (sets_position && !position.has(letter))
      return fail(word->column, std::string("the position of ") + letter_of(letter) +
                                    " is unknown: a rapid to a position of it must come before");
    frames_.now.set_shift(letter, sets_position ? position[letter] - value : value);
    said_.stale_places |= AxisWords::bit(letter);
    word->used = any = true;
  }
  return any || fail(0, "a shift without X, Y or Z");
}

bool OtherWords::take_turn(ParsedLine& line) {
  error_column = 0;
  if (said_.plane != 0) return fail(0, "a turn in another plane than X Y is not read");
  if (said_.increments) return fail(0, "a turn under '" + c_.incremental.on + "' is not read");
  Word* x = find_unused(line, 'X');
  Word* y = find_unused(line, 'Y');
  Word* r = find_unused(line, 'R');
  if (x == nullptr || y == nullptr || r == nullptr)
    return fail(0, "a turn is read with its centre and its angle: X, Y and R");
  std::int64_t center[2] = {0, 0};
  double rad = 0.0;
  if (!quanta_of(*x, center[0]) || !quanta_of(*y, center[1]) || !angle_of(*r, rad)) return false;
  x->used = y->used = r->used = true;
  frames_.below_turn = frames_.now;
  frames_.now.turn_about(center[0], center[1], rad);
  said_.stale_places |= kPlaneWords;
  return true;
}

std::optional<std::size_t> OtherWords::frame_named(std::string_view text) const {
  for (std::size_t i = 0; i < c_.input.places.frames.size(); ++i) {
    const std::string& name = c_.input.places.frames[i];
    if (text.size() < name.size() ||
        !std::equal(name.begin(), name.end(), text.begin(), [](char a, char b) { return a == upper(b); }))
      continue;
    if (text.size() == name.size() || !is_letter(text[name.size()]) || is_blank(text[name.size()])) return i;
  }
  return std::nullopt;
}

bool OtherWords::take_named_frame(ParsedLine& line, std::size_t name, std::optional<Number> turn_in_plane,
                                  const char* why_not) {
  error.clear();
  const std::string& said = c_.input.places.frames[name];
  if (why_not != nullptr) return fail(1, "'" + said + "' " + why_not);
  const bool turns = name >= kTurnAnew;
  std::array<std::int64_t, 3> way{};
  double rad = 0.0;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    const auto letter = axis_letter(std::string(1, word.letter));
    if (!letter || is_rotary(*letter) || index(*letter) > 2 || word.means != Word::Means::as_in_force)
      return fail(word.column,
                  std::string("'") + word.letter + "' in the line of '" + said + "' is not read");
    word.used = true;
    double angle = 0.0;
    if (!turns) {
      if (!quanta_of(word, way[index(*letter)])) return false;
    } else if (!angle_of(word, angle)) {
      return false;
    } else if (*letter == AxisLetter::Z) {
      rad = angle;
    } else if (angle != 0.0) {
      return fail(word.column,
                  "'" + said + "' about X or Y tilts the part: a tilted plane is read from its own words");
    }
  }
  if (turn_in_plane) {
    if (!turns || line.word_count != 0)
      return fail(1, "an angle in the plane beside other words of '" + said + "'");
    if (said_.plane != 0) return fail(1, "a turn in another plane than X Y is not read");
    Word word;
    word.letter = 'R';
    word.column = 1;
    word.number = *turn_in_plane;
    if (!angle_of(word, rad)) return false;
  }
  circle_.reset();
  // A shift or a turn anew takes away all that such words have said before.
  const bool anew = name == 0 || name == kTurnAnew;
  if (!anew && line.word_count == 0 && !turn_in_plane)
    return fail(1, "'" + said + "' without an axis: what the control takes back then is not read");
  if (anew) frames_.now.reset();
  if (turns)
    frames_.now.turn_about(0, 0, rad);
  else
    frames_.now.shift_further(way);
  said_.stale_places |= kXyz;
  return true;
}

std::optional<std::string_view> OtherWords::datum_shift_in(std::string_view text) const {
  const std::string& begins = c_.input.places.datum_shift;
  if (begins.empty() || !text.starts_with(begins)) return std::nullopt;
  text.remove_prefix(begins.size());
  if (text.empty() || !is_digit(text.front())) return std::nullopt;
  return text;
}

// In a tilted plane it holds from its end on.
bool OtherWords::take_datum_shift(ParsedLine& line, const char* why_not) {
  error.clear();
  if (why_not != nullptr) return fail(1, std::string("a datum shift ") + why_not);
  ProgramFrame& frame = frames_.aside ? *frames_.aside : frames_.now;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    const auto letter = axis_letter(std::string(1, word.letter));
    if (!letter || index(*letter) > 2) return fail(word.column, "a datum shift is read in X, Y and Z");
    std::int64_t value = 0;
    if (!quanta_of(word, value)) return false;
    word.used = true;
    const bool further = word.means == Word::Means::way;
    frame.set_shift(*letter, value + (further ? frame.shift(*letter) : 0));
    said_.stale_places |= AxisWords::bit(*letter);
  }
  circle_.reset();
  pole_.reset();
  frames_.aside_moved = frames_.aside.has_value();
  return true;
}

std::array<std::int64_t, 3> OtherWords::set_frame_aside() {
  const std::array<std::int64_t, 3> out = {frames_.now.shift(AxisLetter::X), frames_.now.shift(AxisLetter::Y),
                                           frames_.now.shift(AxisLetter::Z)};
  if (!frames_.aside) frames_.aside = frames_.now;
  frames_.aside_moved = false;
  frames_.now.reset();
  pole_.reset();
  return out;
}

void OtherWords::take_frame_back() {
  if (frames_.aside) frames_.now = *frames_.aside;
  frames_.aside.reset();
  pole_.reset();
  said_.stale_places |= kXyz;
}

OtherWords::PoleWord OtherWords::pole_word(std::string_view text) const {
  const auto& pole = c_.input.pole;
  if (pole.set.empty()) return PoleWord::none;
  std::size_t n = 0;
  while (n < text.size() && is_letter(text[n])) ++n;
  if (n == 0 || (n < text.size() && !is_blank(text[n]))) return PoleWord::none;
  std::string word(text.substr(0, n));
  std::transform(word.begin(), word.end(), word.begin(), upper);
  if (word == pole.set) return PoleWord::set;
  if (word == pole.about) return PoleWord::about;
  if (word == pole.by_radius) return PoleWord::by_radius;
  if (word == pole.circle) return PoleWord::circle;
  return word == pole.line ? PoleWord::line : PoleWord::none;
}

bool OtherWords::take_pole_words(std::string& line, std::size_t from, PoleLine& out) {
  error.clear();
  while (from < line.size() && is_letter(line[from])) line[from++] = ' ';
  const auto number_at = [&](std::string_view name, Word& word) {
    const std::size_t at = find_value(line, from, name);
    if (at == std::string::npos) return false;
    const char* p = line.data() + at;
    if (!scan_number(p, line.data() + line.size(), word.number)) return false;
    const std::size_t begin = at - name.size();
    word.letter = name.back();
    word.column = static_cast<std::uint32_t>(begin) + 1;
    std::fill(line.begin() + static_cast<std::ptrdiff_t>(begin), line.begin() + (p - line.data()), ' ');
    return true;
  };
  for (const bool clockwise : {true, false}) {
    const std::string& turns = clockwise ? c_.input.pole.clockwise : c_.input.pole.counterclockwise;
    const auto at = line.find(turns, from);
    if (turns.empty() || at == std::string::npos) continue;
    if (out.clockwise) return fail(static_cast<std::uint32_t>(at) + 1, "a circle with both senses");
    out.clockwise = clockwise;
    std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(at), turns.size(), ' ');
  }
  const bool polar = out.word == PoleWord::circle || out.word == PoleWord::line;
  Word word;
  double rad = 0.0;
  if (polar && number_at("IPA", word)) {
    if (!angle_of(word, rad)) return false;
    out.more_rad = rad;
  }
  if (polar && number_at("PA", word)) {
    if (!angle_of(word, rad)) return false;
    out.angle_rad = rad;
  }
  std::int64_t value = 0;
  if ((out.word == PoleWord::line && number_at("PR", word)) ||
      (out.word == PoleWord::by_radius && number_at("R", word))) {
    if (!quanta_of(word, value)) return false;
    out.radius = value;
  }
  return true;
}

// Seen against the axis across its plane.
bool OtherWords::take_pole_line(PoleLine& out, const AxisWords& position) {
  error.clear();
  const auto plane_of = [](std::uint16_t mask) -> std::optional<std::uint8_t> {
    for (std::uint8_t plane = 0; plane < 3; ++plane) {
      const auto axes = plane_axes(plane);
      if (mask == (AxisWords::bit(axes[0]) | AxisWords::bit(axes[1]))) return plane;
    }
    return std::nullopt;
  };
  if (out.word == PoleWord::set) {
    const std::uint16_t said = out.end.mask & kXyz;
    const auto plane = said == 0 ? std::optional<std::uint8_t>(0) : plane_of(said);
    if (!plane || out.end.mask != said) return fail(1, "a pole is read with two of X, Y and Z, or none");
    pole_ = Pole{*plane, {}};
    for (std::size_t i = 0; i < 2; ++i) {
      const AxisLetter letter = plane_axes(*plane)[i];
      if (!out.end.has(letter) && !position.has(letter))
        return pole_.reset(), fail(1, "a pole at a place that is not known");
      pole_->at[i] = out.end.has(letter) ? out.end[letter] : position[letter];
    }
    return true;
  }
  if ((position.mask & kXyz) != kXyz)
    return fail(1, "a circle, or a line to polar coordinates, from a place that is not known");
  arc_ = {};
  arc_.words = position;
  const std::uint16_t given = out.end.mask & kXyz;
  if (out.end.mask != given) return fail(1, "a rotary axis turns with a circle");
  for (const AxisLetter letter : kLinearOfPlanes)
    if (out.end.has(letter)) arc_.words.set(letter, out.end[letter]);
  if (out.word == PoleWord::by_radius) {
    const auto in_plane = given == AxisWords::bit(AxisLetter::X) || given == AxisWords::bit(AxisLetter::Y)
                              ? std::optional<std::uint8_t>(0)
                              : plane_of(given);
    if (!out.radius || !out.clockwise || !in_plane)
      return fail(1, "a circle by its radius is read with two of X, Y and Z, its radius and its sense");
    arc_.plane = *in_plane;
    arc_.clockwise = *out.clockwise;
    if (!place_center(position, *out.radius, 1)) return false;
    arcs_ = {arc_};
    return true;
  }
  if (!pole_) return fail(1, "no pole has been set");
  arc_.plane = pole_->plane;
  arc_.center = pole_->at;
  const auto [first, second, third] = plane_axes(arc_.plane);
  if (out.word == PoleWord::line) {
    if (!out.radius || !out.angle_rad || out.more_rad || (given & ~AxisWords::bit(third)) != 0)
      return fail(1, "a line to polar coordinates is read with its radius and its angle");
    const double r = format_.internal(first, *out.radius);
    out.end.set(first, pole_->at[0] + format_.quanta(first, r * std::cos(*out.angle_rad)));
    out.end.set(second, pole_->at[1] + format_.quanta(second, r * std::sin(*out.angle_rad)));
    return true;
  }
  if (!out.clockwise) return fail(1, "a circle without its sense");
  arc_.clockwise = *out.clockwise;
  if (out.word == PoleWord::about) {
    if (arc_.words[third] != position[third])
      return fail(1, "a circle about a pole that moves across its plane");
    arcs_ = {arc_};
    return true;
  }
  if ((given & ~AxisWords::bit(third)) != 0 || out.angle_rad.has_value() == out.more_rad.has_value())
    return fail(1, "a circle in polar coordinates is read with its angle, and the axis across its plane");
  const double from[2] = {format_.internal(first, position[first] - pole_->at[0]),
                          format_.internal(second, position[second] - pole_->at[1])};
  const double begin = std::atan2(from[1], from[0]);
  const double sense = arc_.clockwise ? -1.0 : 1.0;
  double sweep = 0.0;  // in the sense of the circle
  if (out.more_rad) {
    sweep = sense * *out.more_rad;
    constexpr double kMost = kTwoPi * 10000.0;
    if (!(sweep > kNothing_rad && sweep < kMost))
      return fail(1, "an angle of a circle against its sense, of nothing, or too large");
  } else {
    sweep = std::fmod(sense * (*out.angle_rad - begin), kTwoPi);
    while (sweep < kNothing_rad) sweep += kTwoPi;
  }
  const double r = std::hypot(from[0], from[1]);
  const double end = begin + sense * sweep;
  auto turns = static_cast<std::int64_t>(sweep / kTwoPi + kNothing_rad);
  const bool is_whole = sweep - kTwoPi * static_cast<double>(turns) < kNothing_rad;
  if (is_whole) --turns;
  arc_.words.set(first, is_whole ? position[first] : pole_->at[0] + format_.quanta(first, r * std::cos(end)));
  arc_.words.set(second,
                 is_whole ? position[second] : pole_->at[1] + format_.quanta(second, r * std::sin(end)));
  set_turns(position, turns);
  return true;
}

}  // namespace trunnion::nc
