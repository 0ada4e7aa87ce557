#include "post/feeds/axis_rates.hpp"

#include <cmath>

#include "trunnion/base/lanes.hpp"

namespace trunnion::post {
namespace {

// Rates of a rotary axis whose machine file gives none, for durations of moves in which the tip stands still:
// slow is safe.
constexpr double kDefaultRotary_rad_s = 3600.0 * kRadPerDegree / kSecondsPerMinute;
constexpr double kDefaultLinear_mm_s = 10000.0 / kSecondsPerMinute;

double rapid_rate(const Axis& axis) {
  return axis.rapid.value_or(axis.kind == AxisKind::rotary ? kDefaultRotary_rad_s : kDefaultLinear_mm_s);
}

}  // namespace

AxisRates::AxisRates(const Machine& machine) : count_(machine.axes.size()) {
  cutting_.fill(1.0);
  for (AxisId id = 0; id < kMaxAxes; ++id) linear_share_[id] = 1.0;
  for (AxisId id = 0; id < count_; ++id) {
    const Axis& axis = machine.axes[id];
    const double rapid = rapid_rate(axis);
    const double feed = axis.max_feed.value_or(rapid);
    of_[id] = {axis.kind == AxisKind::linear, rapid, feed};
    cutting_[id] = feed;
    linear_share_[id] = of_[id].linear ? 1.0 : 0.0;
  }
  for (AxisId id = 0; id < kMaxAxes; ++id) rotary_share_[id] = 1.0 - linear_share_[id];
  set_slowness();
}

void AxisRates::set_slowness() {
  constexpr double kMore = 1.0 + 1e-12;  // far above the rounding of a product
  for (AxisId id = 0; id < kMaxAxes; ++id) slowness_[id] = kMore / cutting_[id];
}

double AxisRates::slowest_axis_s(const JointVector& a, const JointVector& b) const {
  static_assert(kMaxAxes == 5, "two pairs and one");
  const auto pair = [&](AxisId id) {
    const Lanes way = Lanes{b[id], b[id + 1]} - Lanes{a[id], a[id + 1]};
    return lanes::abs(way) / Lanes{cutting_[id], cutting_[id + 1]};
  };
  const Lanes larger = lanes::larger(pair(0), pair(2));
  return std::max({larger[0], larger[1], std::abs(b[4] - a[4]) / cutting_[4]});
}

AxisId AxisRates::slowest_axis(const JointVector& a, const JointVector& b) const {
  AxisId slowest = 0;
  double seconds = -1.0;
  for (AxisId id = 0; id < count_; ++id) {
    const double needs = std::abs(b[id] - a[id]) / cutting_[id];
    if (needs <= seconds) continue;
    seconds = needs;
    slowest = id;
  }
  return slowest;
}

double AxisRates::linear_rate_mm_s() const {
  double rate = std::numeric_limits<double>::infinity();
  for (AxisId id = 0; id < count_; ++id) {
    if (of_[id].linear) rate = std::min(rate, cutting_[id]);
  }
  return rate;
}

bool AxisRates::turns(const JointVector& a, const JointVector& b) const {
  for (AxisId id = 0; id < count_; ++id) {
    if (!of_[id].linear && a[id] != b[id]) return true;
  }
  return false;
}

void AxisRates::limit_rotary(double rad_s) {
  rotary_rad_s_ = rad_s;
  limit_turn(std::numeric_limits<double>::infinity());
}

void AxisRates::limit_turn(double rad_s) {
  for (AxisId id = 0; id < count_; ++id) {
    if (!of_[id].linear) cutting_[id] = std::min({of_[id].most, rotary_rad_s_, rad_s});
  }
  set_slowness();
}

double AxisRates::rapid_seconds(const JointVector& a, const JointVector& b) const {
  double seconds = 0.0;
  for (AxisId id = 0; id < count_; ++id) seconds = std::max(seconds, std::abs(b[id] - a[id]) / of_[id].rapid);
  return seconds;
}

}  // namespace trunnion::post
