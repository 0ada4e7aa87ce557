#include "post/feeds/control_times.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/lanes.hpp"

namespace trunnion::post {

ControlTimes::Way ControlTimes::way(const JointVector& a, const JointVector& b,
                                    const std::optional<double>& tcp_way_mm) const {
  double linear = 0.0;
  double rotary = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double d = b[id] - a[id];
    const double d2 = d * d;
    linear += d2 * axes_.linear_share()[id];
    rotary += d2 * axes_.rotary_share()[id];
  }
  if (tcp_way_mm) linear = *tcp_way_mm * *tcp_way_mm;
  if (linear == 0.0) return {std::sqrt(rotary), true};
  // F is the feed of the tip under tool-centre-point control.
  if (tcp_way_mm || controller_.feed.path == nc::FeedPath::linear_first) return {std::sqrt(linear), false};
  // One degree counts as one millimetre.
  return {std::sqrt(linear + rotary * kDegreePerRad * kDegreePerRad), false};
}

double ControlTimes::seconds(const Way& way, nc::FeedMode mode, std::int64_t feed) const {
  const nc::FeedFormat& format = controller_.numbers.feed;
  if (feed <= 0) return 0.0;
  if (mode == nc::FeedMode::per_minute)
    return way.length / (way.rotary_only ? format.rotary_internal(feed) : format.internal(mode, feed));
  const double seconds = 1.0 / format.internal(mode, feed);
  if (!controller_.feed.min_linear_rate_mm_s) return seconds;
  // The control knows one lowest number for both: mm/min and degrees/min.
  const double length = way.rotary_only ? way.length * kDegreePerRad : way.length;
  return length > 0.0 ? std::min(seconds, length / *controller_.feed.min_linear_rate_mm_s) : seconds;
}

void ControlTimes::of_blocks(const Blocks& blocks, std::span<double> seconds,
                             std::span<double> slowest_s) const {
  lanes::at_a_time(lanes::way(), [&]<class T>() { of_few<T>(blocks, seconds, slowest_s); });
}

template <class T>
void ControlTimes::of_few(const Blocks& blocks, std::span<double> seconds,
                          std::span<double> slowest_s) const {
  const double scale = controller_.numbers.feed.scale(blocks.mode);
  const bool linear_first = controller_.feed.path == nc::FeedPath::linear_first;
  const double slowest_rate = controller_.feed.min_linear_rate_mm_s.value_or(0.0);
  const JointVector linear_share = axes_.linear_share();
  const JointVector rotary_share = axes_.rotary_share();
  const std::array<double, kMaxAxes> cutting = axes_.cutting();
  for (std::size_t i = 0; i < blocks.feed.size(); i += lanes::kCount<T>) {
    T linear{};
    T rotary{};
    T slowest{};
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      const T d = lanes::load<T>(blocks.q[id] + i + 1) - lanes::load<T>(blocks.q[id] + i);
      const T d2 = d * d;
      linear += d2 * linear_share[id];
      rotary += d2 * rotary_share[id];
      slowest = lanes::larger<T>(slowest, lanes::abs(d) / cutting[id]);
    }
    const auto rotary_only = linear == 0.0;
    const T both = linear_first ? linear : T(linear + rotary * kDegreePerRad * kDegreePerRad);
    const T length = lanes::sqrt(T(lanes::select(rotary_only, rotary, both)));
    const T quanta = lanes::collect<T>([&](std::size_t k) {
      return static_cast<double>(blocks.feed[std::min(i + k, blocks.feed.size() - 1)]);
    });
    const T rate = quanta / scale / kSecondsPerMinute;
    T lasts;
    if (blocks.mode == nc::FeedMode::per_minute) {
      lasts = length / lanes::select(rotary_only, T(rate * kRadPerDegree), rate);
    } else {
      lasts = 1.0 / rate;
      const T counted = lanes::select(rotary_only, T(length * kDegreePerRad), length);
      if (slowest_rate > 0.0) {
        const T least = counted / slowest_rate;
        lasts = lanes::select((counted > 0.0) & (least < lasts), least, lasts);
      }
    }
    lanes::store(&seconds[i], lasts);
    lanes::store(&slowest_s[i], slowest);
  }
}

}  // namespace trunnion::post
