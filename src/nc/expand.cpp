#include "trunnion/nc/expand.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::nc {
namespace {

double mm(const AxisFormat& format, std::int64_t quanta) {
  return format.internal(AxisLetter::X, quanta);
}

}  // namespace

ArcCourse course_of(const Arc& arc, const AxisFormat& format, double chord_mm) {
  TRUNNION_EXPECTS(chord_mm > 0.0);
  const auto [first, second, third] = plane_axes(arc.plane);
  const double center[2] = {mm(format, arc.center[0]), mm(format, arc.center[1])};
  const auto at = [&](const AxisWords& words, AxisLetter letter) { return mm(format, words[letter]); };
  const double start[2] = {at(arc.from, first) - center[0], at(arc.from, second) - center[1]};
  const double end[2] = {at(arc.words, first) - center[0], at(arc.words, second) - center[1]};
  const double start_radius = std::hypot(start[0], start[1]);
  const double end_radius = std::hypot(end[0], end[1]);
  const double sense = arc.clockwise ? -1.0 : 1.0;
  const bool closed = arc.from[first] == arc.words[first] && arc.from[second] == arc.words[second];
  double sweep =
      sense * std::atan2(start[0] * end[1] - start[1] * end[0], start[0] * end[0] + start[1] * end[1]);
  if (closed) {
    sweep = kTwoPi;
  } else if (sweep <= 0.0) {
    sweep += kTwoPi;
  }
  ArcCourse out;
  out.radius_mm = std::max(start_radius, end_radius);
  out.sweep_rad = sweep;
  // As in cl/arc.cpp: r (1 - cos(d/2)) = 2 r sin^2(d/4).
  const double step = 4.0 * std::asin(std::sqrt(std::min(0.5, chord_mm / (2.0 * out.radius_mm))));
  const auto count =
      static_cast<std::size_t>(std::max(1.0, std::ceil(sweep / std::min(step, kTwoPi / 4.0) - 1e-9)));
  const double z0 = at(arc.from, third);
  const double z1 = at(arc.words, third);
  const auto put = [&, a = index(first), b = index(second), c = index(third)](double along, double across,
                                                                              double up) {
    std::array<double, 3> xyz{};
    xyz[a] = along;
    xyz[b] = across;
    xyz[c] = up;
    out.xyz_mm.push_back(xyz);
  };
  out.xyz_mm.reserve(count);
  const double angle = std::atan2(start[1], start[0]);
  for (std::size_t i = 1; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count);
    const double radius = start_radius + t * (end_radius - start_radius);
    const double turned = angle + sense * t * sweep;
    put(center[0] + radius * std::cos(turned), center[1] + radius * std::sin(turned), z0 + t * (z1 - z0));
  }
  put(at(arc.words, first), at(arc.words, second), z1);
  const double quarter = std::sin(sweep / static_cast<double>(count) / 4.0);
  out.off_chord_mm = 2.0 * out.radius_mm * quarter * quarter + std::abs(end_radius - start_radius);
  return out;
}

std::vector<Stroke> strokes_of(const Hole& hole, const Controller::Cycles& cycles, const AxisFormat& format) {
  TRUNNION_EXPECTS(hole.bottom < hole.clear);
  std::vector<Stroke> out;
  std::array<double, 3> at{mm(format, hole.from[AxisLetter::X]), mm(format, hole.from[AxisLetter::Y]),
                           mm(format, hole.from[AxisLetter::Z])};
  const auto go = [&](bool rapid, double z) {
    if (at[2] == z) return;
    at[2] = z;
    out.push_back({rapid, at, 0.0});
  };
  const double clear = mm(format, hole.clear);
  const double bottom = mm(format, hole.bottom);
  if (at[2] < clear) go(true, clear);
  const double x = mm(format, hole.words[AxisLetter::X]);
  const double y = mm(format, hole.words[AxisLetter::Y]);
  if (at[0] != x || at[1] != y) {
    at = {x, y, at[2]};
    out.push_back({true, at, 0.0});
  }
  go(true, clear);
  if (hole.kind == Hole::Kind::peck || hole.kind == Hole::Kind::chip_break) {
    TRUNNION_EXPECTS(hole.step > 0);
    for (std::int64_t z = hole.clear - hole.step; z > hole.bottom; z -= hole.step) {
      const double depth = mm(format, z);
      go(false, depth);
      if (hole.kind == Hole::Kind::peck) go(true, clear);
      go(true, depth + cycles.back_mm);
    }
  }
  go(false, bottom);
  out.back().dwell_s = static_cast<double>(hole.dwell_ms) / 1000.0;
  const double back = mm(format, hole.words[AxisLetter::Z]);
  if (hole.kind == Hole::Kind::tap) go(false, clear);
  if (hole.kind == Hole::Kind::feed_out)
    go(false, cycles.dwell_feeds_to_return && hole.dwell_ms > 0 ? back : clear);
  go(true, back);
  return out;
}

}  // namespace trunnion::nc
