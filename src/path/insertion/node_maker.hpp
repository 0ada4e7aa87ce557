#pragma once
#include <optional>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/path/certificate.hpp"
#include "trunnion/path/point.hpp"
#include "trunnion/path/tool_off.hpp"

#include "path/choice/rotary_connection.hpp"

namespace trunnion::path {

/// How the rotary axes run between the ends of a segment.
enum class NodeAxis : std::uint8_t {
  great_circle,  // tool axis on the great circle between the prescribed axes
  joint_linear   // rotary axes linear between the ends' positions
};

/// Points of one segment: where there are so many it has not converged.
inline constexpr std::size_t kMostInserted = 4096;

/// A point that stands, or would stand, inside a segment.
struct Node {
  double t = 0.0;                   // fraction of the chord
  Vec3 tip_P = Vec3::Zero();        // point of the chord
  Vec3 axis_P = Vec3::UnitZ();      // of the great circle
  Vec3 beside_P = Vec3::Zero();     // from tip_P to where the tip is put
  Vec3 aim_axis_P = Vec3::UnitZ();  // where the tool axis is put
  Station station;                  // where the machine stands, on the word grid if it was asked for
};

/// Makes nodes of one segment.
class NodeMaker {
 public:
  NodeMaker(const Machine& machine, const TableKinematics& kinematics, const Rounding& rounding)
      : machine_(&machine),
        kinematics_(&kinematics),
        rounding_(&rounding),
        solver_(machine),
        connection_(kinematics, Angle()) {}

  void start(const Point& a, const Point& b);
  /// The node at `t`, its tool beside its place on the chord and the great circle by `displacement`; nodes
  /// that are linear in the rotary axes leave the axis where it is.
  Node node(double t, const ToolOff& displacement, NodeAxis how, bool rounded) const;
  /// Puts the rotary axes of `q` where the tool axis is `axis_P`, as near as there is a position; false where
  /// there is none.
  bool turn_to(const Vec3& axis_P, JointVector& q) const;
  /// A node that stands at rotary positions and tip as given.
  Node node_at(double t, const JointVector& q, const Vec3& tip_P, bool rounded) const {
    return node_at(t, q, {tip_P, axis_at(t)}, rounded, {});
  }
  /// Where the rotary axes come to when they follow the great circle from `from` to `axis_P`, within their
  /// limits; linear axes as they stand.
  std::optional<JointVector> followed(const Point& from, const Vec3& axis_P) const;
  /// The rotary position at the pole `axis_P` that is nearest to `near`.
  JointVector at_pole(const Vec3& axis_P, const JointVector& near) const;

 private:
  Vec3 axis_at(double t) const { return slerp(a_->axis_P, b_->axis_P, t); }
  Node node_at(double t, const JointVector& q, const ToolPose& pose, bool rounded,
               const KnownSines& known) const;
  void set_rotary(const Vec3& axis_P, JointVector& q, KnownSines& known) const;
  bool reach(const RotarySolution& solution, const Vec3& axis_P, JointVector& q) const;
  static KnownSines known_sines(const TableKinematics& kinematics, const RotarySolution& solution,
                                const JointVector& q);
  double off_course(const Vec3& axis_P, const JointVector& straight, const JointVector& candidate) const;

  const Machine* machine_;
  const TableKinematics* kinematics_;
  const Rounding* rounding_;
  RotarySolver solver_;
  RotaryConnection connection_;
  std::uint8_t branch_ = 0;  // of a
  bool follows_ = false;     // the rotary axes follow the great circle from a to b, and turn far
  const Point* a_ = nullptr;
  const Point* b_ = nullptr;
};

}  // namespace trunnion::path
