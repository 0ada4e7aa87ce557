// The feeds of a run of blocks, a few at a time: what FeedPlanner::plan gives for each.
#include <algorithm>
#include <limits>

#include "trunnion/base/lanes.hpp"

#include "post/feed_plan.hpp"

namespace trunnion::post {
namespace {

// Whole numbers, halves away from zero, of numbers that are not negative.
template <class T>
T nearest_up(const T& x) {
  const T n = lanes::nearest<T>(x);
  return lanes::select(x - n >= 0.5, n + 1.0, n);
}

template <class T>
void put(const T& quanta, std::int32_t* out) {
  for (std::size_t k = 0; k < lanes::kCount<T>; ++k)
    out[k] = static_cast<std::int32_t>(quanta[static_cast<int>(k)]);
}

}  // namespace

/// A few stops side by side.
template <class T>
struct FeedPlanner::Place {
  std::array<T, kMaxAxes> q;
  lanes::Triple<T> tip_P;

  /// Those from `first` on; the last one stands for those that are not there.
  Place(std::span<const Stop> stops, std::size_t first) {
    std::array<const Stop*, lanes::kCount<T>> at;
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = &stops[std::min(first + k, stops.size() - 1)];
    for (AxisId id = 0; id < kMaxAxes; ++id)
      q[id] = lanes::collect<T>([&](std::size_t k) { return (*at[k]->q)[id]; });
    tip_P = lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return *at[k]->tip_P; });
  }
  /// Where the blocks to `to` begin when these came before.
  Place(const Place& before, const Place& to) {
    for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = lanes::across(before.q[id], to.q[id]);
    tip_P = {lanes::across(before.tip_P.x, to.tip_P.x), lanes::across(before.tip_P.y, to.tip_P.y),
             lanes::across(before.tip_P.z, to.tip_P.z)};
  }
};

/// How far blocks go.
template <class T>
struct FeedPlanner::Ways {
  T tip2_mm2;
  T linear2_mm2;
  T rotary2_rad2;  // where it is wanted
  T axes_s;        // at least what the slowest axis needs
  std::array<T, kMaxAxes> axis;

  /// As slowest_axis_s.
  T slowest_s(const std::array<double, kMaxAxes>& rate) const {
    T out{};
    for (AxisId id = 0; id < kMaxAxes; ++id) out = lanes::larger(out, T(lanes::abs(axis[id]) / rate[id]));
    return out;
  }
};

template <class T>
FeedPlanner::Ways<T> FeedPlanner::ways(const Place<T>& from, const Place<T>& to, bool wants_rotary) const {
  Ways<T> out{};
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const T by = to.q[id] - from.q[id];
    const T by2 = by * by;
    out.axis[id] = by;
    // In the order of `control_path`.
    out.linear2_mm2 += by2 * linear_share_[id];
    if (wants_rotary) out.rotary2_rad2 += by2 * rotary_share_[id];
    out.axes_s = lanes::larger(out.axes_s, T(lanes::abs(by) * slowness_[id]));
  }
  // In the order of Vec3::squaredNorm.
  const lanes::Triple<T> way = to.tip_P - from.tip_P;
  out.tip2_mm2 = way.x * way.x + (way.y * way.y + way.z * way.z);
  return out;
}

template <nc::FeedMode kMode, class T>
std::size_t FeedPlanner::plan_few(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  constexpr bool kInverse = kMode == nc::FeedMode::inverse_time;
  constexpr double kMostQuanta = 2147483647.0;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr std::size_t kTogether = lanes::kCount<T>;
  static_assert(RunFeeds::kMost % kTogether == 0);
  const double scale = controller_.numbers.feed.scale(kMode);
  const bool all_axes = controller_.feed.path != nc::FeedPath::linear_first;
  const double most_mm_s = controller_.feed.max_per_minute.value_or(kInfinite) / kSecondsPerMinute;
  const double least_s = kSecondsPerMinute / controller_.feed.max_inverse_time.value_or(kInfinite);
  const double slowest_mm_s = controller_.feed.min_linear_rate_mm_s.value_or(0.0);
  const std::size_t count = std::min(stops.size() - 1, RunFeeds::kMost);
  Place<T> before(stops.first(1), 0);
  for (std::size_t i = 0; i < count; i += kTogether) {
    const Place<T> to(stops.first(count + 1), i + 1);
    const Ways<T> way = ways<T>(Place<T>(before, to), to, kInverse || all_axes);
    before = to;
    const T tip_s = lanes::sqrt(way.tip2_mm2) / feed_mm_s;
    const T length = lanes::sqrt(
        all_axes ? T(way.linear2_mm2 + way.rotary2_rad2 * kDegreePerRad * kDegreePerRad) : way.linear2_mm2);
    T axes_s = way.axes_s;
    T seconds = tip_s;
    T lost_s{};
    const bool slowed = lanes::any(lanes::Mask<T>(axes_s > tip_s));
    if (slowed) {
      axes_s = way.slowest_s(feed_);
      seconds = lanes::larger(tip_s, axes_s);
      lost_s = lanes::select(tip_s > kTipMoves * axes_s, T(seconds - tip_s), T{});
    }
    const auto lasts = [&](const T& quanta) -> T {
      const T rate = quanta / scale / kSecondsPerMinute;
      if constexpr (!kInverse) return length / rate;
      const T inverse = 1.0 / rate;
      if (slowest_mm_s <= 0.0) return inverse;
      const T at_least = length / slowest_mm_s;
      return lanes::select(at_least < inverse, at_least, inverse);
    };
    T wanted_s = seconds;
    T rate;
    if constexpr (kInverse) {
      wanted_s = lanes::larger(seconds, lanes::splat<T>(least_s));
      rate = 1.0 / wanted_s;
    } else {
      rate = length / seconds;
      rate = lanes::select(lanes::splat<T>(most_mm_s) < rate, lanes::splat<T>(most_mm_s), rate);
    }
    const T scaled = rate * kSecondsPerMinute * scale;
    T quanta = lanes::larger(nearest_up(scaled), lanes::splat<T>(1.0));
    T lasts_s = lasts(quanta);
    // Of blocks that an axis slows down half are too short after rounding: not worth a guess.
    if (slowed || lanes::any(lanes::Mask<T>(lasts_s < axes_s))) {
      if (!slowed) axes_s = way.slowest_s(feed_);
      const lanes::Mask<T> too_short = (lasts_s < axes_s) & (quanta > 1.0);
      quanta = lanes::select(too_short, T(quanta - 1.0), quanta);
      lasts_s = lanes::select(too_short, lasts(quanta), lasts_s);
    }
    const lanes::Mask<T> plain =
        (way.linear2_mm2 > 0.0) & (scaled < kMostQuanta) & (lasts_s >= kRunsAway * wanted_s) &
        ((way.rotary2_rad2 > 0.0) | (kInverse ? lanes::Mask<T>{} : ~lanes::Mask<T>{}));
    put(lanes::select(plain, quanta, lanes::splat<T>(1.0)), &out.quanta[i]);
    lanes::store(&out.seconds[i], lasts_s);
    lanes::store(&out.lost_s[i], lost_s);
    if (!lanes::any(~plain)) continue;
    for (std::size_t k = 0; k < kTogether && i + k < count; ++k) {
      if (plain[static_cast<int>(k)] == 0) return i + k;
    }
  }
  return count;
}

std::size_t FeedPlanner::plan_run(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  if (stops.size() < 2) return 0;
  std::size_t planned = 0;
  lanes::at_a_time(four_, [&]<class T>() {
    planned = inverse_ ? plan_few<nc::FeedMode::inverse_time, T>(stops, feed_mm_s, out)
                       : plan_few<nc::FeedMode::per_minute, T>(stops, feed_mm_s, out);
  });
  return planned;
}

}  // namespace trunnion::post
