#include "trunnion/machine/motion_time.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {

bool MotionTime::is_known(const Machine& machine) {
  return std::all_of(machine.axes.begin(), machine.axes.end(),
                     [](const Axis& axis) { return axis.acceleration.has_value(); });
}

double MotionTime::of(const JointVector& from, const JointVector& to, double seconds) const {
  double square_s = 0.0;  // of the time in which the block could be begun and half run
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    square_s = std::max(square_s, std::abs(to[id] - from[id]) / *machine_.axes[id].acceleration);
  if (square_s == 0.0) return seconds;
  if (!stops_) return std::max(seconds, std::sqrt(2.0 * square_s));
  return seconds * seconds > square_s ? seconds + square_s / seconds : 2.0 * std::sqrt(square_s);
}

}  // namespace trunnion
