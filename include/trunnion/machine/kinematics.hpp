#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// Errors of the whole chain at one moment: the twist of every joint's carried body, at the joint's moving
/// origin, in the axes of its fixed side; of the spindle before the tool vector; of the part after its zero
/// (README of this layer, "Errors").
struct ChainErrors {
  std::array<Twist, kMaxAxes> joint{};
  Twist spindle;
  Twist part;
};

/// Some of its links.
struct ChainLinks {
  std::array<bool, kMaxAxes> joint{};
  bool spindle = false;
  bool part = false;
};

/// X_PT: pose of the tool tip in the part, the one forward model. `tool_mm` is the vector from S to the point
/// of interest.
Pose forward(const Machine& machine, const JointVector& q, const Vec3& tool_mm);
Pose forward(const Machine& machine, const JointVector& q, const Vec3& tool_mm, const ChainErrors& errors);
inline Pose forward(const Machine& machine, const JointVector& q) {
  return forward(machine, q, machine.tool_vector());
}

/// X_MP, nominal: pose of the part in the machine (it does not depend on linear axes that carry the tool).
Pose part_in_machine(const Machine& machine, const JointVector& q);

/// Where the chain's elements stand: the twist of joint j acts at `origin_M` in axes `R_M` (nominal).
struct JointFrame {
  Mat3 R_M;       // axes of the joint's fixed side
  Vec3 origin_M;  // moving origin of the joint, mm
};
JointFrame joint_frame(const Machine& machine, const JointVector& q, AxisId id);

/// The tool as the CL file prescribes it, in the part frame P.
struct ToolPose {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();  // unit, from the tip to the spindle
};
inline ToolPose tool_pose(const Pose& X_PT) {
  return {X_PT.p, X_PT.R.col(2)};
}

/// Sine and cosine of the outer [0] and inner [1] rotary axis.
struct RotarySines {
  std::array<double, 2> sin{0.0, 0.0};
  std::array<double, 2> cos{1.0, 1.0};

  /// Largest turn for `turn`.
  static constexpr double kSmallTurn_rad = 1e-4;
  /// Axis k goes on by a small angle: the first term left out is 4e-18.
  void turn(std::size_t k, double by) {
    const double d = by - by * by * by / 6.0;
    const double e = 0.5 * by * by;
    const double s = sin[k];
    sin[k] = s - e * s + d * cos[k];
    cos[k] = cos[k] - e * cos[k] - d * s;
  }
};

/// Positions of the two (one, no) rotary axes that turn `axis_P` into the spindle's direction, in (-pi, pi].
/// `singular`: the inner axis (C) has no direction of its own there.
struct RotarySolution {
  std::array<double, 2> angle{};  // outer (A), inner (C), rad
  RotarySines sines;              // of the angles, where `sines_known`
  bool sines_known = false;
  std::uint8_t branch = 0;
  bool singular = false;
};

struct RotarySolutions {
  std::array<RotarySolution, 2> at{};
  std::size_t count = 0;
  /// When count is 0: the smallest angle by which the tool axis misses what the axes can reach.
  Angle missing_by;
};

struct InverseOptions {
  /// Half a digit of the CL file's axis components: below a tilt of 1e-6 the pole keeps C from `seed` while
  /// the tool axis errs less than this, and an axis that is out of reach by less than this is taken as
  /// tangent.
  double axis_resolution = 0.0;
};

/// sin(tilt) below which C has no direction at all.
inline constexpr double kFreeTilt = 1e-12;
/// sin(tilt) below which the direction of C comes from the CL file's rounding.
inline constexpr double kDigitTilt = 1e-6;

/// Solves R_MP(A, C) axis_P = +Z of M (Paden-Kahan subproblem 2, closed form).
/// @return 0, 1 (tangent, or one rotary axis) or 2 solutions; at the pole the inner angle is `seed_inner`.
RotarySolutions rotary_solutions(const Machine& machine, const Vec3& axis_P, double seed_inner,
                                 const InverseOptions& options = {});

/// Fills in the linear axes so that the tip (tool vector `tool_mm`) stands at `tip_P`, the rotary positions
/// in `q` given. Accuracy 1e-9 mm. Limits are not looked at.
void solve_linear(const Machine& machine, const Vec3& tip_P, const Vec3& tool_mm, JointVector& q);

/// `angle` plus the whole turns that bring it nearest to `seed`, within the axis' limits; nothing when no
/// turn is within them.
std::optional<double> nearest_turn(const Axis& axis, double angle, double seed);

struct JointSolution {
  JointVector q;
  std::uint8_t branch = 0;
  bool singular = false;
};

/// Joint positions that put the tool at `pose`, one per branch (each at the turn nearest to `seed` within
/// limits), nearest to `seed` in the rotary axes first; linear limits are not a reason to drop one (see
/// `limit_violations`).
///
/// Frames: `pose` in the part frame P; result in machine axes (mm, rad).
/// Accuracy: forward(inverse(pose)) meets pose within 1e-9 mm and 1e-12 rad on the nominal chain (tilt above
/// 1e-6; below it within options.axis_resolution).
/// @return empty when no branch reaches `pose` within the rotary limits.
std::vector<JointSolution> inverse(const Machine& machine, const ToolPose& pose, const JointVector& seed,
                                   const InverseOptions& options = {});

/// One axis beyond its limit.
struct LimitViolation {
  AxisId axis = 0;
  double value = 0.0;  // mm, rad
  double by = 0.0;     // how far beyond, > 0
};
std::vector<LimitViolation> limit_violations(const Machine& machine, const JointVector& q);

/// NC word values of `q`: the coordinate of each axis as the control counts it (mm, rad): the tip or S minus
/// the work offset for linear axes (Machine::output_point), the joint position itself for rotary axes.
/// `tool_mm` as programmed.
JointVector words_of(const Machine& machine, const JointVector& q, const Vec3& tool_mm);
/// The inverse of `words_of`.
JointVector joints_of_words(const Machine& machine, const JointVector& words, const Vec3& tool_mm);

}  // namespace trunnion
