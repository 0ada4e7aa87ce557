#pragma once
#include <array>

#include "trunnion/base/lanes.hpp"
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

  /// What `solve_within_limits` finds for two tool axes side by side of a machine with two rotary axes.
  struct Pair {
    LaneMask known;                  // far from the pole, and no axis that is only just in reach
    std::array<LaneMask, 2> within;  // where known: the branch is within the limits, and what follows is it
    std::array<std::array<Lanes, 2>, 2> angle, sin, cos;  // [branch][axis]
    Lanes apart;                                          // as `apart` of the positions on both branches
  };
  /// Of a branch that is not `wanted` only `within` is filled in.
  Pair solve_pair(const lanes::Triple<Lanes>& axis_P, const std::array<bool, 2>& wanted = {true, true}) const;
  std::size_t count() const { return count_; }

  /// With two rotary axes: the sine of the angle at which the spindle, as the outer axis at this angle
  /// carries it, stands off the plane of both. The branches meet where it is 0; the tool axis is as far off
  /// the pole.
  double apart(double outer) const;
  /// With two rotary axes: the branch on which the outer one stands at this angle.
  std::uint8_t branch_of(double outer) const;
  /// Far from the pole, and where the outer axis stands on the two branches farther apart than kApart_rad:
  /// what `solve_within_limits` gives for one of them, in half its time. Else, and where it gives none:
  /// false.
  bool solve_one_of_two(const Vec3& axis_P, std::uint8_t branch, RotarySolution& out) const;
  static constexpr double kApart_rad = 0.19;

 private:
  /// Turn that takes the part of one vector across an axis to that of another: its sine and cosine times a
  /// length.
  template <class T>
  struct TurnOf {
    T y, x;
  };
  using Turn = TurnOf<double>;
  /// Positions of an axis within its limits have the cosine of their way from the middle above `least`.
  struct Window {
    double sin = 0.0;
    double cos = 1.0;
    double least = -2.0;  // none
    template <class T>
    auto excludes(const TurnOf<T>& turn, const T& length) const {
      return turn.x * cos + turn.y * sin < least * length;
    }
  };
  template <class T>
  struct Tilt;

  template <class T>
  Tilt<T> tilt_of(const lanes::Triple<T>& axis_P) const;
  /// Turns of both axes of the branch with this sign.
  template <class T>
  std::array<TurnOf<T>, 2> turns(const Tilt<T>& tilt, double sign) const;
  template <bool kWithinLimits>
  RotarySolutions solve_two(const Vec3& axis_P, double seed_inner, const InverseOptions& options) const;
  template <bool kWithinLimits>
  bool solve_branch(const Tilt<double>& tilt, double sign, const Vec3& axis_P, double seed_inner,
                    const InverseOptions& options, RotarySolution& out) const;
  Angle missing_by(const Tilt<double>& tilt, double short_by) const;

  std::size_t count_ = 0;
  Vec3 n1_ = Vec3::UnitX();                            // outer
  lanes::Triple<double> n2_{0.0, 0.0, 1.0};            // inner
  lanes::Triple<double> m_{0.0, 0.0, 0.0};             // n1 x n2
  double sin_axes_ = 0.0;                              // its length
  double cos_axes_ = 0.0;                              // n1.n2
  double n1_k_ = 0.0;                                  // n1.k, k the spindle
  double n1_k_n2_ = 0.0;                               // n1.(k - n2)
  lanes::Triple<double> n1_across_n2_{1.0, 0.0, 0.0};  // n1 - (n1.n2) n2
  // The turn about n1 of n2 and of m towards k.
  Turn n2_to_k_{0.0, 1.0};
  Turn m_to_k_{0.0, 1.0};
  std::array<Window, 2> window_;
  // The outer axis stands opposite on the two branches, the inner one half a turn on: axes square to each
  // other, and the outer one to the spindle.
  bool mirrors_ = false;
};

}  // namespace trunnion
