#include "nc/reading/shape_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trunnion/base/units.hpp"

#include "nc/digits.hpp"

namespace trunnion::nc {
namespace {

constexpr double kTwoWords_mm = 0.002;  // half a digit each, of three decimals, and as much again

constexpr double kFarthestCenter_mm = 1e7;  // far beyond any machine

AxisWords xyz_of(const AxisWords& position) {
  AxisWords out = position;
  out.mask &= kXyz;
  return out;
}

}  // namespace

bool ShapeReader::shape_may_begin(const FoundEvent& found) {
  if (!s_.may_move(found.column) || (s_.language.others && s_.waits_for_plane())) return false;
  if (found.event.kind != EventKind::probe && s_.spindle_turns_at_nothing(found.column)) return false;
  const char* what = found.event.kind == EventKind::arc     ? "an arc"
                     : found.event.kind == EventKind::probe ? "a touch"
                                                            : "a drilling cycle";
  if ((s_.modal.position.mask & kXyz) != kXyz) {
    s_.error(found.column, std::string(what) + " from a place that is not known");
    return false;
  }
  if (s_.modal.feed_mode != FeedMode::per_minute) {
    s_.error(found.column, std::string(what) + " under inverse time is not read");
    return false;
  }
  return true;
}

// The words of [input] have been resolved already.
void ShapeReader::run_arcs_of_others(const FoundEvent& found) {
  const std::size_t errors = s_.findings.errors;
  for (const Arc& arc : s_.language.others->arcs())
    if (s_.findings.errors == errors) run_arc_of_others(found, arc);
}

void ShapeReader::run_arc_of_others(const FoundEvent& found, Arc arc) {
  arc.feed = s_.feed;
  arc.from = xyz_of(s_.modal.position);
  arc.source = {s_.findings.line, found.column};
  std::array<double, 2> radius{};
  for (std::size_t i = 0; i < 2; ++i) {
    const AxisLetter letter = plane_axes(arc.plane)[i];
    const auto mm = [&](std::int64_t quanta) { return s_.language.format.internal(letter, quanta); };
    if (std::abs(mm(arc.center[i])) > kFarthestCenter_mm)
      return s_.error(found.column,
                      "an arc whose centre is beyond " + std::to_string(kFarthestCenter_mm) + " mm");
    radius[0] = std::hypot(radius[0], mm(arc.from[letter] - arc.center[i]));
    radius[1] = std::hypot(radius[1], mm(arc.words[letter] - arc.center[i]));
  }
  if (std::abs(radius[0] - radius[1]) > s_.c.arc_radii_may_differ_mm() || radius[0] == 0.0) {
    return s_.error(found.column, "an arc whose radius to the start is " + std::to_string(radius[0]) +
                                      " mm and to the end " + std::to_string(radius[1]) + " mm");
  }
  s_.modal.position = arc.words;
  s_.emit(arc);
}

void ShapeReader::run_arc(const FoundEvent& found) {
  s_.modal.motion_kind.reset();
  s_.modal.cycle.reset();
  if (!shape_may_begin(found)) return;
  if (s_.language.others && s_.language.others->per_revolution()) s_.follow_spindle();
  if (s_.feed <= 0) return s_.error(found.column, "an arc without feed");
  if (s_.language.others && found.pattern == nullptr) return run_arcs_of_others(found);
  const int decimals = s_.language.format.decimals(AxisLetter::X);
  Arc arc;
  arc.clockwise = found.event.argument == 1;
  arc.feed = s_.feed;
  arc.from = xyz_of(s_.modal.position);
  arc.source = {s_.findings.line, found.column};
  const std::int64_t center[2] = {s_.scaled(found, Placeholder::i, decimals),
                                  s_.scaled(found, Placeholder::j, decimals)};
  const std::int64_t end[2] = {s_.scaled(found, Placeholder::x, decimals),
                               s_.scaled(found, Placeholder::y, decimals)};
  std::array<double, 2> radius{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto letter = static_cast<AxisLetter>(i);
    // Its chords are counted: the centre of a mistyped number would ask for more than there is memory.
    if (const double at_mm = s_.language.format.internal(letter, center[i]);
        std::abs(at_mm) > kFarthestCenter_mm) {
      return s_.error(found.column, "an arc whose centre is " + std::to_string(at_mm) + " mm away in " +
                                        letter_of(letter) + ", more than " +
                                        std::to_string(kFarthestCenter_mm) + " mm");
    }
    arc.center[i] = center[i] + (s_.c.arcs.center_absolute ? 0 : s_.modal.position[letter]);
    radius[0] =
        std::hypot(radius[0], s_.language.format.internal(letter, s_.modal.position[letter] - arc.center[i]));
    radius[1] = std::hypot(radius[1], s_.language.format.internal(letter, end[i] - arc.center[i]));
  }
  if (std::abs(radius[0] - radius[1]) > s_.c.arcs.radius_tolerance_mm + 1e-9 || radius[0] == 0.0) {
    return s_.error(found.column, "an arc whose radius to the start is " + std::to_string(radius[0]) +
                                      " mm and to the end " + std::to_string(radius[1]) + " mm");
  }
  s_.modal.position.set(AxisLetter::X, end[0]);
  s_.modal.position.set(AxisLetter::Y, end[1]);
  if (found.captures.has(Placeholder::z))
    s_.modal.position.set(AxisLetter::Z, s_.scaled(found, Placeholder::z, decimals));
  arc.words = s_.modal.position;
  s_.emit(arc);
}

const Template& ShapeReader::words_of_cycle(int argument) const {
  if (argument == kTapLeft) return s_.c.cycles.tap_left;
  if (argument == static_cast<int>(Hole::Kind::tap)) return s_.c.cycles.tap;
  return s_.c.cycles.plain[static_cast<std::size_t>(argument)];
}

// The words have the feed or the pitch: one follows from the other and the speed that was said last.
bool ShapeReader::gear(const FoundEvent& found, const Template& words, Hole& hole) {
  const auto refuse = [&](const char* why) {
    s_.error(found.column, why);
    return false;
  };
  Thread& thread = hole.thread;
  thread.rpm = s_.whole(found, Placeholder::rpm, 0);
  if (thread.rpm <= 0)
    return refuse("a tapping cycle, and the program has not said how fast the spindle turns");
  const auto rpm = static_cast<double>(thread.rpm);
  const FeedFormat& feeds = s_.c.numbers.feed;
  const bool is_left = found.event.argument == kTapLeft;
  if (is_left || !s_.c.cycles.tap_left.empty())
    thread.hand = is_left ? Thread::Hand::left : Thread::Hand::right;
  if (holds(words, Placeholder::feed)) {
    if (hole.feed <= 0)
      return refuse("a tapping cycle without its feed: that of the cuts before it is no pitch");
    const double pitch_mm = feeds.internal(FeedMode::per_minute, hole.feed) * kSecondsPerMinute / rpm;
    thread.pitch = std::llround(pitch_mm / kPitchUnit_mm);
  } else {
    const bool is_lead = holds(words, Placeholder::lead);
    const Placeholder p = is_lead ? Placeholder::lead : Placeholder::pitch;
    const Number* number = s_.value(found, p);
    if (number == nullptr || !to_rounded_quanta(*number, kPitchDecimals, thread.pitch)) thread.pitch = 0;
    if (number != nullptr) s_.check_point(found, p, *number);
    if (s_.language.others) thread.pitch = s_.language.others->length(thread.pitch);
    if (is_lead) thread.hand = thread.pitch < 0 ? Thread::Hand::left : Thread::Hand::right;
    if (is_lead) thread.pitch = std::abs(thread.pitch);
    const double rate = static_cast<double>(thread.pitch) * kPitchUnit_mm * rpm / kSecondsPerMinute;
    hole.feed = feeds.quanta(FeedMode::per_minute, rate);
  }
  if (thread.pitch <= 0 || hole.feed <= 0) return refuse("a tapping cycle without a pitch above 0");
  return true;
}

void ShapeReader::run_cycle(const FoundEvent& found) {
  const auto before = std::exchange(s_.modal.motion_kind, std::nullopt);
  if (!shape_may_begin(found)) return;
  if (s_.language.others && s_.language.others->in_other_plane())
    return s_.error(found.column, "a drilling cycle in another plane than X Y");
  const int decimals = s_.language.format.decimals(AxisLetter::X);
  // A value on a line before counts only where the cycle's own words have it there.
  const bool is_tap = found.event.argument >= static_cast<int>(Hole::Kind::tap);
  const Template& words = words_of_cycle(found.event.argument);
  const auto given = [&](Placeholder p) {
    if (found.captures.has(p)) return true;
    const bool dwells =
        !is_tap && holds(s_.c.cycles.dwell[static_cast<std::size_t>(found.event.argument)], p);
    return s_.kept.has(p) && (holds(words, p) || dwells);
  };
  const Number* feed = given(Placeholder::feed) ? s_.value(found, Placeholder::feed) : nullptr;
  if (feed != nullptr) s_.check_point_of_feed(*feed, found.column);
  if (s_.language.others && s_.language.others->per_revolution()) {
    if (feed != nullptr) s_.language.others->set_feed_of_turn(*feed);
    if (is_tap)
      s_.follow_spindle(s_.whole(found, Placeholder::rpm, 0));
    else
      s_.follow_spindle();
  }
  const std::int64_t turned_feed = s_.feed;
  const ProgramFrame none;
  const ProgramFrame& frame = s_.language.others ? s_.language.others->frame() : none;
  const auto height = [&](Placeholder p) {
    AxisWords at;
    at.set(AxisLetter::Z, s_.scaled(found, p, decimals));
    return frame.position_of(at)[AxisLetter::Z];
  };
  Hole hole;
  hole.kind = is_tap ? Hole::Kind::tap : static_cast<Hole::Kind>(found.event.argument);
  const bool stands_there = !holds(words, Placeholder::clear);  // of a tap
  hole.clear = stands_there ? s_.modal.position[AxisLetter::Z] : height(Placeholder::clear);
  hole.bottom = given(Placeholder::bottom) ? height(Placeholder::bottom)
                                           : hole.clear + s_.scaled(found, Placeholder::depth, decimals);
  if (given(Placeholder::step)) hole.step = s_.scaled(found, Placeholder::step, decimals);
  if (!is_tap)
    hole.dwell_ms = given(Placeholder::milliseconds) ? s_.whole(found, Placeholder::milliseconds, 0)
                                                     : s_.scaled(found, Placeholder::seconds, 3);
  if (feed != nullptr) {
    if (!to_rounded_quanta(*feed, s_.c.numbers.feed.decimals(s_.modal.feed_mode), hole.feed)) hole.feed = 0;
    if (s_.language.others) hole.feed = s_.language.others->length(hole.feed);
    if (s_.language.others && s_.language.others->per_revolution()) hole.feed = turned_feed;
    if (s_.c.cycles.modal()) s_.feed = hole.feed;  // an F word as any other
  } else if (!is_tap) {
    hole.feed = s_.feed;
  }
  if (is_tap && !gear(found, words, hole)) return;
  if (hole.feed <= 0) return s_.error(found.column, "a drilling cycle without feed");
  if (!(hole.bottom < hole.clear))
    return s_.error(found.column, "a drilling cycle whose bottom is not below its clearance");
  const bool steps = hole.kind == Hole::Kind::peck || hole.kind == Hole::Kind::chip_break;
  const bool has_step = steps || given(Placeholder::step);
  if (has_step && hole.step == 0) return s_.error(found.column, "a drilling cycle with a step of nothing");
  if (has_step && hole.step < 0) return s_.error(found.column, "a drilling cycle with a step below 0");
  constexpr std::int64_t kMostSteps = 10000;
  if (has_step && (hole.clear - hole.bottom) / hole.step > kMostSteps)
    return s_.error(found.column, "a drilling cycle of more than " + std::to_string(kMostSteps) + " steps");
  // A step of the whole depth is none.
  if (given(Placeholder::step) && (steps || hole.kind == Hole::Kind::drill)) {
    const bool whole_depth = hole.step >= hole.clear - hole.bottom;
    if (whole_depth) hole.step = 0;
    hole.kind = whole_depth                      ? Hole::Kind::drill
                : hole.kind == Hole::Kind::drill ? Hole::Kind::peck
                                                 : hole.kind;
  }
  if (!s_.modal.cycle) s_.cycle_return.initial = s_.modal.position[AxisLetter::Z];
  std::int64_t back = stands_there ? hole.clear : s_.cycle_return.of(hole.clear);
  if (!s_.cycle_return.to_clear && !stands_there && back > hole.clear)
    return s_.error(found.column,
                    "a drilling cycle, and neither '" + s_.c.cycles.to_initial.front() + "' nor '" +
                        s_.c.cycles.to_clear.front() +
                        "' before it: whether the tool returns to where it came from the program "
                        "does not say");
  if (given(Placeholder::back)) back = height(Placeholder::back);
  if (given(Placeholder::rise)) back = hole.clear + s_.scaled(found, Placeholder::rise, decimals);
  if (back < hole.clear) return s_.error(found.column, "a drilling cycle that returns below its clearance");
  hole.words.set(AxisLetter::Z, back);
  AxisWords place = frame.program_of(s_.modal.position);
  if (found.captures.has(Placeholder::x))
    place.set(AxisLetter::X, s_.scaled(found, Placeholder::x, decimals));
  if (found.captures.has(Placeholder::y))
    place.set(AxisLetter::Y, s_.scaled(found, Placeholder::y, decimals));
  place = frame.position_of(place);
  // Of the same height an approach and a cycle may be rounded to words that differ by a digit.
  const std::int64_t digits = s_.language.format.quanta(AxisLetter::Z, kTwoWords_mm);
  if (s_.c.cycles.initial_at_start && s_.modal.position[AxisLetter::Z] < hole.clear - digits &&
      ((place.mask & kPlaneWords) != kPlaneWords ||
       place[AxisLetter::X] != s_.modal.position[AxisLetter::X] ||
       place[AxisLetter::Y] != s_.modal.position[AxisLetter::Y] ||
       (!s_.cycle_return.to_clear.value_or(false) && s_.cycle_return.initial < hole.clear - digits)))
    return s_.error(found.column,
                    "a drilling cycle from below its R: the control goes across there, and may return there");
  s_.modal.cycle = hole;
  run_hole(place[AxisLetter::X], place[AxisLetter::Y], found.column);
  if (!s_.c.cycles.modal() || stands_there) s_.modal.cycle.reset();
  // A cycle that is called leaves the words of motion as they were (as the cycles guide of Siemens is
  // remembered; it was not at hand).
  if (s_.language.others && !s_.c.cycles.modal()) s_.modal.motion_kind = before;
}

// A motion word ends the cycle, with axis words beside it or not (G00, G01 and the cycles are one group on
// Fanuc, Haas and LinuxCNC), and an F is that of the holes behind it.
bool ShapeReader::take_modes_under_cycle(const LineMotion& m) {
  if (m.named) {
    s_.modal.cycle.reset();
    return true;
  }
  if (!m.has_feed) return true;
  if (s_.modal.cycle->kind == Hole::Kind::tap) {
    s_.error(std::max(m.column, 1U), "another F under a tapping cycle: it stands with the cycle's own words");
    return false;
  }
  s_.modal.cycle->feed = s_.feed;
  return true;
}

void ShapeReader::run_next_hole(const LineMotion& m) {
  const auto refuse = [&](const char* why) { s_.error(m.column, why); };
  if (s_.spindle_turns_at_nothing(m.column)) return;
  // A shift, an offset or a length since: which of them its heights count from, controls differ in.
  if ((s_.modal.position.mask & kXyz) != kXyz)
    return refuse("a drilling cycle goes on in other coordinates than those in which it began: say it anew");
  if (s_.language.others && s_.language.others->in_other_plane())
    return refuse("a drilling cycle goes on in another plane");
  // LinuxCNC counts its heights from where the tool is, then.
  if (s_.language.others && s_.language.others->in_increments())
    return refuse("a drilling cycle goes on in increments: controls differ in what its heights are then");
  std::int64_t rpm = 0;
  if (s_.language.others && s_.modal.cycle->kind == Hole::Kind::tap && s_.kept.has(Placeholder::rpm) &&
      to_rounded_quanta(s_.kept[Placeholder::rpm], 0, rpm) && rpm != s_.modal.cycle->thread.rpm)
    return refuse("another speed under a tapping cycle: it must come before the words of the cycle");
  if ((m.words.mask & ~kPlaneWords) != 0) {
    return refuse("under a drilling cycle X and Y may follow; all other words with the cycle's own");
  }
  if (s_.language.others && s_.language.others->per_revolution() && s_.modal.cycle->kind != Hole::Kind::tap)
    s_.modal.cycle->feed = s_.feed;  // as the spindle turns now
  const auto place = [&](AxisLetter letter) {
    return m.words.has(letter) ? m.words[letter] : s_.modal.position[letter];
  };
  run_hole(place(AxisLetter::X), place(AxisLetter::Y), m.column);
}

void ShapeReader::run_probe(const FoundEvent& found) {
  s_.modal.motion_kind.reset();
  s_.modal.cycle.reset();
  if (!shape_may_begin(found)) return;
  std::int64_t own = 0;
  const Number* feed = s_.value(found, Placeholder::feed);
  if (feed == nullptr || !to_rounded_quanta(*feed, s_.c.numbers.feed.per_minute_decimals, own) || own <= 0)
    return s_.error(found.column, "a touch without feed");
  s_.check_point_of_feed(*feed, found.column);
  s_.feed = own;
  const int decimals = s_.language.format.decimals(AxisLetter::X);
  Probe probe;
  probe.feed = own;
  probe.guards = found.event.argument == kGuards || found.event.argument == kGuardsFirst;
  probe.first = found.event.argument == kGuardsFirst;
  probe.from = s_.modal.position;
  probe.words = s_.modal.position;
  const bool says_way = !probe.guards && holds(s_.c.probing.touch, Placeholder::dx);
  double square = 0.0;
  for (std::size_t i = 0; i < kPlaceXyz.size(); ++i) {
    const AxisLetter letter = kAllAxisLetters[i];
    const std::int64_t value = s_.scaled(found, says_way ? kWayXyz[i] : kPlaceXyz[i], decimals);
    probe.words.set(letter, says_way ? s_.modal.position[letter] + value : value);
    square += static_cast<double>(value) * static_cast<double>(value);
  }
  if (says_way && holds(s_.c.probing.touch, Placeholder::distance)) {
    const auto distance = static_cast<double>(s_.scaled(found, Placeholder::distance, decimals));
    if (std::abs(distance - std::sqrt(square)) > 1.0)
      return s_.error(found.column, "the length of the touch is not that of its motion in X, Y and Z");
  }
  probe.source = {s_.findings.line, found.column};
  if (probe.guards) {
    for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z})
      s_.modal.position.set(letter, probe.words[letter]);
  } else {
    s_.modal.position.forget(kLinearAxes);
  }
  s_.emit(probe);
}

void ShapeReader::run_hole(std::int64_t x, std::int64_t y, std::uint32_t column) {
  Hole hole = *s_.modal.cycle;
  hole.from = xyz_of(s_.modal.position);
  hole.source = {s_.findings.line, column};
  s_.modal.position.set(AxisLetter::X, x);
  s_.modal.position.set(AxisLetter::Y, y);
  s_.modal.position.set(AxisLetter::Z, s_.modal.cycle->words[AxisLetter::Z]);
  hole.words = s_.modal.position;
  if (hole.kind == Hole::Kind::tap) s_.modal.spindle.reset();
  s_.emit(hole);
}

}  // namespace trunnion::nc
