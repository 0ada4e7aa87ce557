#pragma once
#include "post/making/program_in_work.hpp"

namespace trunnion::post {

/// What the words of a place are: positions of the axes, or, under tool-centre-point control and in a tilted
/// plane, the tip in P or in the plane. Lengths are mm, angles rad.
class PlaceWords {
 public:
  explicit PlaceWords(const ProgramInWork& work) : work_(work) {}

  /// Not rounded.
  JointVector of(const JointVector& q) const;
  /// X Y Z words of `q` under tool-centre-point control, rounded: the tip in P.
  Vec3 tip_P(const JointVector& q) const;
  /// X, Y and Z words, not rounded, of the tip at `tip_P` with the rotary axes of `at`.
  Vec3 xyz(const Vec3& tip_P, const JointVector& at) const;
  Vec3 xyz_of(const JointVector& words) const;
  nc::AxisWords quanta_of(const Vec3& xyz_mm) const;
  /// Where the axes stand for these words, the rotary axes as in `at`.
  JointVector joints_of(const nc::AxisWords& words, const JointVector& at) const;
  /// To the digits of the words; in a plane those of the rotary axes alone.
  void round(JointVector& q) const;

 private:
  JointVector of_part(const JointVector& q) const;

  const ProgramInWork& work_;
};

}  // namespace trunnion::post
