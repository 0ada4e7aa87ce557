#include "machine/axis_ways.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {

AxisWays::AxisWays(const Machine& machine, const JointVector& digits) {
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    acceleration_[id] = *machine.axes[id].acceleration;
    per_acceleration_[id] = 1.0 / acceleration_[id];
    is_linear_[id] = machine.axes[id].kind == AxisKind::linear;
    digits_[id] = digits[id] / acceleration_[id];
  }
}

void AxisWays::put(const JointVector& from, const JointVector& to, double seconds, AxisWay& out) const {
  double length2 = 0.0;
  double longest = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double way = (to[id] - from[id]) * per_acceleration_[id];
    out.along[id] = way;
    length2 += way * way;
    longest = std::max(longest, std::abs(way));
  }
  out.length = std::sqrt(length2);
  out.asked_s = seconds;
  if (!(out.length > 0.0)) return;
  out.per_length = 1.0 / out.length;
  out.acceleration = out.length / longest;
  out.fastest2 = length2 / (seconds * seconds);
  for (double& along : out.along) along *= out.per_length;
}

double AxisWays::turn_of(AxisId id, const AxisWay& before, const AxisWay& next) const {
  const double rounded = digits_[id] * (before.per_length + next.per_length);
  return std::max(0.0, std::abs(next.along[id] - before.along[id]) - rounded);
}

double AxisWays::linear_turn(const AxisWay& before, const AxisWay& next) const {
  double turn2_mm2 = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double by = is_linear_[id] ? (next.along[id] - before.along[id]) * acceleration_[id] : 0.0;
    turn2_mm2 += by * by;
  }
  return std::sqrt(turn2_mm2);
}

}  // namespace trunnion
