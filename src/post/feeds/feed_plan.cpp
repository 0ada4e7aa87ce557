#include "post/feeds/feed_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/lanes.hpp"

namespace trunnion::post {
namespace {

// Rates of a rotary axis whose machine file gives none, for durations of moves in which the tip stands still:
// slow is safe.
constexpr double kDefaultRotary_rad_s = 3600.0 * kRadPerDegree / kSecondsPerMinute;
constexpr double kDefaultLinear_mm_s = 10000.0 / kSecondsPerMinute;

constexpr double kRoundedWay = 2.0;  // quanta: root of 3, half a quantum of X Y Z at either end

double rapid_rate(const Axis& axis) {
  return axis.rapid.value_or(axis.kind == AxisKind::rotary ? kDefaultRotary_rad_s : kDefaultLinear_mm_s);
}

}  // namespace

FeedPlanner::FeedPlanner(const Machine& machine, const nc::Controller& controller, FeedOutput output)
    : count_(machine.axes.size()),
      controller_(controller),
      output_(output),
      inverse_(output == FeedOutput::inverse && controller.has_inverse_time()),
      rounding_mm_(kRoundedWay * controller.numbers.axes.quantum(nc::AxisLetter::X)) {
  feed_.fill(1.0);
  for (AxisId id = 0; id < kMaxAxes; ++id) linear_share_[id] = 1.0;
  for (AxisId id = 0; id < count_; ++id) {
    const Axis& axis = machine.axes[id];
    const double rapid = rapid_rate(axis);
    const double feed = axis.max_feed.value_or(rapid);
    axes_[id] = {axis.kind == AxisKind::linear, rapid, feed};
    feed_[id] = feed;
    linear_share_[id] = axes_[id].linear ? 1.0 : 0.0;
  }
  for (AxisId id = 0; id < kMaxAxes; ++id) rotary_share_[id] = 1.0 - linear_share_[id];
  set_slowness();
}

void FeedPlanner::set_slowness() {
  constexpr double kMore = 1.0 + 1e-12;  // far above the rounding of a product
  for (AxisId id = 0; id < kMaxAxes; ++id) slowness_[id] = kMore / feed_[id];
}

double FeedPlanner::slowest_axis_s(const JointVector& a, const JointVector& b) const {
  static_assert(kMaxAxes == 5, "two pairs and one");
  const auto pair = [&](AxisId id) {
    const Lanes way = Lanes{b[id], b[id + 1]} - Lanes{a[id], a[id + 1]};
    return lanes::abs(way) / Lanes{feed_[id], feed_[id + 1]};
  };
  const Lanes larger = lanes::larger(pair(0), pair(2));
  return std::max({larger[0], larger[1], std::abs(b[4] - a[4]) / feed_[4]});
}

AxisId FeedPlanner::slowest_axis(const JointVector& a, const JointVector& b) const {
  AxisId slowest = 0;
  double seconds = -1.0;
  for (AxisId id = 0; id < count_; ++id) {
    const double needs = std::abs(b[id] - a[id]) / feed_[id];
    if (needs <= seconds) continue;
    seconds = needs;
    slowest = id;
  }
  return slowest;
}

double FeedPlanner::linear_rate_mm_s() const {
  double rate = std::numeric_limits<double>::infinity();
  for (AxisId id = 0; id < count_; ++id) {
    if (axes_[id].linear) rate = std::min(rate, feed_[id]);
  }
  return rate;
}

void FeedPlanner::limit_rotary(double rad_s) {
  rotary_rad_s_ = rad_s;
  limit_turn(std::numeric_limits<double>::infinity());
}

void FeedPlanner::limit_turn(double rad_s) {
  for (AxisId id = 0; id < count_; ++id) {
    if (!axes_[id].linear) feed_[id] = std::min({axes_[id].most, rotary_rad_s_, rad_s});
  }
  set_slowness();
}

double FeedPlanner::rapid_seconds(const JointVector& a, const JointVector& b) const {
  double seconds = 0.0;
  for (AxisId id = 0; id < count_; ++id) {
    seconds = std::max(seconds, std::abs(b[id] - a[id]) / axes_[id].rapid);
  }
  return seconds;
}

FeedPlanner::ControlPath FeedPlanner::control_path(const JointVector& a, const JointVector& b,
                                                   const std::optional<double>& tcp_way_mm) const {
  double linear = 0.0;
  double rotary = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double d = b[id] - a[id];
    const double d2 = d * d;
    linear += d2 * linear_share_[id];
    rotary += d2 * rotary_share_[id];
  }
  if (tcp_way_mm) linear = *tcp_way_mm * *tcp_way_mm;
  if (linear == 0.0) return {std::sqrt(rotary), true};
  // F is the feed of the tip under tool-centre-point control.
  if (tcp_way_mm || controller_.feed.path == nc::FeedPath::linear_first) return {std::sqrt(linear), false};
  // One degree counts as one millimetre.
  return {std::sqrt(linear + rotary * kDegreePerRad * kDegreePerRad), false};
}

double FeedPlanner::seconds_of(const JointVector& a, const JointVector& b, std::optional<double> tcp_way_mm,
                               nc::FeedMode mode, std::int64_t feed) const {
  return seconds_of(control_path(a, b, tcp_way_mm), mode, feed);
}

double FeedPlanner::seconds_of(const ControlPath& path, nc::FeedMode mode, std::int64_t feed) const {
  const nc::FeedFormat& format = controller_.numbers.feed;
  if (feed <= 0) return 0.0;
  if (mode == nc::FeedMode::per_minute) {
    return path.length / (path.rotary_only ? format.rotary_internal(feed) : format.internal(mode, feed));
  }
  const double seconds = 1.0 / format.internal(mode, feed);
  if (!controller_.feed.min_linear_rate_mm_s) return seconds;
  // The control knows one lowest number for both: mm/min and degrees/min.
  const double length = path.rotary_only ? path.length * kDegreePerRad : path.length;
  return length > 0.0 ? std::min(seconds, length / *controller_.feed.min_linear_rate_mm_s) : seconds;
}

// The largest F of this mode with which the block does not last less than `seconds` but for half a digit, and
// never less than the axes need. Per minute of linear axes it is `rate_mm_s`.
BlockFeed FeedPlanner::in_mode(nc::FeedMode mode, const ControlPath& path, double axes_s, double seconds,
                               double rate_mm_s) const {
  const nc::FeedFormat& format = controller_.numbers.feed;
  BlockFeed out;
  out.mode = mode;
  out.wanted_s = seconds;
  if (mode == nc::FeedMode::inverse_time) {
    if (controller_.feed.max_inverse_time)
      out.wanted_s = std::max(seconds, kSecondsPerMinute / *controller_.feed.max_inverse_time);
    out.quanta = format.quanta(mode, 1.0 / out.wanted_s);
  } else if (path.rotary_only) {
    out.quanta = format.rotary_quanta(path.length / seconds);
  } else {
    double rate = rate_mm_s;
    if (controller_.feed.max_per_minute)
      rate = std::min(rate, *controller_.feed.max_per_minute / kSecondsPerMinute);
    out.quanta = format.quanta(mode, rate);
  }
  const auto lasts = [&] { return seconds_of(path, mode, out.quanta); };
  out.seconds = lasts();
  if (out.seconds < axes_s && out.quanta > 1) {
    --out.quanta;
    out.seconds = lasts();
  }
  return out;
}

BlockFeed FeedPlanner::plan(const Move& move, double feed_mm_s) const {
  const auto turns = [&] {
    for (AxisId id = 0; id < count_; ++id) {
      if (!axes_[id].linear && move.a[id] != move.b[id]) return true;
    }
    return false;
  };
  const double tip_s = move.tip_mm / feed_mm_s;
  const double seconds = std::max(tip_s, move.axes_s);
  const bool inverse = inverse_ && turns();
  const ControlPath path = control_path(move.a, move.b, move.tcp_way_mm);
  const auto in = [&](nc::FeedMode mode) {
    return in_mode(mode, path, move.axes_s, seconds, path.length / seconds);
  };
  const double programmed_s = path.length / feed_mm_s;
  const bool as_programmed =
      !path.rotary_only && is_way_of_tip(path.length, move.tip_mm) && programmed_s >= move.axes_s;
  if (as_programmed && (move.tcp_way_mm || !turns()))
    return in_mode(nc::FeedMode::per_minute, path, move.axes_s, programmed_s, feed_mm_s);
  BlockFeed out = in(inverse ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute);
  if (inverse && (out.runs_away() || out.seconds < move.axes_s)) {
    // Below the lowest rate of inverse time; a feed per minute has none.
    const BlockFeed other = in(nc::FeedMode::per_minute);
    if (other.seconds > out.seconds) out = other;
    out.other_mode = true;
  }
  if (tip_s > kTipMoves * move.axes_s) out.lost_s = seconds - tip_s;
  return out;
}

}  // namespace trunnion::post
