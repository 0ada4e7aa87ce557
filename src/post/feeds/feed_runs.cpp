// The feeds of a run of blocks, a few at a time: what FeedPlanner::plan gives for each.
#include <algorithm>
#include <limits>

#include "trunnion/base/lanes.hpp"

#include "post/feeds/feed_plan.hpp"

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
  T pace;

  /// Those from `first` on; the last one stands for those that are not there.
  Place(std::span<const Stop> stops, std::size_t first) {
    std::array<const Stop*, lanes::kCount<T>> at;
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = &stops[std::min(first + k, stops.size() - 1)];
    for (AxisId id = 0; id < kMaxAxes; ++id)
      q[id] = lanes::collect<T>([&](std::size_t k) { return (*at[k]->q)[id]; });
    pace = lanes::collect<T>([&](std::size_t k) { return at[k]->pace; });
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
  T rotary2_rad2;
  T pace;
  T axes_s;  // at least what the slowest axis needs
  std::array<T, kMaxAxes> axis;

  /// As slowest_axis_s.
  T slowest_s(const std::array<double, kMaxAxes>& rate) const {
    T out{};
    for (AxisId id = 0; id < kMaxAxes; ++id) out = lanes::larger(out, T(lanes::abs(axis[id]) / rate[id]));
    return out;
  }
};

template <class T>
void FeedPlanner::measure(const Place<T>& from, const Place<T>& to, Ways<T>& out) const {
  out.linear2_mm2 = out.rotary2_rad2 = out.axes_s = T{};
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const T by = to.q[id] - from.q[id];
    const T by2 = by * by;
    out.axis[id] = by;
    // In the order of ControlTimes::way.
    out.linear2_mm2 += by2 * axes().linear_share()[id];
    out.rotary2_rad2 += by2 * axes().rotary_share()[id];
    out.axes_s = lanes::larger(out.axes_s, T(lanes::abs(by) * axes().slowness()[id]));
  }
  out.tip2_mm2 = lanes::squared(to.tip_P - from.tip_P);
  out.pace = to.pace;
}

/// What is the same for all blocks of a run.
struct FeedPlanner::RunRules {
  double feed_mm_s, scale;
  bool all_axes;  // count in the length that a feed per minute is of
  double most_mm_s = std::numeric_limits<double>::infinity();
  double least_s = 0.0;
  double slowest_mm_s = 0.0;  // that the control keeps in inverse time; 0: none

  RunRules(const nc::Controller& controller, nc::FeedMode mode, double feed)
      : feed_mm_s(feed),
        scale(controller.numbers.feed.scale(mode)),
        all_axes(controller.feed.path != nc::FeedPath::linear_first) {
    if (controller.feed.max_per_minute) most_mm_s = *controller.feed.max_per_minute / kSecondsPerMinute;
    if (controller.feed.max_inverse_time) least_s = kSecondsPerMinute / *controller.feed.max_inverse_time;
    slowest_mm_s = controller.feed.min_linear_rate_mm_s.value_or(0.0);
  }
  /// Of blocks of this length with this F.
  template <nc::FeedMode kMode, class T>
  T seconds(const T& length, const T& quanta) const {
    const T rate = quanta / scale / kSecondsPerMinute;
    if constexpr (kMode == nc::FeedMode::per_minute) return length / rate;
    const T inverse = 1.0 / rate;
    if (slowest_mm_s <= 0.0) return inverse;
    const T at_least = length / slowest_mm_s;
    return lanes::select(at_least < inverse, at_least, inverse);
  }
};

template <class T>
struct FeedPlanner::FewFeeds {
  T quanta, seconds, lost_s;
  lanes::Mask<T> plain;  // else it leaves something to be asked
};

template <nc::FeedMode kMode, class T>
void FeedPlanner::plan_few(const RunRules& rules, const Ways<T>& way, FewFeeds<T>& out) const {
  constexpr bool kInverse = kMode == nc::FeedMode::inverse_time;
  constexpr double kMostQuanta = 2147483647.0;
  const T tip_s = lanes::sqrt(way.tip2_mm2) / rules.feed_mm_s;
  const T length =
      lanes::sqrt(rules.all_axes ? T(way.linear2_mm2 + way.rotary2_rad2 * kDegreePerRad * kDegreePerRad)
                                 : way.linear2_mm2);
  T axes_s = way.axes_s;
  T wanted_s = tip_s;
  const T programmed_s = length / rules.feed_mm_s;
  bool slowed = lanes::any(lanes::Mask<T>(axes_s > tip_s));
  if constexpr (!kInverse) slowed = slowed || lanes::any(lanes::Mask<T>(axes_s > programmed_s));
  if (slowed) {
    axes_s = way.slowest_s(axes().cutting());
    wanted_s = lanes::larger(tip_s, axes_s);
  }
  wanted_s /= way.pace;
  out.lost_s = lanes::select(tip_s > kTipMoves * axes_s, T(wanted_s - tip_s), T{});
  T rate;
  if constexpr (kInverse) {
    wanted_s = lanes::larger(wanted_s, lanes::splat<T>(rules.least_s));
    rate = 1.0 / wanted_s;
  } else {
    const T most = lanes::splat<T>(rules.most_mm_s);
    const T tip_mm = lanes::sqrt(way.tip2_mm2);
    const T differ_mm = lanes::larger(lanes::splat<T>(rounding_mm_), T(kSameWay * tip_mm));
    const lanes::Mask<T> as_programmed =
        (way.rotary2_rad2 == 0.0) & (lanes::abs(T(length - tip_mm)) <= differ_mm) & (programmed_s >= axes_s);
    rate = lanes::select(as_programmed, T(rules.feed_mm_s * way.pace), T(length / wanted_s));
    wanted_s = lanes::select(as_programmed, T(programmed_s / way.pace), wanted_s);
    out.lost_s = lanes::select(as_programmed, T(wanted_s - programmed_s), out.lost_s);
    rate = lanes::select(most < rate, most, rate);
  }
  const T scaled = rate * kSecondsPerMinute * rules.scale;
  T quanta = lanes::larger(nearest_up(scaled), lanes::splat<T>(1.0));
  T seconds = rules.seconds<kMode>(length, quanta);
  // Of blocks that an axis slows down half are too short after rounding: not worth a guess.
  if (slowed || lanes::any(lanes::Mask<T>(seconds < axes_s))) {
    if (!slowed) axes_s = way.slowest_s(axes().cutting());
    const lanes::Mask<T> too_short = (seconds < axes_s) & (quanta > 1.0);
    quanta = lanes::select(too_short, T(quanta - 1.0), quanta);
    seconds = lanes::select(too_short, rules.seconds<kMode>(length, quanta), seconds);
  }
  out.plain = (way.linear2_mm2 > 0.0) & (scaled < kMostQuanta) & (seconds >= kRunsAway * wanted_s) &
              (seconds >= axes_s) &
              ((way.rotary2_rad2 > 0.0) | (kInverse ? lanes::Mask<T>{} : ~lanes::Mask<T>{}));
  out.quanta = lanes::select(out.plain, quanta, lanes::splat<T>(1.0));
  out.seconds = seconds;
}

template <nc::FeedMode kMode, class T>
std::size_t FeedPlanner::plan_blocks(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  static_assert(RunFeeds::kMost % kTogether == 0);
  const RunRules rules(times_.controller(), kMode, feed_mm_s);
  const std::size_t count = stops.size() - 1;
  Place<T> before(stops.first(1), 0);
  for (std::size_t i = 0; i < count; i += kTogether) {
    const Place<T> to(stops, i + 1);
    Ways<T> way;
    measure(Place<T>(before, to), to, way);
    before = to;
    FewFeeds<T> few;
    plan_few<kMode>(rules, way, few);
    put(few.quanta, &out.quanta[i]);
    lanes::store(&out.seconds[i], few.seconds);
    lanes::store(&out.lost_s[i], few.lost_s);
    if (!lanes::any(~few.plain)) continue;
    for (std::size_t k = 0; k < kTogether && i + k < count; ++k) {
      if (few.plain[static_cast<int>(k)] == 0) return i + k;
    }
  }
  return count;
}

std::size_t FeedPlanner::plan_run(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const {
  if (stops.size() < 2) return 0;
  stops = stops.first(std::min(stops.size(), RunFeeds::kMost + 1));
  std::size_t planned = 0;
  lanes::at_a_time(lanes::way(), [&]<class T>() {
    planned = inverse_ ? plan_blocks<nc::FeedMode::inverse_time, T>(stops, feed_mm_s, out)
                       : plan_blocks<nc::FeedMode::per_minute, T>(stops, feed_mm_s, out);
  });
  return planned;
}

}  // namespace trunnion::post
