#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "trunnion/machine/motion_plan.hpp"
#include "trunnion/post/verify.hpp"

#include "post/judging/program_judge.hpp"

// Private to the verifier.
namespace trunnion::post {

/// How long blocks take by their words on axes that need time to get up and down (MotionPlan), whether the
/// axes reach what F asks for, and whether they are the reason where F asks for little. A block is settled
/// when so many behind it are known that these hardly slow it down.
class ReachedFeeds {
 public:
  /// `times` must outlive this.
  ReachedFeeds(MotionPlan plan, RunTimes& times);

  /// Is told which blocks are slow for no reason; must outlive this.
  void tell(ProgramJudge& judge) { judge_ = &judge; }

  struct Block {
    const JointVector& from;
    const JointVector& to;
    double seconds = 0.0;   // by its words
    bool apart = false;     // MotionPlan::Block has it
    std::int64_t feed = 0;  // quanta
    std::uint32_t nc_line = 0;
  };
  /// `slow`: it lasts longer than its feed and the speeds of the axes ask for.
  void add(const Block& block, const std::optional<ProgramJudge::Slow>& slow);
  /// The machine stands still for so long, or nobody knows its way.
  void wait(double seconds);
  /// There are no more blocks.
  void finish();

 private:
  struct Noted {
    double seconds, asked_s;
    std::int64_t feed;  // quanta, at least one
    bool apart;
    std::uint32_t nc_line;
    bool slow;  // the next one of `slow_`
  };
  void settle(std::size_t count);

  MotionPlan plan_;
  RunTimes& times_;
  ProgramJudge* judge_ = nullptr;
  std::vector<Noted> noted_;
  std::deque<ProgramJudge::Slow> slow_;
  std::vector<BlockRun> runs_;
};

}  // namespace trunnion::post
