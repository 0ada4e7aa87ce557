// Times of blocks as they are read back.
#include <algorithm>

#include "trunnion/base/lanes.hpp"

#include "post/feeds/feed_plan.hpp"

namespace trunnion::post {

void FeedPlanner::times_of(const std::array<const double*, kMaxAxes>& q, nc::FeedMode mode,
                           std::span<const std::int64_t> feed, std::span<double> seconds,
                           std::span<double> slowest_s) const {
  lanes::at_a_time(four_, [&]<class T>() { times_of_few<T>(q, mode, feed, seconds, slowest_s); });
}

template <class T>
void FeedPlanner::times_of_few(const std::array<const double*, kMaxAxes>& q, nc::FeedMode mode,
                               std::span<const std::int64_t> feed, std::span<double> seconds,
                               std::span<double> slowest_s) const {
  const double scale = controller_.numbers.feed.scale(mode);
  const bool linear_first = controller_.feed.path == nc::FeedPath::linear_first;
  const double slowest_rate = controller_.feed.min_linear_rate_mm_s.value_or(0.0);
  for (std::size_t i = 0; i < feed.size(); i += lanes::kCount<T>) {
    T linear{};
    T rotary{};
    T slowest{};
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      const T d = lanes::load<T>(q[id] + i + 1) - lanes::load<T>(q[id] + i);
      const T d2 = d * d;
      linear += d2 * linear_share_[id];
      rotary += d2 * (1.0 - linear_share_[id]);
      slowest = lanes::larger<T>(slowest, lanes::abs(d) / feed_[id]);
    }
    const auto rotary_only = linear == 0.0;
    const T both = linear_first ? linear : T(linear + rotary * kDegreePerRad * kDegreePerRad);
    const T length = lanes::sqrt(T(lanes::select(rotary_only, rotary, both)));
    const T quanta = lanes::collect<T>(
        [&](std::size_t k) { return static_cast<double>(feed[std::min(i + k, feed.size() - 1)]); });
    const T rate = quanta / scale / kSecondsPerMinute;
    T lasts;
    if (mode == nc::FeedMode::per_minute) {
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
