#pragma once
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "trunnion/machine/motion_time.hpp"

#include "machine/axis_ways.hpp"

namespace trunnion {

/// The speed along one block, as LookAhead finds it. Lengths along the path are those of the axes' ways, each
/// over its acceleration (square seconds): a place changes its speed in one axis by 1 at most. Between the
/// places that are named the square of the speed runs evenly, but on the straight: there it goes up to
/// `middle2` and down from it by `acceleration`.
struct SpeedProfile {
  double length = 0.0;
  double asked_s = 0.0;
  double fastest2 = 0.0;      // square of the speed that is asked for
  double acceleration = 0.0;  // along the block, at most, where it is straight
  double behind = 0.0;        // its begin, in which the path still turns
  double before = 0.0;        // its end, in which it turns already
  double begin2 = 0.0, behind2 = 0.0, middle2 = 0.0, before2 = 0.0, end2 = 0.0;

  double straight() const;
  /// As BlockRun has them.
  double pace() const;
  double seconds() const;
};

/// Time-optimal speeds along a path with rounded corners (README, "Look-ahead"): a pass from its end to its
/// begin finds from how fast what follows can still be done, and one from the begin on goes as fast as can
/// be.
class LookAhead {
 public:
  /// As MotionPlan has them.
  LookAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits, PlanOf what);

  void add(const JointVector& from, const JointVector& to, double seconds);
  void stop() { legs_.stop(); }
  void lose() { legs_.lose(); }
  std::size_t waiting() const { return legs_.size(); }
  /// @param profiles  gets the speeds along these blocks, if given
  void settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedProfile>* profiles = nullptr);

 private:
  using PerAxis = std::array<double, kMaxAxes>;

  struct Leg : AxisWay {
    BlockBegin begins = BlockBegin::at_rest;
    /// At the corner at its begin the path turns at an even rate over the end of the block before it and over
    /// its own begin: their lengths.
    double turns_before = 0.0, turns_behind = 0.0;
    /// That corner slows down neither block where both go as fast as they are asked to behind it and before.
    bool is_free = false;
    bool is_bounded = false;  // with the block that is behind it now
    // The most from which what follows can be done: at its begin, behind its first corner, before its last.
    double begin2 = 0.0, behind2 = 0.0, before2 = 0.0;
  };
  /// What a corner asks of each axis.
  struct Corner {
    PerAxis turn{};                                // by how much of `along` for each length, without sign
    PerAxis steepest_before{}, steepest_behind{};  // `along` on the one side and on the other, at most
    double fastest2 = 0.0;
  };

  void begin_at_corner(const Leg& before, Leg& leg) const;
  Corner corner(const Leg& before, const Leg& leg) const;
  double turns_at_end(std::size_t i) const;
  double most_at_end2(std::size_t i) const;
  double straight(std::size_t i) const;
  void bound();
  SpeedProfile run(std::size_t i);

  std::optional<double> blend_mm_;
  PlanOf what_;
  BlocksAhead<Leg> legs_;
  double speed2_ = 0.0;  // behind those that were settled
};

}  // namespace trunnion
