#pragma once
#include <array>
#include <limits>
#include <vector>

#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/post/post.hpp"

namespace trunnion::post {

/// How long a block takes and what F says so.
struct BlockFeed {
  nc::FeedMode mode = nc::FeedMode::per_minute;
  std::int64_t quanta = 0;
  double seconds = 0.0;  // as the control will run it, F rounded
  double lost_s = 0.0;   // more than the programmed feed asks for, since an axis is not faster
};

/// Plans the feed of one block after the other.
class FeedPlanner {
 public:
  FeedPlanner(const Machine& machine, const nc::Controller& controller, FeedOutput output);

  /// Feed of the linear joint motion a -> b, in which the tip moves `tip_mm` relative to the part at
  /// `feed_mm_s`. Duration: the tip's, or that of the slowest axis; where the tip hardly moves it is the axes
  /// that need time.
  BlockFeed plan(const JointVector& a, const JointVector& b, double tip_mm, double feed_mm_s) const;
  /// Time of a rapid: the slowest axis at its rapid rate.
  double rapid_seconds(const JointVector& a, const JointVector& b) const;
  /// Time of a block with this F; `tip_mm` > 0: F is the feed of the tip (tool-centre-point control).
  double seconds_of(const JointVector& a, const JointVector& b, double tip_mm, nc::FeedMode mode,
                    std::int64_t feed) const;
  /// The least time in which the axes can do it.
  double slowest_axis_s(const JointVector& a, const JointVector& b) const;

 private:
  /// Length by which the control divides a per-minute F: mm, or rad where only rotary axes move.
  double control_path(const JointVector& a, const JointVector& b, bool& rotary_only) const;

  struct PlannedAxis {
    bool linear = true;
    double rapid = 1.0;  // mm/s, rad/s
    double feed = 1.0;
  };
  std::size_t count_;
  std::array<PlannedAxis, kMaxAxes> axes_;
  const nc::Controller& controller_;
  FeedOutput output_;
};

}  // namespace trunnion::post
