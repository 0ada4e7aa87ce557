#pragma once
#include <array>
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
/// What comes behind a chunk slows down its end, so that it is held until the next ones are known: so far
/// this looks ahead, a thousand motions of a long run.
class FeedAhead {
 public:
  FeedAhead(const PostJob& job, const PostOptions& options);

  /// Feeds are planned: the options want it, and the machine file says how fast its axes accelerate.
  bool is_on() const { return plan_.has_value(); }
  /// So many chunks wait for those behind them.
  static constexpr std::size_t kHeld = 2;
  /// Takes the next chunk, and puts the first of those that wait, with its paces, into its place: at first
  /// empty ones.
  void change(Chunk& chunk);
  /// The first of those that are left, with its paces.
  Chunk take_left();

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
  struct Held {
    Chunk chunk;
    std::vector<double*> paces;  // of its blocks
  };
  /// Of what waits for the longest time.
  void settle();

  const PostOptions& options_;
  std::optional<MotionPlan> plan_;
  AxisRates rates_;
  Asked asked_;
  bool turns_behind_ = false;     // the tool leaves the part behind the last motion
  std::array<Held, kHeld> held_;  // the first one has waited for the longest time
  std::vector<double*> paces_;    // of the blocks of the chunk that comes
  std::vector<BlockRun> runs_;
};

}  // namespace trunnion::post
