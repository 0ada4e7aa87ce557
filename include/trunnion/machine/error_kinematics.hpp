#pragma once
#include <vector>

#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// `forward` with errors for one machine and tool, prepared for many evaluations: tip and axis of the tool
/// are carried through the chain as two vectors, joint by joint, instead of products of poses. Equal to
/// `tool_pose(forward(machine, q, tool_mm, errors))` within rounding (tests: 1e-10 mm, 1e-13).
class ErrorKinematics {
 public:
  /// @param tool_mm  vector from S to the tip, mm
  ErrorKinematics(const Machine& machine, const Vec3& tool_mm);

  /// Where the tool really is in P at the joint positions `q` (mm, rad) of the chain with `errors`.
  ToolPose pose(const JointVector& q, const ChainErrors& errors) const;
  /// The same where the sines of the rotary positions are known.
  ToolPose pose(const JointVector& q, const RotarySines& sines, const ChainErrors& errors) const;

 private:
  struct Joint {
    AxisId id = 0;
    bool rotary = false;
    AxisTurn turn;  // its direction, for a linear joint too
    Vec3 point_mm = Vec3::Zero();
  };
  static std::vector<Joint> joints_of(const Machine& machine, const std::vector<AxisId>& chain);

  std::vector<Joint> tool_chain_;  // from the tool inwards
  std::vector<Joint> part_chain_;  // from the bed outwards
  Vec3 tool_mm_;
  Vec3 part_zero_mm_;
};

}  // namespace trunnion
