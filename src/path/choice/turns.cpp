#include "path/choice/turns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion::path {
namespace {

constexpr double kDefaultLinearRate_mm_s = 30000.0 / kSecondsPerMinute;
constexpr double kDefaultRotaryRate_rad_s = 9000.0 * kRadPerDegree / kSecondsPerMinute;

}  // namespace

double seconds_per_unit(const Axis& axis) {
  return 1.0 / axis.rapid.value_or(axis.kind == AxisKind::linear ? kDefaultLinearRate_mm_s
                                                                 : kDefaultRotaryRate_rad_s);
}

Turns::Turns(const Axis& axis, double angle, double near, std::size_t most, bool both_ways)
    : axis_(axis), angle_(angle), near_(near) {
  if (!axis.has_limits()) {
    count_ = both_ways ? 2 : 1;
    return;
  }
  least_ = first_ = std::ceil((axis.min - angle - kAtLimit) / kTwoPi);
  most_ = std::floor((axis.max - angle + kAtLimit) / kTwoPi);
  if (least_ > most_) return;
  const double within = most_ - least_ + 1.0;
  left_out_ = within > static_cast<double>(most);
  count_ = left_out_ ? most : static_cast<std::size_t>(within);
  if (!left_out_) return;
  const double taken = static_cast<double>(most);
  const double nearest = (near - angle) / kTwoPi;
  first_ = std::clamp(std::ceil(nearest - 0.5 * taken), least_, most_ + 1.0 - taken);
}

double Turns::at(std::size_t i) const {
  if (axis_.has_limits())
    return std::clamp(angle_ + (first_ + static_cast<double>(i)) * kTwoPi, axis_.min, axis_.max);
  const double nearest = std::abs(near_ - angle_) < kPi ? angle_ : *nearest_turn(axis_, angle_, near_);
  return i == 0 ? nearest : nearest - std::copysign(kTwoPi, nearest - near_);
}

double Turns::nearest_left_out() const {
  const double below =
      first_ > least_ ? angle_ + (first_ - 1.0) * kTwoPi : -std::numeric_limits<double>::max();
  const double behind = first_ + static_cast<double>(count_);
  const double above = behind <= most_ ? angle_ + behind * kTwoPi : std::numeric_limits<double>::max();
  return near_ - below < above - near_ ? below : above;
}

}  // namespace trunnion::path
