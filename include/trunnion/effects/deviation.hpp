#pragma once
#include "trunnion/effects/effect.hpp"

namespace trunnion {

/// Actual minus nominal pose of the tool relative to the part: the displacement of the tool point and the
/// rotation vector of R_actual R_nominal^T, both in the axes of the frame that the variable's name says (M or
/// P).
struct Deviation {
  Vec3 displacement_mm = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();

  Deviation operator+(const Deviation& o) const {
    return {displacement_mm + o.displacement_mm, rotation_rad + o.rotation_rad};
  }
  Deviation operator-(const Deviation& o) const {
    return {displacement_mm - o.displacement_mm, rotation_rad - o.rotation_rad};
  }
  Deviation operator*(double factor) const { return {displacement_mm * factor, rotation_rad * factor}; }
};

/// One nominal pose of the machine and what errors do to it. Frames: M at q, P; `tool_mm` is the vector from
/// S to the point measured.
class DeviationMap {
 public:
  DeviationMap(const Machine& machine, const JointVector& q, const Vec3& tool_mm);

  /// Exact: what the forward model with these errors says. d_P = p_PT,actual - p_PT,nominal.
  Deviation exact_M(const ChainErrors& errors) const;
  Deviation exact_P(const ChainErrors& errors) const { return to_P(exact_M(errors)); }

  /// First order in the twist (the derivative of `exact_M` at zero errors): for a joint that carries the
  /// tool, or the spindle, d_M = R d + R r x lever, rotation R r; for a joint that carries the part, or the
  /// part, the same with the opposite sign.
  Deviation linear_M(const Link& link, const Twist& twist) const;
  Deviation linear_P(const Link& link, const Twist& twist) const { return to_P(linear_M(link, twist)); }
  /// What a translation of the part's set-up by `offset_P` (in P, mm) does to displacements: rotations stay.
  Deviation setup_translation_M(const Vec3& offset_P) const { return {-(R_MP_ * offset_P), Vec3::Zero()}; }

  Deviation to_M(const Deviation& d_P) const {
    return {R_MP_ * d_P.displacement_mm, R_MP_ * d_P.rotation_rad};
  }
  Deviation to_P(const Deviation& d_M) const {
    return {R_MP_.transpose() * d_M.displacement_mm, R_MP_.transpose() * d_M.rotation_rad};
  }
  const Mat3& R_MP() const { return R_MP_; }

 private:
  struct Lever {
    Mat3 R_M = Mat3::Identity();
    Vec3 lever_M = Vec3::Zero();  // from the origin of the link to the tool point
    double sign = 1.0;
  };
  const Lever& lever_of(const Link& link) const;
  const Machine* machine_;
  Mat3 R_MP_;
  std::array<Lever, kMaxAxes> joint_;
  Lever spindle_;
  Lever part_;
};

}  // namespace trunnion
