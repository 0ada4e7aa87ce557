// The feeds of a run of blocks, two at a time: what FeedPlanner::plan gives for each.
#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/lanes.hpp"

#include "post/feed_plan.hpp"
#include "post/joint_pair.hpp"

namespace trunnion::post {
namespace {

// Whole numbers, halves away from zero, of numbers that are not negative.
Lanes nearest_up(const Lanes& x) {
  const Lanes n = lanes::nearest<Lanes>(x);
  return lanes::select(x - n >= 0.5, n + 1.0, n);
}

}  // namespace

/// How far a block goes.
struct FeedPlanner::Ways {
  double tip2_mm2;
  double linear2_mm2;
  double rotary2_rad2;  // where it is wanted
  double axes_s;        // at least what the slowest axis needs
};

[[gnu::always_inline]] inline FeedPlanner::Ways FeedPlanner::ways(const Stop& from, const Stop& to,
                                                                  bool wants_rotary) const {
  static_assert(kMaxAxes == 5, "two pairs and one");
  const JointVector& a = *from.q;
  const JointVector& b = *to.q;
  const Lanes first = joint_pair(b, 0) - joint_pair(a, 0);
  const Lanes second = joint_pair(b, 2) - joint_pair(a, 2);
  const double last = b[4] - a[4];
  const Lanes times = lanes::larger(lanes::abs(first) * joint_pair(slowness_, 0),
                                    lanes::abs(second) * joint_pair(slowness_, 2));
  const Lanes first2 = first * first;
  const Lanes second2 = second * second;
  const double last2 = last * last;
  // In the order of `control_path`.
  const auto sum = [&](const JointVector& share) {
    const Lanes x = first2 * joint_pair(share, 0);
    const Lanes y = second2 * joint_pair(share, 2);
    return x[0] + x[1] + y[0] + y[1] + last2 * share[4];
  };
  return {(*to.tip_P - *from.tip_P).squaredNorm(), sum(linear_share_),
          wants_rotary ? sum(rotary_share_) : 0.0,
          std::max(std::max(times[0], times[1]), std::abs(last) * slowness_[4])};
}

template <nc::FeedMode kMode>
std::size_t FeedPlanner::plan_pairs(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  constexpr bool kInverse = kMode == nc::FeedMode::inverse_time;
  constexpr double kMostQuanta = 2147483647.0;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const double scale = controller_.numbers.feed.scale(kMode);
  const bool all_axes = controller_.feed.path != nc::FeedPath::linear_first;
  const double most_mm_s = controller_.feed.max_per_minute.value_or(kInfinite) / kSecondsPerMinute;
  const double least_s = kSecondsPerMinute / controller_.feed.max_inverse_time.value_or(kInfinite);
  const double slowest_mm_s = controller_.feed.min_linear_rate_mm_s.value_or(0.0);
  const std::size_t count = std::min(stops.size() - 1, RunFeeds::kMost);
  for (std::size_t i = 0; i < count; i += 2) {
    const std::size_t j = std::min(i + 1, count - 1);  // an odd last one stands for two
    const Ways a = ways(stops[i], stops[i + 1], kInverse || all_axes);
    const Ways b = ways(stops[j], stops[j + 1], kInverse || all_axes);
    const Lanes linear2{a.linear2_mm2, b.linear2_mm2};
    const Lanes rotary2{a.rotary2_rad2, b.rotary2_rad2};
    const Lanes tip_s = lanes::sqrt(Lanes{a.tip2_mm2, b.tip2_mm2}) / feed_mm_s;
    const Lanes length = lanes::sqrt(all_axes ? linear2 + rotary2 * kDegreePerRad * kDegreePerRad : linear2);
    const auto slowest_s = [&] {
      return Lanes{slowest_axis_s(*stops[i].q, *stops[i + 1].q),
                   slowest_axis_s(*stops[j].q, *stops[j + 1].q)};
    };
    Lanes axes_s{a.axes_s, b.axes_s};
    Lanes seconds = tip_s;
    Lanes lost_s{};
    if (lanes::any(axes_s > tip_s)) {
      axes_s = slowest_s();
      seconds = lanes::larger(tip_s, axes_s);
      lost_s = lanes::select(tip_s > kTipMoves * axes_s, seconds - tip_s, Lanes{});
    }
    const auto lasts = [&](const Lanes& quanta) {
      const Lanes rate = quanta / scale / kSecondsPerMinute;
      if constexpr (!kInverse) return length / rate;
      const Lanes inverse = 1.0 / rate;
      if (slowest_mm_s <= 0.0) return inverse;
      const Lanes at_least = length / slowest_mm_s;
      return lanes::select(at_least < inverse, at_least, inverse);
    };
    Lanes wanted_s = seconds;
    Lanes rate;
    if constexpr (kInverse) {
      wanted_s = lanes::larger(seconds, lanes::splat<Lanes>(least_s));
      rate = 1.0 / wanted_s;
    } else {
      rate = length / seconds;
      rate = lanes::select(lanes::splat<Lanes>(most_mm_s) < rate, lanes::splat<Lanes>(most_mm_s), rate);
    }
    const Lanes scaled = rate * kSecondsPerMinute * scale;
    Lanes quanta = lanes::larger(nearest_up(scaled), lanes::splat<Lanes>(1.0));
    Lanes lasts_s = lasts(quanta);
    if (lanes::any(lasts_s < axes_s)) {
      const LaneMask too_short = (lasts_s < slowest_s()) & (quanta > 1.0);
      quanta = lanes::select(too_short, quanta - 1.0, quanta);
      lasts_s = lanes::select(too_short, lasts(quanta), lasts_s);
    }
    const LaneMask plain = (linear2 > 0.0) & (scaled < kMostQuanta) & (lasts_s >= kRunsAway * wanted_s) &
                           ((rotary2 > 0.0) | (kInverse ? LaneMask{} : ~LaneMask{}));
    for (std::size_t lane = 0; lane < 2 && i + lane < count; ++lane) {
      const auto at = static_cast<int>(lane);
      if (plain[at] == 0) return i + lane;
      out.quanta[i + lane] = static_cast<std::int32_t>(quanta[at]);
      out.seconds[i + lane] = lasts_s[at];
      out.lost_s[i + lane] = lost_s[at];
    }
  }
  return count;
}

std::size_t FeedPlanner::plan_run(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  if (stops.size() < 2) return 0;
  return inverse_ ? plan_pairs<nc::FeedMode::inverse_time>(stops, feed_mm_s, out)
                  : plan_pairs<nc::FeedMode::per_minute>(stops, feed_mm_s, out);
}

}  // namespace trunnion::post
