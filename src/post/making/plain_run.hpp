#pragma once
#include <array>
#include <cstddef>

#include "post/feeds/feed_plan.hpp"

namespace trunnion::post {

/// Blocks that wait to go out together.
struct PlainRun {
  static constexpr std::size_t kMost = RunFeeds::kMost;
  static constexpr std::size_t kFewest = 4;
  /// Where the run begins, and the ends of the blocks. The tip is that of a point of the chunk.
  std::array<FeedPlanner::Stop, kMost + 1> stops;
  std::array<std::size_t, kMost + 1> motions;    // of the chunk
  std::array<JointVector, kMost + 1> corrected;  // on a machine with errors: where the joints stand
  std::size_t count = 0;                         // of blocks
  std::size_t first = 0;                         // motion of the chunk with which it all began
  std::size_t together = kFewest;  // so many are looked at together: fewer where some have just stopped it

  void begin(const FeedPlanner::Stop& from, std::size_t motion) {
    stops[0] = from;
    motions[0] = motion;
    count = 0;
  }
  /// Where the joints are not those of the nominal machine.
  void begin(const JointVector& q, const Vec3& tip_P, std::size_t motion) {
    corrected[0] = q;
    begin({corrected.data(), &tip_P}, motion);
  }
  void add(const FeedPlanner::Stop& to, std::size_t motion) {
    ++count;
    stops[count] = to;
    motions[count] = motion;
  }
  /// The same; `to` has no place of its own.
  void add(const JointVector& q, FeedPlanner::Stop to, std::size_t motion) {
    corrected[count + 1] = q;
    to.q = &corrected[count + 1];
    add(to, motion);
  }
};

}  // namespace trunnion::post
