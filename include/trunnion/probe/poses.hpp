#pragma once
#include <functional>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion::probe {

/// What is asked of a choice of poses.
struct PoseChoice {
  Vec3 ball_P = Vec3::Zero();  // mm
  std::size_t count = 12;
  /// Largest angle between the table's normal and the spindle.
  Angle largest_tilt = Angle::degrees(60.0);
  /// Rotary positions that somebody else has planned: those of them that can be reached are taken, all, and
  /// `count` does not matter. Empty: of a grid.
  std::vector<JointVector> planned;
  /// Half a quantum of a rotary word decides what the control is told: rounds a rotary position.
  std::function<double(AxisId, double)> rounded;
  /// The ball can be touched with the rotary axes there: within the travel of the linear axes, clear of the
  /// table.
  std::function<bool(const JointVector&)> reachable;
};

struct ChosenPoses {
  std::vector<JointVector> poses;  // rotary axes only, in the order of least travel from the first
  /// Standard deviation that a centre of 1 um leaves in the two lengths (mm) and two angles (rad) of each
  /// rotary axis (AxisLines), infinite where the poses do not tell.
  std::vector<double> sigma_of_um;
  std::size_t candidates = 0;  // that can be reached
};

/// Rotary positions from which the centre of one ball tells the most of the rotary axes' lines and of the
/// ball's place: of a grid over the limits those whose normal matrix has the largest determinant (D-optimal;
/// one after the other, then exchanged while it grows). The first pose is the one nearest to zero: where a
/// wrong axis direction or point moves the ball least.
/// @return no poses where fewer than four can be reached.
ChosenPoses choose_poses(const Machine& machine, const PoseChoice& choice);

}  // namespace trunnion::probe
