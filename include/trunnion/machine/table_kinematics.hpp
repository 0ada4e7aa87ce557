#pragma once
#include <array>
#include <cmath>

#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// The nominal chain of one machine and tool, prepared for many evaluations: the same pose as `forward`
/// (tests: within 1e-10 mm and 1e-14), with two sine-cosine pairs and two turns of a vector instead of
/// products of poses. No rotary axis, one, or two.
///
///     p_P = Rot(n1, C)^T [ Rot(n0, A)^T w(q) + b(q) ] + g(q),     u_P = Rot(n1, C)^T Rot(n0, A)^T k
///
/// A the outer, C the inner rotary axis; w, b, g affine in the linear axes (b and g constant unless a linear
/// axis stands between or beyond the rotary ones in the part's chain); k the spindle direction. README of
/// this layer.
class TableKinematics {
 public:
  TableKinematics(const Machine& machine, const Vec3& tool_mm);

  using Sines = RotarySines;
  Sines sines(const JointVector& q) const {
    Sines s;
    if (rotary_count_ == 0) return s;
    // Two side by side; of a single axis twice the same.
    const auto of = lanes::sincos(Lanes{q[rotary_[0]], q[rotary_[rotary_count_ - 1]]});
    for (std::size_t k = 0; k < rotary_count_; ++k) {
      s.sin[k] = of.sin[static_cast<int>(k)];
      s.cos[k] = of.cos[static_cast<int>(k)];
    }
    return s;
  }

  Vec3 tip_P(const JointVector& q, const Sines& s) const {
    return turn_back(1, turn_back(0, w(q), s) + b(q), s) + g(q);
  }
  Vec3 axis_P(const Sines& s) const { return turn_back(1, turn_back(0, k_, s), s); }
  ToolPose pose(const JointVector& q) const {
    const Sines s = sines(q);
    return {tip_P(q, s), axis_P(s)};
  }
  /// Turns a vector of P into M: R_MP.
  Vec3 to_machine(const Vec3& v_P, const Sines& s) const { return turn(0, turn(1, v_P, s), s); }

  /// Several positions side by side, with the formulas of one: T is `double` or `Lanes`.
  template <class T>
  struct SinesOf {
    std::array<T, 2> sin, cos;
  };
  /// False: only one at a time. Else there are two rotary axes, and the linear ones stand before them along
  /// X, Y and Z of M, so that w is a constant and their positions.
  bool side_by_side() const { return rotary_count_ == 2 && along_xyz_; }
  template <class T>
  lanes::Triple<T> linear_positions(const lanes::Triple<T>& tip_P, const SinesOf<T>& s) const {
    const lanes::Triple<T> outer = turned(1, tip_P - constant(2), s) - constant(1);
    return turned(0, outer, s) - constant(0);
  }
  template <class T>
  lanes::Triple<T> turned(std::size_t k, const lanes::Triple<T>& v, const SinesOf<T>& s) const {
    return turn_[k].turned(v, s.sin[k], s.cos[k]);
  }
  template <class T>
  lanes::Triple<T> turned_back(std::size_t k, const lanes::Triple<T>& v, const SinesOf<T>& s) const {
    return turn_[k].turned(v, T(-s.sin[k]), s.cos[k]);
  }
  /// w, b and g at zero.
  lanes::Triple<double> constant(std::size_t slot) const {
    return {constant_[slot].x(), constant_[slot].y(), constant_[slot].z()};
  }

  /// Positions of the linear axes `linear(0)` to `linear(2)` that put the tip at `tip_P`, mm.
  Vec3 linear_positions(const Vec3& tip_P, const Sines& s) const {
    // With the linear axes at zero the tip misses by `gap`, in the axes of w.
    Vec3 gap = turn(0, turn(1, tip_P - constant_[2], s) - constant_[1], s) - constant_[0];
    if (along_xyz_) return gap;
    return linear_first_ ? Vec3(unmix_ * gap) : solve_between(gap, s);
  }
  AxisId linear(std::size_t i) const { return linear_[i].id; }
  /// As the free function `solve_linear` for the tool given at construction.
  void solve_linear(const Vec3& tip_P, const Sines& s, JointVector& q) const {
    const Vec3 solved = linear_positions(tip_P, s);
    for (std::size_t i = 0; i < 3; ++i) q[linear_[i].id] = solved[static_cast<Eigen::Index>(i)];
  }

  std::size_t rotary_count() const { return rotary_count_; }
  AxisId rotary(std::size_t k) const { return rotary_[k]; }  // 0 outer, 1 inner; k < rotary_count()
  double angle(const JointVector& q, std::size_t k) const { return k < rotary_count_ ? q[rotary_[k]] : 0.0; }
  const Vec3& direction(std::size_t k) const { return turn_[k].direction(); }

  /// w, b, g at q, mm (see above).
  Vec3 w(const JointVector& q) const { return affine(0, q); }
  Vec3 b(const JointVector& q) const { return affine(1, q); }
  Vec3 g(const JointVector& q) const { return affine(2, q); }
  const Vec3& spindle() const { return k_; }
  /// True when b and g do not depend on q: all linear axes stand before the rotary ones.
  bool linear_axes_first() const { return linear_first_; }

  /// v turned by +angle (`turn`) or -angle (`turn_back`) about n_k.
  Vec3 turn(std::size_t k, const Vec3& v, const Sines& s) const {
    return turn_[k].turned(v, s.sin[k], s.cos[k]);
  }
  Vec3 turn_back(std::size_t k, const Vec3& v, const Sines& s) const {
    return turn_[k].turned(v, -s.sin[k], s.cos[k]);
  }

 private:
  Vec3 affine(std::size_t slot, const JointVector& q) const {
    const Vec3& constant = constant_[slot];
    if (linear_first_ && slot != 0) return constant;
    if (along_xyz_) return constant + Vec3(q[linear_[0].id], q[linear_[1].id], q[linear_[2].id]);
    Vec3 sum = constant;
    for (const LinearAxis& axis : linear_) {
      if (axis.slot == slot) sum += q[axis.id] * axis.motion;
    }
    return sum;
  }
  /// Linear axes between or beyond the rotary ones: their motion turns with those.
  Vec3 solve_between(const Vec3& gap, const Sines& sines) const;
  struct LinearAxis {
    AxisId id = 0;
    std::size_t slot = 0;
    Vec3 motion = Vec3::Zero();  // how q moves the tip relative to what follows, in the slot's axes
  };
  std::size_t rotary_count_ = 0;
  std::array<AxisId, 2> rotary_{};
  std::array<AxisTurn, 2> turn_{AxisTurn(Vec3::UnitX()), AxisTurn(Vec3::UnitZ())};
  std::array<LinearAxis, 3> linear_;
  std::array<Vec3, 3> constant_{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  Vec3 k_ = Vec3::UnitZ();
  Mat3 unmix_ = Mat3::Identity();  // inverse of the motion columns when linear_first_
  bool linear_first_ = true;
  bool along_xyz_ = false;  // linear_first_, and the linear axes are those of M, in this order
};

}  // namespace trunnion
