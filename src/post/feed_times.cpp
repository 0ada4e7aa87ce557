// Times of blocks as they are read back.
#include <algorithm>

#include "trunnion/base/lanes.hpp"

#include "post/feed_plan.hpp"

namespace trunnion::post {

void FeedPlanner::times_of(const std::array<const double*, kMaxAxes>& q, nc::FeedMode mode,
                           std::span<const std::int64_t> feed, std::span<double> seconds,
                           std::span<double> slowest_s) const {
  const double scale = controller_.numbers.feed.scale(mode);
  const bool linear_first = controller_.feed.path == nc::FeedPath::linear_first;
  const double slowest_rate = controller_.feed.min_linear_rate_mm_s.value_or(0.0);
  for (std::size_t i = 0; i < feed.size(); i += 2) {
    Lanes linear{};
    Lanes rotary{};
    Lanes slowest{};
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      const Lanes d = lanes::load(q[id] + i + 1) - lanes::load(q[id] + i);
      const Lanes d2 = d * d;
      linear += d2 * linear_share_[id];
      rotary += d2 * (1.0 - linear_share_[id]);
      slowest = lanes::larger<Lanes>(slowest, lanes::abs(d) / feed_[id]);
    }
    const LaneMask rotary_only = linear == 0.0;
    const Lanes both = linear_first ? linear : linear + rotary * kDegreePerRad * kDegreePerRad;
    const Lanes length = lanes::sqrt(lanes::select(rotary_only, rotary, both));
    const std::size_t last = std::min(i + 1, feed.size() - 1);
    const Lanes rate =
        Lanes{static_cast<double>(feed[i]), static_cast<double>(feed[last])} / scale / kSecondsPerMinute;
    Lanes lasts;
    if (mode == nc::FeedMode::per_minute) {
      lasts = length / lanes::select(rotary_only, rate * kRadPerDegree, rate);
    } else {
      lasts = 1.0 / rate;
      const Lanes counted = lanes::select(rotary_only, length * kDegreePerRad, length);
      if (slowest_rate > 0.0) {
        const Lanes least = counted / slowest_rate;
        lasts = lanes::select((counted > 0.0) & (least < lasts), least, lasts);
      }
    }
    lanes::store(&seconds[i], lasts);
    lanes::store(&slowest_s[i], slowest);
  }
}

}  // namespace trunnion::post
