#include "trunnion/machine/motion_time.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

namespace trunnion {
namespace {

// Two blocks at a time: each has half of the acceleration.
constexpr double kBlendingShare = 2.0;

}  // namespace

bool MotionTime::is_known(const Machine& machine) {
  return std::all_of(machine.axes.begin(), machine.axes.end(),
                     [](const Axis& axis) { return axis.acceleration.has_value(); });
}

double MotionTime::square_seconds(const JointVector& from, const JointVector& to) const {
  double square_s = 0.0;
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    square_s = std::max(square_s, std::abs(to[id] - from[id]) / *machine_.axes[id].acceleration);
  return square_s;
}

double MotionTime::least_seconds(const JointVector& from, const JointVector& to) const {
  return std::sqrt(blend_mm_ ? kBlendingShare * square_seconds(from, to) : square_seconds(from, to));
}

double MotionTime::go(const JointVector& from, const JointVector& to, double seconds) {
  double square_s = square_seconds(from, to);
  double linear2_mm2 = 0.0;
  double rotary2_rad2 = 0.0;
  Vec3 way = Vec3::Zero();
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const Axis& axis = machine_.axes[id];
    const double by = to[id] - from[id];
    if (axis.kind == AxisKind::linear) {
      linear2_mm2 += by * by;
      way += by * axis.direction;
    } else {
      rotary2_rad2 += by * by;
    }
  }
  if (square_s == 0.0) return seconds;
  if (!blend_mm_)
    return seconds * seconds > square_s ? seconds + square_s / seconds : 2.0 * std::sqrt(square_s);
  square_s *= kBlendingShare;
  const double lasts_s = std::max(seconds, std::sqrt(square_s));
  Block block;
  block.length = linear2_mm2 > 0.0 ? std::sqrt(linear2_mm2) : std::sqrt(rotary2_rad2) * kDegreePerRad;
  if (linear2_mm2 > 0.0 && way.norm() > 0.0) block.direction = way.normalized();
  block.speed = block.length / lasts_s;
  block.acceleration = block.length / square_s;
  const double of_corner_s =
      before_ ? (before_->speed - corner_speed(*before_, block)) / before_->acceleration : 0.0;
  before_ = block;
  return lasts_s + of_corner_s;
}

double MotionTime::stop() {
  const double out = before_ ? before_->speed / before_->acceleration : 0.0;
  before_.reset();
  return out;
}

double MotionTime::corner_speed(const Block& before, const Block& next) const {
  // Neither block gives more than half of itself to the corner; beyond the longer of the two ramps there is
  // nothing to be gained.
  const double room_s = std::min(before.length / before.speed, next.length / next.speed);
  const double ramps_s = std::max(before.speed / before.acceleration, next.speed / next.acceleration);
  double speed = std::min(before.speed, before.acceleration * std::min(room_s, ramps_s));
  // Slowing down from v takes d = v^2 / 2a. Where the next block begins there the tool passes the corner at
  // d cos(half the angle between the blocks) / 2.
  const double cosine = std::sqrt(std::max(0.0, 0.5 * (1.0 - before.direction.dot(next.direction))));
  if (cosine * speed * speed > 4.0 * before.acceleration * *blend_mm_)
    speed = 2.0 * std::sqrt(before.acceleration * *blend_mm_ / cosine);
  return speed;
}

}  // namespace trunnion
