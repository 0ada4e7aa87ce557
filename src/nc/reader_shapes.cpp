// Arcs, drilling cycles and touches of a probe.
#include <algorithm>
#include <cmath>

#include "nc/digits.hpp"
#include "nc/reader_state.hpp"

namespace trunnion::nc {
namespace {

constexpr double kFarthestCenter_mm = 1e7;  // far beyond any machine

}  // namespace

namespace {

AxisWords xyz_of(const AxisWords& position) {
  AxisWords out = position;
  out.mask &= kXyz;
  return out;
}

}  // namespace

bool Reader::State::shape_may_begin(const FoundEvent& found) {
  if (!may_move(found.column)) return false;
  const char* what = found.event.kind == EventKind::arc     ? "an arc"
                     : found.event.kind == EventKind::probe ? "a touch"
                                                            : "a drilling cycle";
  if ((modal.position.mask & kXyz) != kXyz) {
    error(found.column, std::string(what) + " from a place that is not known");
    return false;
  }
  if (modal.feed_mode != FeedMode::per_minute) {
    error(found.column, std::string(what) + " under inverse time is not read");
    return false;
  }
  return true;
}

// The words of [input] have been resolved already.
void Reader::State::run_arc_of_others(const FoundEvent& found) {
  Arc arc = language.others->arc();
  arc.feed = feed;
  arc.from = xyz_of(modal.position);
  arc.source = {findings.line, found.column};
  std::array<double, 2> radius{};
  for (std::size_t i = 0; i < 2; ++i) {
    const AxisLetter letter = plane_axes(arc.plane)[i];
    const auto mm = [&](std::int64_t quanta) { return language.format.internal(letter, quanta); };
    if (std::abs(mm(arc.center[i])) > kFarthestCenter_mm)
      return error(found.column,
                   "an arc whose centre is beyond " + std::to_string(kFarthestCenter_mm) + " mm");
    radius[0] = std::hypot(radius[0], mm(arc.from[letter] - arc.center[i]));
    radius[1] = std::hypot(radius[1], mm(arc.words[letter] - arc.center[i]));
  }
  if (std::abs(radius[0] - radius[1]) > c.arc_radii_may_differ_mm() || radius[0] == 0.0) {
    return error(found.column, "an arc whose radius to the start is " + std::to_string(radius[0]) +
                                   " mm and to the end " + std::to_string(radius[1]) + " mm");
  }
  modal.position = arc.words;
  emit(arc);
}

void Reader::State::run_arc(const FoundEvent& found) {
  modal.motion_kind.reset();
  if (!shape_may_begin(found)) return;
  if (feed <= 0) return error(found.column, "an arc without feed");
  if (language.others && found.pattern == nullptr) return run_arc_of_others(found);
  const int decimals = language.format.decimals(AxisLetter::X);
  Arc arc;
  arc.clockwise = found.event.argument == 1;
  arc.feed = feed;
  arc.from = xyz_of(modal.position);
  arc.source = {findings.line, found.column};
  const std::int64_t center[2] = {scaled(found, Placeholder::i, decimals),
                                  scaled(found, Placeholder::j, decimals)};
  const std::int64_t end[2] = {scaled(found, Placeholder::x, decimals),
                               scaled(found, Placeholder::y, decimals)};
  std::array<double, 2> radius{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto letter = static_cast<AxisLetter>(i);
    // Its chords are counted: the centre of a mistyped number would ask for more than there is memory.
    if (const double at_mm = language.format.internal(letter, center[i]);
        std::abs(at_mm) > kFarthestCenter_mm) {
      return error(found.column, "an arc whose centre is " + std::to_string(at_mm) + " mm away in " +
                                     letter_of(letter) + ", more than " + std::to_string(kFarthestCenter_mm) +
                                     " mm");
    }
    arc.center[i] = center[i] + (c.arcs.center_absolute ? 0 : modal.position[letter]);
    radius[0] =
        std::hypot(radius[0], language.format.internal(letter, modal.position[letter] - arc.center[i]));
    radius[1] = std::hypot(radius[1], language.format.internal(letter, end[i] - arc.center[i]));
  }
  if (std::abs(radius[0] - radius[1]) > c.arcs.radius_tolerance_mm + 1e-9 || radius[0] == 0.0) {
    return error(found.column, "an arc whose radius to the start is " + std::to_string(radius[0]) +
                                   " mm and to the end " + std::to_string(radius[1]) + " mm");
  }
  modal.position.set(AxisLetter::X, end[0]);
  modal.position.set(AxisLetter::Y, end[1]);
  if (found.captures.has(Placeholder::z))
    modal.position.set(AxisLetter::Z, scaled(found, Placeholder::z, decimals));
  arc.words = modal.position;
  emit(arc);
}

void Reader::State::run_cycle(const FoundEvent& found) {
  modal.motion_kind.reset();
  if (!shape_may_begin(found)) return;
  const int decimals = language.format.decimals(AxisLetter::X);
  // A value on a line before counts only where the cycle's own words have it there.
  const auto kind = static_cast<std::size_t>(found.event.argument);
  const auto given = [&](Placeholder p) {
    return found.captures.has(p) ||
           (kept.has(p) && (holds(c.cycles.plain[kind], p) || holds(c.cycles.dwell[kind], p)));
  };
  Hole hole;
  hole.kind = static_cast<Hole::Kind>(found.event.argument);
  hole.clear = scaled(found, Placeholder::clear, decimals);
  hole.bottom = given(Placeholder::bottom) ? scaled(found, Placeholder::bottom, decimals)
                                           : hole.clear + scaled(found, Placeholder::depth, decimals);
  if (given(Placeholder::step)) hole.step = scaled(found, Placeholder::step, decimals);
  hole.dwell_ms = given(Placeholder::milliseconds) ? whole(found, Placeholder::milliseconds, 0)
                                                   : scaled(found, Placeholder::seconds, 3);
  if (given(Placeholder::feed)) {
    const Number& number = (found.captures.has(Placeholder::feed) ? found.captures : kept)[Placeholder::feed];
    if (!to_rounded_quanta(number, c.numbers.feed.decimals(modal.feed_mode), hole.feed)) hole.feed = 0;
    if (language.others) hole.feed = language.others->length(hole.feed);
    if (c.cycles.modal()) feed = hole.feed;  // an F word as any other
  } else {
    hole.feed = feed;
  }
  if (hole.feed <= 0) return error(found.column, "a drilling cycle without feed");
  if (!(hole.bottom < hole.clear))
    return error(found.column, "a drilling cycle whose bottom is not below its clearance");
  const bool steps = hole.kind == Hole::Kind::peck || hole.kind == Hole::Kind::chip_break;
  const bool has_step = steps || given(Placeholder::step);
  if (has_step && hole.step == 0) return error(found.column, "a drilling cycle with a step of nothing");
  if (has_step && hole.step < 0) return error(found.column, "a drilling cycle with a step below 0");
  constexpr std::int64_t kMostSteps = 10000;
  if (has_step && (hole.clear - hole.bottom) / hole.step > kMostSteps)
    return error(found.column, "a drilling cycle of more than " + std::to_string(kMostSteps) + " steps");
  // A step of the whole depth is none.
  if (given(Placeholder::step) && (steps || hole.kind == Hole::Kind::drill)) {
    const bool whole_depth = hole.step >= hole.clear - hole.bottom;
    if (whole_depth) hole.step = 0;
    hole.kind = whole_depth                      ? Hole::Kind::drill
                : hole.kind == Hole::Kind::drill ? Hole::Kind::peck
                                                 : hole.kind;
  }
  if (!modal.cycle) cycle_return.initial = modal.position[AxisLetter::Z];
  std::int64_t back = cycle_return.to_clear ? hole.clear : std::max(cycle_return.initial, hole.clear);
  if (given(Placeholder::back)) back = scaled(found, Placeholder::back, decimals);
  if (given(Placeholder::rise)) back = hole.clear + scaled(found, Placeholder::rise, decimals);
  if (back < hole.clear) return error(found.column, "a drilling cycle that returns below its clearance");
  hole.words.set(AxisLetter::Z, back);
  const auto place = [&](Placeholder p, AxisLetter letter) {
    return found.captures.has(p) ? scaled(found, p, decimals) : modal.position[letter];
  };
  modal.cycle = hole;
  run_hole(place(Placeholder::x, AxisLetter::X), place(Placeholder::y, AxisLetter::Y), found.column);
  if (!c.cycles.modal()) modal.cycle.reset();
}

bool Reader::State::run_next_hole(const LineMotion& m) {
  if (m.named) {
    modal.cycle.reset();
    return false;
  }
  if (language.others && language.others->in_other_plane()) {
    error(m.column, "a drilling cycle goes on in another plane");
    return true;
  }
  if ((m.words.mask & ~kPlaneWords) != 0) {
    error(m.column, "under a drilling cycle X and Y may follow; all other words with the cycle's own");
    return true;
  }
  const auto place = [&](AxisLetter letter) {
    return m.words.has(letter) ? m.words[letter] : modal.position[letter];
  };
  run_hole(place(AxisLetter::X), place(AxisLetter::Y), m.column);
  return true;
}

void Reader::State::run_probe(const FoundEvent& found) {
  modal.motion_kind.reset();
  modal.cycle.reset();
  if (!shape_may_begin(found)) return;
  std::int64_t own = 0;
  if (!to_rounded_quanta(found.captures[Placeholder::feed], c.numbers.feed.per_minute_decimals, own) ||
      own <= 0)
    return error(found.column, "a touch without feed");
  feed = own;
  const int decimals = language.format.decimals(AxisLetter::X);
  Probe probe;
  probe.feed = own;
  probe.from = modal.position;
  probe.words = modal.position;
  probe.words.set(AxisLetter::X, scaled(found, Placeholder::x, decimals));
  probe.words.set(AxisLetter::Y, scaled(found, Placeholder::y, decimals));
  probe.words.set(AxisLetter::Z, scaled(found, Placeholder::z, decimals));
  probe.source = {findings.line, found.column};
  modal.position.forget(kLinearAxes);
  emit(probe);
}

void Reader::State::run_hole(std::int64_t x, std::int64_t y, std::uint32_t column) {
  Hole hole = *modal.cycle;
  hole.from = xyz_of(modal.position);
  hole.source = {findings.line, column};
  modal.position.set(AxisLetter::X, x);
  modal.position.set(AxisLetter::Y, y);
  modal.position.set(AxisLetter::Z, modal.cycle->words[AxisLetter::Z]);
  hole.words = modal.position;
  emit(hole);
}

}  // namespace trunnion::nc
