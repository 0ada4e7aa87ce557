#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "trunnion/machine/motion_time.hpp"

#include "machine/axis_ways.hpp"
#include "machine/smooth_path.hpp"
#include "machine/smooth_speeds.hpp"

namespace trunnion {

/// Speeds along a path with rounded corners that keep to the axes' jerk, too (README, "Jerk").
class SmoothAhead {
 public:
  /// As MotionPlan has them; needs MotionPlan::knows_jerk.
  SmoothAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits);

  void add(const JointVector& from, const JointVector& to, double seconds);
  void stop() { legs_.stop(); }
  void lose() { legs_.lose(); }
  std::size_t waiting() const { return legs_.size(); }
  /// @param pieces  gets the speeds along these blocks, if given
  void settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces = nullptr);

 private:
  void begin_at_corner(const SmoothLeg& before, SmoothLeg& leg) const;
  void shape(std::size_t count);
  bool plan(std::size_t count);
  SmoothLeg beside(const SmoothLeg& leg, BlockBegin begins) const;
  struct Stretch {
    std::size_t from = 0, to = 0;                   // blocks
    bool goes_before = false, goes_behind = false;  // where it is not known whether it does
  };
  bool plan(const Stretch& stretch, std::vector<SpeedPiece>& out);
  bool plan_stretch(std::size_t from, std::size_t to);
  void plan_standing(const Stretch& going);
  void commit(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces);
  std::size_t enough_for(std::size_t count) const;

  std::optional<double> blend_mm_;
  double longest_ramp_s_;  // from no acceleration to the largest
  BlocksAhead<SmoothLeg> legs_;
  SpeedEnd at_;  // behind those that were settled
  SmoothPath path_;
  SmoothSpeeds speeds_;
  /// Along the first blocks that wait, as they were planned last.
  std::vector<SpeedPiece> planned_, fresh_, standing_;
  std::size_t planned_legs_ = 0;
  bool planned_to_end_ = false;  // of the blocks that were known
};

}  // namespace trunnion
