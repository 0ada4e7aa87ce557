#pragma once
#include <array>
#include <optional>

#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

/// Whether the rotary axes can follow the tool axis from one position to another, along the great circle, to
/// within a tolerance. A position is that of the outer [0] and the inner [1] rotary axis.
///
/// With v = Rot(n0, A)^T k = Rot(n1, C) u the inner axis stands at C = az(v) - az(u), az the azimuth about
/// n1: on a great circle az(u) changes by the angle between the projections, below half a turn, and on one
/// branch (v on one side of the plane of n0 and n1) so does az(v). Branches meet at the pole (u along n1),
/// where C is free, and where v lies in that plane away from it: at the largest tilt that the axes reach.
class RotaryConnection {
 public:
  using Angles = std::array<double, 2>;

  RotaryConnection(const TableKinematics& kinematics, Angle tolerance);
  /// Positions differ by whole turns where they differ at all; the rest, rad, is rounding and tolerance.
  static constexpr double kSameTurn = 0.5;

  /// `a` holds the unit tool axis `axis_a_P`, `b` holds `axis_b_P`. Limits are not looked at.
  bool connects(const Angles& a, const Vec3& axis_a_P, const Angles& b, const Vec3& axis_b_P) const;
  bool connects(const JointVector& a, const Vec3& axis_a_P, const JointVector& b, const Vec3& axis_b_P) const;
  /// No step between the branches connects where the tool axis turns by at most `turn`, rad, and
  /// RotarySolver::apart is `apart` at least at both ends: then it stays that far off the pole and the fold.
  bool parts(double apart, double turn) const {
    constexpr double kHair = 1e-9;  // of rounding
    return apart > fold_rad_ + kHair && apart > tolerance_rad_ + turn + kHair;
  }
  /// The turn of the inner axis when the axes follow from `a` to where the outer one stands at `outer_b`; `a`
  /// and `outer_b` on one branch. Nothing otherwise.
  std::optional<double> followed_turn(const Angles& a, const Vec3& axis_a_P, double outer_b,
                                      const Vec3& axis_b_P) const;
  /// The great circle between the two comes to the pole within a fifth of the tolerance: then points can lead
  /// through it.
  bool passes_pole(const Vec3& axis_a_P, const Vec3& axis_b_P) const;

 private:
  Vec3 v(double outer) const;
  bool one_branch(const Vec3& v_a, const Vec3& v_b) const;

  const TableKinematics& kinematics_;
  double tolerance_rad_;
  double fold_rad_;        // off the plane of both axes so far a position is on either branch
  Vec3 m_ = Vec3::Zero();  // unit, across both axes
};

}  // namespace trunnion::path
