#pragma once
#include <array>

#include "machine/smooth_path.hpp"
#include "machine/smooth_speeds.hpp"

namespace trunnion {

/// The speed along blocks of which the axes can do what is asked for without a plan (README, "Jerk", steady
/// ways). Of a corner it needs the two before it and the two behind it.
class SteadyWay {
 public:
  /// @param longest_ramp_s  the longest time of an axis from no acceleration to the largest
  explicit SteadyWay(double longest_ramp_s) : longest_ramp_s_(longest_ramp_s) {}

  /// Sets SteadyCorner::line2 at the begin of `leg`.
  static void draw(const SmoothLeg& before, SmoothLeg& leg, const SmoothLeg& next);
  /// Sets what follows from it at the begin of `leg`: is it steady over half of either block?
  void judge(const SmoothLeg& before, SmoothLeg& leg, const SmoothLeg& next) const;
  /// Along the halves of a block between two such corners.
  static std::array<SpeedPiece, 2> along(const SmoothLeg& leg, const SmoothLeg& next);

 private:
  bool half_is_steady(const SteadyCorner& corner, double slope, double middle2, double half) const;

  double longest_ramp_s_;
};

}  // namespace trunnion
