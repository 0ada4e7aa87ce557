#pragma once
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "trunnion/base/lanes.hpp"
#include "trunnion/post/post.hpp"

#include "post/feeds/control_times.hpp"

namespace trunnion::post {

/// Of the time that a block is meant to take: below the rounding of any F that is worth writing.
inline constexpr double kRunsAway = 0.95;
/// Where the tip's own time is below a thousandth of the axes' it is no measure of a feed: nothing is "lost"
/// then.
inline constexpr double kTipMoves = 1e-3;

/// Share by which the way of the axes may differ from that of the tip and F still be the programmed one.
inline constexpr double kSameWay = 0.01;

/// How long a block takes and what F says so.
struct BlockFeed {
  nc::FeedMode mode = nc::FeedMode::per_minute;
  std::int64_t quanta = 0;
  double seconds = 0.0;     // as the control will run it, F rounded
  double wanted_s = 0.0;    // what the feed and the axes ask for; more than `seconds` where no F can say it
  double lost_s = 0.0;      // more than the programmed feed asks for, since an axis is not faster
  bool other_mode = false;  // per minute, since inverse time cannot say it

  /// The control will run the block clearly faster than it is meant to: no F says its duration.
  bool runs_away() const { return seconds < kRunsAway * wanted_s; }
};

/// Feeds of blocks one after the other.
struct RunFeeds {
  static constexpr std::size_t kMost = 64;
  std::array<std::int32_t, kMost> quanta;
  std::array<double, kMost> seconds, lost_s;  // as BlockFeed has them
};

/// Plans the feed of one block after the other.
class FeedPlanner {
 public:
  FeedPlanner(const Machine& machine, const nc::Controller& controller, FeedOutput output);

  /// A motion to be planned. Without tool-centre-point control the joints move linearly from `a` to `b`; with
  /// it the tip's words move by `tcp_way_mm` (nothing else is a path to the control), and the joints as they
  /// must: `axes_s` says how long they need.
  struct Move {
    const JointVector& a;
    const JointVector& b;
    double tip_mm = 0.0;  // way of the tip relative to the part
    std::optional<double> tcp_way_mm;
    double axes_s = 0.0;  // see AxisRates::slowest_axis_s
    double pace = 1.0;    // share of its speed, as it was planned (FeedAhead)
  };
  /// Duration: the tip's at `feed_mm_s`, or that of the slowest axis, over the pace; where the tip hardly
  /// moves it is the axes that need time. F is rounded so that no axis exceeds its speed.
  BlockFeed plan(const Move& move, double feed_mm_s) const;
  BlockFeed plan(const JointVector& a, const JointVector& b, double tip_mm, double feed_mm_s) const {
    return plan({a, b, tip_mm, std::nullopt, axes().slowest_axis_s(a, b)}, feed_mm_s);
  }
  /// A position on the way of a run: where the joints stand, and the tip relative to the part.
  struct Stop {
    const JointVector* q;
    const Vec3* tip_P;
    double pace = 1.0;  // of the block that ends here, as Move has it
  };
  /// The mode of a block in which rotary axes turn.
  nc::FeedMode run_mode() const { return inverse_ ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute; }
  /// What `plan` gives for the blocks from stop to stop, a few at a time, as far as they are plain: linear
  /// axes move, all feeds have the mode `run_mode` and less than 2^31 quanta, and say how long the block
  /// lasts. Gives their number, at most RunFeeds::kMost.
  std::size_t plan_run(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const;

  const AxisRates& axes() const { return times_.axes(); }
  AxisRates& axes() { return times_.axes(); }

 private:
  BlockFeed in_mode(nc::FeedMode mode, const ControlTimes::Way& way, double axes_s, double seconds,
                    double rate_mm_s) const;
  /// The way that the control divides by F is the tip's but for rounding and the errors of the machine: F is
  /// the programmed feed, the same in every block.
  bool is_way_of_tip(double length_mm, double tip_mm) const {
    return std::abs(length_mm - tip_mm) <= std::max(rounding_mm_, kSameWay * tip_mm);
  }

  template <class T>
  struct Place;
  template <class T>
  struct Ways;
  template <class T>
  struct FewFeeds;
  struct RunRules;
  template <class T>
  void measure(const Place<T>& from, const Place<T>& to, Ways<T>& out) const;
  template <nc::FeedMode kMode, class T>
  void plan_few(const RunRules& rules, const Ways<T>& way, FewFeeds<T>& out) const;
  template <nc::FeedMode kMode, class T>
  std::size_t plan_blocks(std::span<const Stop> stops, double feed_mm_s, RunFeeds& out) const;

  ControlTimes times_;
  bool inverse_;        // time, where rotary axes turn
  double rounding_mm_;  // of a way between two rounded points, at most
};

}  // namespace trunnion::post
