#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "trunnion/machine/motion_time.hpp"

#include "machine/axis_ways.hpp"
#include "machine/smooth_path.hpp"
#include "machine/smooth_speeds.hpp"
#include "machine/steady_way.hpp"

namespace trunnion {

/// Speeds along a path with rounded corners that keep to the axes' jerk, too (README, "Jerk").
class SmoothAhead {
 public:
  /// As MotionPlan has them; needs MotionPlan::knows_jerk.
  SmoothAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits, PlanOf what);

  void add(const JointVector& from, const JointVector& to, double seconds);
  void stop() { legs_.stop(); }
  void lose() { legs_.lose(); }
  std::size_t waiting() const { return legs_.size(); }
  /// @param pieces  gets the speeds along these blocks, if given
  void settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces = nullptr);

 private:
  void begin_at_corner(const SmoothLeg& before, SmoothLeg& leg) const;
  void shape(std::size_t i);
  bool plan(std::size_t count, const SpeedEnd& end);
  SmoothLeg beside(const SmoothLeg& leg, BlockBegin begins) const;
  struct Stretch {
    std::size_t from = 0, to = 0;                   // blocks
    bool goes_before = false, goes_behind = false;  // where it is not known whether it does
    SpeedEnd end = {};
  };
  bool plan(const Stretch& stretch, std::vector<SpeedPiece>& out);
  bool plan_stretch(const Stretch& stretch);
  void plan_standing(const Stretch& going);
  void commit(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces);
  std::size_t enough_for(std::size_t count) const;
  double stopping_way(const SmoothLeg& leg) const;
  bool is_steady(std::size_t i) const;
  bool is_at_steady() const;
  void know_steady();
  SpeedEnd steady_at(std::size_t i) const;
  std::size_t steady_ahead(std::size_t count) const;
  std::size_t steady_again() const;
  std::size_t settle_steady(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces);
  std::size_t settle_planned(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces);
  void forget(std::size_t count, const SpeedEnd& at);

  PlanOf what_;
  std::optional<double> blend_mm_;
  double longest_ramp_s_;  // from no acceleration to the largest
  BlocksAhead<SmoothLeg> legs_;
  SpeedEnd at_;  // behind those that were settled
  SmoothPath path_;
  SmoothSpeeds speeds_;
  SteadyWay steady_;
  /// Along the first blocks that wait, as they were planned last.
  KnownSpeeds planned_;
  std::vector<SpeedPiece> fresh_, standing_;
  std::size_t planned_legs_ = 0;
  bool planned_to_end_ = false;  // of the blocks that were known
};

}  // namespace trunnion
