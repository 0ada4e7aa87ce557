#pragma once
#include <array>
#include <vector>

#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/table_kinematics.hpp"

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
  /// Two positions side by side, in little more time than one. Equal to `pose` within rounding.
  std::array<ToolPose, 2> pose_pair(const std::array<JointVector, 2>& q,
                                    const TableKinematics::SinesOf<Lanes>& sines,
                                    const std::array<ChainErrors, 2>& errors) const;

  /// From now on the errors of all links but these are taken from here, not from what `pose` is given: what
  /// never changes is worked out once.
  void hold(const ChainErrors& constant, const ChainLinks& varying);

 private:
  /// What a link always does: v -> rotation v + shift, from before its point is left to behind its error.
  struct Held {
    Held() = default;
    /// `point_mm`: where the error acts.
    Held(const Twist& twist, double sign, const Vec3& point_mm);
    template <class V>
    V turned(const V& v) const {
      const auto row = [&](std::size_t i) {
        return rotation[i] * v.x + rotation[i + 1] * v.y + rotation[i + 2] * v.z;
      };
      return {row(0), row(3), row(6)};
    }
    bool known = false;
    bool turns = false;
    std::array<Lanes, 9> rotation{};  // by rows
    Vec3 shift_mm = Vec3::Zero();
  };
  struct Joint {
    AxisId id = 0;
    bool rotary = false;
    AxisTurn turn;  // its direction, for a linear joint too
    Vec3 point_mm = Vec3::Zero();
    bool has_point = false;  // that is not zero
    Held held;
  };
  struct OneTool;
  struct TwoTools;
  template <class Tool>
  void carry(Tool& tool) const;
  static std::vector<Joint> joints_of(const Machine& machine, const std::vector<AxisId>& chain);

  std::vector<Joint> tool_chain_;  // from the tool inwards
  std::vector<Joint> part_chain_;  // from the bed outwards
  Held spindle_, part_;
  Vec3 tool_mm_;
  Vec3 part_zero_mm_;
};

}  // namespace trunnion
