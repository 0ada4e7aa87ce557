#pragma once
#include <array>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// `rotary_solutions` of one machine, prepared for many tool axes. Keeps nothing of the machine but numbers.
class RotarySolver {
 public:
  explicit RotarySolver(const Machine& machine);

  /// As `rotary_solutions`.
  RotarySolutions solve(const Vec3& axis_P, double seed_inner, const InverseOptions& options = {}) const;
  /// Without those that the limits of an axis exclude in every turn by more than rounding. `missing_by` is
  /// not filled in.
  RotarySolutions solve_within_limits(const Vec3& axis_P, double seed_inner,
                                      const InverseOptions& options = {}) const;

 private:
  /// Turn that takes the part of one vector across an axis to that of another: its sine and cosine times a
  /// length.
  struct Turn {
    double y = 0.0;
    double x = 1.0;
  };
  /// Positions of an axis within its limits have the cosine of their way from the middle above `least`.
  struct Window {
    double sin = 0.0;
    double cos = 1.0;
    double least = -2.0;  // none
    bool excludes(const Turn& turn, double length) const {
      return turn.x * cos + turn.y * sin < least * length;
    }
  };
  struct Tilt;

  template <bool kWithinLimits>
  RotarySolutions solve_two(const Vec3& axis_P, double seed_inner, const InverseOptions& options) const;
  template <bool kWithinLimits>
  bool solve_branch(const Tilt& tilt, double sign, double seed_inner, const InverseOptions& options,
                    RotarySolution& out) const;
  Angle missing_by(const Tilt& tilt, double short_by) const;

  std::size_t count_ = 0;
  Vec3 n1_ = Vec3::UnitX();            // outer
  Vec3 n2_ = Vec3::UnitZ();            // inner
  Vec3 m_ = Vec3::Zero();              // n1 x n2
  double sin_axes_ = 0.0;              // its length
  double cos_axes_ = 0.0;              // n1.n2
  double n1_k_ = 0.0;                  // n1.k, k the spindle
  double n1_k_n2_ = 0.0;               // n1.(k - n2)
  Vec3 n1_across_n2_ = Vec3::UnitX();  // n1 - (n1.n2) n2
  // The turn about n1 of n2 and of m towards k.
  Turn n2_to_k_;
  Turn m_to_k_;
  std::array<Window, 2> window_;
};

}  // namespace trunnion
