#include "post/feed_plan.hpp"

#include <algorithm>
#include <cmath>

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

FeedPlanner::FeedPlanner(const Machine& machine, const nc::Controller& controller, FeedOutput output)
    : count_(machine.axes.size()), controller_(controller), output_(output) {
  for (AxisId id = 0; id < count_; ++id) {
    const Axis& axis = machine.axes[id];
    const double rapid = rapid_rate(axis);
    axes_[id] = {axis.kind == AxisKind::linear, rapid, axis.max_feed.value_or(rapid)};
  }
}

double FeedPlanner::slowest_axis_s(const JointVector& a, const JointVector& b) const {
  double seconds = 0.0;
  for (AxisId id = 0; id < count_; ++id) {
    seconds = std::max(seconds, std::abs(b[id] - a[id]) / axes_[id].feed);
  }
  return seconds;
}

double FeedPlanner::rapid_seconds(const JointVector& a, const JointVector& b) const {
  double seconds = 0.0;
  for (AxisId id = 0; id < count_; ++id) {
    seconds = std::max(seconds, std::abs(b[id] - a[id]) / axes_[id].rapid);
  }
  return seconds;
}

double FeedPlanner::control_path(const JointVector& a, const JointVector& b, bool& rotary_only) const {
  double linear = 0.0;
  double rotary = 0.0;
  for (AxisId id = 0; id < count_; ++id) {
    const double d = b[id] - a[id];
    (axes_[id].linear ? linear : rotary) += d * d;
  }
  rotary_only = linear == 0.0;
  if (rotary_only) return std::sqrt(rotary);
  if (controller_.feed.path == nc::FeedPath::linear_first) return std::sqrt(linear);
  return std::sqrt(linear + rotary * kDegreePerRad * kDegreePerRad);  // one degree counts as one millimetre
}

double FeedPlanner::seconds_of(const JointVector& a, const JointVector& b, double tip_mm, nc::FeedMode mode,
                               std::int64_t feed) const {
  const nc::FeedFormat& format = controller_.numbers.feed;
  if (feed <= 0) return 0.0;
  if (mode == nc::FeedMode::inverse_time) return 1.0 / format.internal(mode, feed);
  if (tip_mm > 0.0) return tip_mm / format.internal(mode, feed);
  bool rotary_only = false;
  const double path = control_path(a, b, rotary_only);
  return path / (rotary_only ? format.rotary_internal(feed) : format.internal(mode, feed));
}

BlockFeed FeedPlanner::plan(const JointVector& a, const JointVector& b, double tip_mm,
                            double feed_mm_s) const {
  bool turns = false;
  for (AxisId id = 0; id < count_; ++id) {
    turns = turns || (!axes_[id].linear && a[id] != b[id]);
  }
  const double tip_s = tip_mm / feed_mm_s;
  const double axes_s = slowest_axis_s(a, b);
  double seconds = std::max(tip_s, axes_s);
  BlockFeed out;
  // Where the tip's own time is below a thousandth of the axes' it is no measure of a feed: nothing is "lost"
  // then.
  constexpr double kTipMoves = 1e-3;
  if (tip_s > kTipMoves * axes_s) out.lost_s = seconds - tip_s;
  const nc::FeedFormat& format = controller_.numbers.feed;
  if (turns && output_ == FeedOutput::inverse && controller_.has_inverse_time()) {
    out.mode = nc::FeedMode::inverse_time;
    if (controller_.feed.max_inverse_time)
      seconds = std::max(seconds, kSecondsPerMinute / *controller_.feed.max_inverse_time);
    out.quanta = format.quanta(out.mode, 1.0 / seconds);
    out.seconds = 1.0 / format.internal(out.mode, out.quanta);
    return out;
  }
  bool rotary_only = false;
  double path = control_path(a, b, rotary_only);
  if (output_ == FeedOutput::tip && tip_mm > 0.0) {
    path = tip_mm;
    rotary_only = false;
  }
  double rate = path / seconds;
  if (rotary_only && turns) {
    out.quanta = format.rotary_quanta(rate);
    out.seconds = path / format.rotary_internal(out.quanta);
    return out;
  }
  if (controller_.feed.max_per_minute)
    rate = std::min(rate, *controller_.feed.max_per_minute / kSecondsPerMinute);
  out.quanta = format.quanta(out.mode, rate);
  out.seconds = path / format.internal(out.mode, out.quanta);
  return out;
}

}  // namespace trunnion::post
