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

  /// With two rotary axes: `solve_within_limits` gives a position on each branch, whatever the seed. In a
  /// fifth of its time; false near the pole.
  bool surely_on_both(const Vec3& axis_P) const;

  /// Turn that takes the part of one vector across an axis to that of another: its sine and cosine times a
  /// length.
  template <class T>
  struct TurnOf {
    T y, x;
  };
  /// The turns that a few tool axes ask for, side by side, of a machine with two rotary axes.
  template <class T>
  struct Turned {
    lanes::Mask<T> known;                  // far from the pole, and no axis that is only just in reach
    std::array<lanes::Mask<T>, 2> within;  // where known: the branch is within the limits
    std::array<std::array<TurnOf<T>, 2>, 2> turn;  // [branch][axis]
    std::array<std::array<T, 2>, 2> length;
    T apart;  // as `apart` of the positions on both branches
  };
  /// What `solve_within_limits` finds, where known and within.
  template <class T>
  struct Positions {
    std::array<std::array<T, 2>, 2> angle, sin, cos;  // [branch][axis]
  };
  /// T is Lanes or, in a function for four, Quads.
  template <class T>
  void turn_to(const lanes::Triple<T>& axis_P, Turned<T>& out) const;
  /// Of the branches that are `wanted`.
  template <class T>
  void find_positions(const Turned<T>& turned, const std::array<bool, 2>& wanted, Positions<T>& out) const;
  /// What `solve_one_of_two` finds for a few tool axes side by side.
  template <class T>
  struct OneTogether {
    lanes::Mask<T> known;  // else what follows says nothing
    std::array<T, 2> angle, sin, cos;
  };
  /// Each on the branch on which the outer axis stands where its sine and cosine are these.
  template <class T>
  void solve_one_together(const lanes::Triple<T>& axis_P, const T& sin_outer, const T& cos_outer,
                          OneTogether<T>& out) const;
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
  /// Both branches are the same within what doubles can tell (a square root of rounding).
  static constexpr double kTangent = 1e-15;
  static constexpr double kTanHalfApart = 0.1;  // of 0.199, beyond kApart_rad
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
  template <class T, class Sign>
  std::array<TurnOf<T>, 2> turns(const Tilt<T>& tilt, const Sign& sign) const;
  /// Above 0 on the first branch, below 0 on the second: where the outer axis stands.
  template <class T>
  T side_of(const T& sin_outer, const T& cos_outer) const {
    return sin_outer * m_to_k_.y + cos_outer * m_to_k_.x;
  }
  template <bool kWithinLimits>
  RotarySolutions solve_two(const Vec3& axis_P, double seed_inner, const InverseOptions& options) const;
  /// A tool axis in P, and where the inner axis is kept near the pole (rad).
  struct Asked {
    const Vec3& axis_P;
    double seed_inner;
    const InverseOptions& options;
  };
  template <bool kWithinLimits>
  bool solve_branch(const Tilt<double>& tilt, double sign, const Asked& asked, RotarySolution& out) const;
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
  // Of the rotary axes the outer one is square to the inner one, which stands along the spindle or is as far
  // from it: Tilt::D is 0 at every tool axis.
  bool square_ = false;
  // The outer axis stands opposite on the two branches, the inner one half a turn on: the outer one is square
  // to the spindle, too.
  bool mirrors_ = false;
};

// Quantities of the two-rotation problem: Rot(n1, A) Rot(n2, C) u = k with v = Rot(n2, C) u = al n1 + be n2 +
// ga (n1 x n2).
template <class T>
struct RotarySolver::Tilt {
  lanes::Triple<T> n2_x_u;
  lanes::Triple<T> u_across_n2;  // a difference: near the pole products would be rounding
  T sine;                        // |n2 x u|
  T b;                           // n2.u
  T S;                           // sine |n1 x n2|
  T D;                           // n1.k - (n2.u)(n1.n2)
  T root2;                       // S^2 - D^2
  T root;
};

template <class T>
RotarySolver::Tilt<T> RotarySolver::tilt_of(const lanes::Triple<T>& axis_P) const {
  Tilt<T> tilt;
  tilt.n2_x_u = lanes::cross(n2_, axis_P);
  tilt.sine = lanes::sqrt(lanes::squared(tilt.n2_x_u));
  tilt.b = lanes::dot(n2_, axis_P);
  tilt.u_across_n2 = axis_P - tilt.b * n2_;
  tilt.S = tilt.sine * sin_axes_;
  if (square_) {
    // To the last bit what follows gives.
    tilt.D = T{};
    tilt.root2 = tilt.S * tilt.S;
    tilt.root = tilt.S;
    return tilt;
  }
  // 1 - b without cancellation near the pole.
  const auto upper = tilt.b > 0.0;
  const T one_minus_b =
      lanes::select(upper, T(tilt.sine * tilt.sine / (1.0 + lanes::abs(tilt.b))), T(1.0 - tilt.b));
  tilt.D = n1_k_n2_ + cos_axes_ * one_minus_b;
  tilt.root2 = (tilt.S - tilt.D) * (tilt.S + tilt.D);
  tilt.root = lanes::sqrt(lanes::larger(T{}, tilt.root2));
  return tilt;
}

// The branch with ga = sign sqrt(S^2 - D^2) / |n1 x n2|^2: v |n1 x n2|^2 = al n1 + be n2 + ga m; across n1
// the first term falls out, across n2 the second.
template <class T, class Sign>
std::array<RotarySolver::TurnOf<T>, 2> RotarySolver::turns(const Tilt<T>& tilt, const Sign& sign) const {
  const T al = n1_k_ - cos_axes_ * tilt.b;
  const T be = tilt.b - cos_axes_ * n1_k_;
  const T ga = sign * tilt.root;
  const lanes::Triple<T> v_across_n2 = al * n1_across_n2_ + ga * m_;
  return {TurnOf<T>{be * n2_to_k_.y + ga * m_to_k_.y, be * n2_to_k_.x + ga * m_to_k_.x},
          TurnOf<T>{lanes::dot(v_across_n2, tilt.n2_x_u), lanes::dot(v_across_n2, tilt.u_across_n2)}};
}

// What `solve_branch` tests.
template <class T>
void RotarySolver::turn_to(const lanes::Triple<T>& axis_P, Turned<T>& out) const {
  const Tilt<T> tilt = tilt_of(axis_P);
  out.known = (tilt.sine >= kDigitTilt) & (tilt.root2 > kTangent * kTangent);
  out.apart = mirrors_ ? tilt.root : T(tilt.root / sin_axes_);
  out.turn[0] = turns(tilt, 1.0);
  if (mirrors_) {
    const auto& [outer, inner] = out.turn[0];
    out.turn[1] = {TurnOf<T>{-outer.y, outer.x}, TurnOf<T>{-inner.y, -inner.x}};
  } else {
    out.turn[1] = turns(tilt, -1.0);
  }
  for (std::size_t branch = 0; branch < 2; ++branch) {
    out.within[branch] = ~lanes::Mask<T>{};
    for (std::size_t k = 0; k < 2; ++k) {
      const TurnOf<T>& t = out.turn[branch][k];
      T& length = out.length[branch][k];
      length = branch == 1 && mirrors_ ? out.length[0][k] : lanes::sqrt(T(t.x * t.x + t.y * t.y));
      out.known &= length > 0.0;
      out.within[branch] &= ~window_[k].template excludes<T>(t, length);
    }
  }
}

template <class T>
void RotarySolver::find_positions(const Turned<T>& turned, const std::array<bool, 2>& wanted,
                                  Positions<T>& out) const {
  const std::size_t first = wanted[0] ? 0 : 1;
  if (!wanted[first]) return;
  for (std::size_t k = 0; k < 2; ++k) {
    lanes::Arctangent<T> arctangent(turned.turn[first][k].y, turned.turn[first][k].x);
    for (std::size_t branch = first; branch < 2; ++branch) {
      if (!wanted[branch]) continue;
      const TurnOf<T>& t = turned.turn[branch][k];
      if (branch > first && !mirrors_) arctangent = {t.y, t.x};
      const T angle = arctangent.at(t.y, t.x);
      out.angle[branch][k] = lanes::select(angle <= -kPi, lanes::splat<T>(kPi), angle);
      if (branch > first && mirrors_) {
        out.sin[1][k] = -out.sin[0][k];
        out.cos[1][k] = k == 0 ? out.cos[0][k] : T(-out.cos[0][k]);
        continue;
      }
      out.sin[branch][k] = t.y / turned.length[branch][k];
      out.cos[branch][k] = t.x / turned.length[branch][k];
    }
  }
}

template <class T>
void RotarySolver::solve_one_together(const lanes::Triple<T>& axis_P, const T& sin_outer, const T& cos_outer,
                                      OneTogether<T>& out) const {
  const Tilt<T> tilt = tilt_of(axis_P);
  const T be = tilt.b - cos_axes_ * n1_k_;
  out.known = (tilt.sine >= kDigitTilt) & (tilt.root > kTanHalfApart * lanes::abs(be));
  const T one = lanes::splat<T>(1.0);
  const T sign = lanes::select(side_of<T>(sin_outer, cos_outer) > 0.0, one, -one);
  const std::array<TurnOf<T>, 2> turn = turns<T, T>(tilt, sign);
  for (std::size_t k = 0; k < 2; ++k) {
    const TurnOf<T>& t = turn[k];
    const T length = lanes::sqrt(T(t.x * t.x + t.y * t.y));
    out.known &= (length > 0.0) & ~window_[k].template excludes<T>(t, length);
    const T angle = lanes::atan2(t.y, t.x);
    out.angle[k] = lanes::select(angle <= -kPi, lanes::splat<T>(kPi), angle);
    out.sin[k] = t.y / length;
    out.cos[k] = t.x / length;
  }
}

}  // namespace trunnion
