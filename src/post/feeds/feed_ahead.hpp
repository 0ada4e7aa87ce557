#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "trunnion/machine/motion_plan.hpp"
#include "trunnion/post/post.hpp"

#include "post/feeds/axis_rates.hpp"
#include "post/intake/chunk.hpp"
#include "post/judging/asked.hpp"

namespace trunnion::post {

/// Which share of their speed the blocks of prepared chunks can have, before their text is made (MotionPlan).
/// What comes behind a chunk slows down its end, so that it is held until the next one is known: so far this
/// looks ahead.
class FeedAhead {
 public:
  FeedAhead(const PostJob& job, const PostOptions& options);

  /// Feeds are planned: the options want it, and the machine file says how fast its axes accelerate.
  bool is_on() const { return plan_.has_value(); }
  /// Takes the next chunk, and puts the one before it, with its paces, into its place: at first an empty one.
  void change(Chunk& chunk);
  /// The last one, with its paces.
  Chunk take_last();

 private:
  void add(Chunk& chunk);
  void add_motion(Chunk& chunk, std::size_t i);
  struct Stop {
    const JointVector* q;
    const Vec3* tip_P;
  };
  /// `pace` gets the pace of the block, where it is not null.
  void add_block(const Stop& from, const Stop& to, double feed_mm_s, double* pace);
  double rate_mm_s(const cl::Feed& feed) const;
  void settle();

  const PostOptions& options_;
  std::optional<MotionPlan> plan_;
  AxisRates rates_;
  Asked asked_;
  bool turns_behind_ = false;  // the tool leaves the part behind the last motion
  Chunk held_;
  std::vector<double*> held_paces_, paces_;  // of the blocks of the chunk that is held, and of the next one
  std::vector<BlockRun> runs_;
};

}  // namespace trunnion::post
