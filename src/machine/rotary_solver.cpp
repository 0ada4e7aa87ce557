#include "trunnion/machine/rotary_solver.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {
namespace {

// Direction of the spindle, from the tip upwards, when no axis of the tool side turns.
const Vec3 kSpindle_M = Vec3::UnitZ();

// atan2 gives [-pi, pi].
double wrapped(double angle) {
  return angle <= -kPi ? kPi : angle;
}

Vec3 across(const Vec3& v, const Vec3& n) {
  return v - n.dot(v) * n;
}

// No rotary axis, or one: the tool axis must be where the axis can turn it.
RotarySolutions single_rotary(const Vec3* n, const Vec3& axis_P, double slack, double seed) {
  RotarySolutions out;
  RotarySolution s;
  Vec3 reached = axis_P;
  if (n != nullptr) {
    // No direction of its own when the tool stands along the axis.
    s.singular = axis_P.cross(*n).norm() < kFreeTilt;
    const Vec3 from = across(axis_P, *n);
    const Vec3 to = across(kSpindle_M, *n);
    s.angle[0] = s.singular ? seed : wrapped(std::atan2(n->dot(from.cross(to)), from.dot(to)));
    reached = rotation_about(*n, Angle::radians(s.angle[0])) * axis_P;
  }
  out.missing_by = angle_between(reached, kSpindle_M);
  if (out.missing_by.rad() > std::max(slack, 1e-12)) return out;
  out.at[0] = s;
  out.count = 1;
  return out;
}

}  // namespace

// Quantities of the two-rotation problem: Rot(n1, A) Rot(n2, C) u = k with v = Rot(n2, C) u = al n1 + be n2 +
// ga (n1 x n2).
struct RotarySolver::Tilt {
  Vec3 u;
  Vec3 n2_x_u;
  Vec3 u_across_n2;  // a difference: near the pole products would be rounding
  double sine;       // |n2 x u|
  double b;          // n2.u
  double S;          // sine |n1 x n2|
  double D;          // n1.k - (n2.u)(n1.n2)
  double root;       // sqrt(S^2 - D^2)
};

RotarySolver::RotarySolver(const Machine& machine) {
  std::array<Vec3*, 2> n = {&n1_, &n2_};
  for (const AxisId id : machine.part_chain) {
    const Axis& axis = machine.axes[id];
    if (axis.kind != AxisKind::rotary) continue;
    *n[count_] = axis.direction;
    // A hair for the rounding of angles at a limit.
    constexpr double kSlack_rad = 1e-9;
    const double half = 0.5 * (axis.max - axis.min) + kSlack_rad;
    if (axis.has_limits() && half < kPi) {
      const double middle = 0.5 * (axis.min + axis.max);
      window_[count_] = {std::sin(middle), std::cos(middle), std::cos(half) - kSlack_rad};
    }
    ++count_;
  }
  m_ = n1_.cross(n2_);
  sin_axes_ = m_.norm();
  cos_axes_ = n1_.dot(n2_);
  n1_k_ = n1_.dot(kSpindle_M);
  n1_k_n2_ = n1_.dot(kSpindle_M - n2_);
  n1_across_n2_ = across(n1_, n2_);
  const Vec3 k = across(kSpindle_M, n1_);
  const auto turn_to_k = [&](const Vec3& from) { return Turn{n1_.dot(from.cross(k)), from.dot(k)}; };
  n2_to_k_ = turn_to_k(across(n2_, n1_));
  m_to_k_ = turn_to_k(m_);
}

RotarySolutions RotarySolver::solve(const Vec3& axis_P, double seed_inner,
                                    const InverseOptions& options) const {
  if (count_ == 2) return solve_two<false>(axis_P, seed_inner, options);
  return single_rotary(count_ == 1 ? &n1_ : nullptr, axis_P, options.axis_resolution, seed_inner);
}

RotarySolutions RotarySolver::solve_within_limits(const Vec3& axis_P, double seed_inner,
                                                  const InverseOptions& options) const {
  return count_ == 2 ? solve_two<true>(axis_P, seed_inner, options) : solve(axis_P, seed_inner, options);
}

template <bool kWithinLimits>
RotarySolutions RotarySolver::solve_two(const Vec3& axis_P, double seed_inner,
                                        const InverseOptions& options) const {
  Tilt tilt;
  tilt.u = axis_P;
  tilt.n2_x_u = n2_.cross(axis_P);
  tilt.sine = tilt.n2_x_u.norm();
  tilt.b = n2_.dot(axis_P);
  tilt.u_across_n2 = axis_P - tilt.b * n2_;
  // 1 - b without cancellation near the pole.
  const double one_minus_b = tilt.b > 0.0 ? tilt.sine * tilt.sine / (1.0 + tilt.b) : 1.0 - tilt.b;
  tilt.S = tilt.sine * sin_axes_;
  tilt.D = n1_k_n2_ + cos_axes_ * one_minus_b;
  const double root2 = (tilt.S - tilt.D) * (tilt.S + tilt.D);
  tilt.root = std::sqrt(std::max(0.0, root2));
  RotarySolutions out;
  const double short_by = std::abs(tilt.D) - tilt.S;  // of |n1 x n2| times the sine
  if (short_by > std::max(options.axis_resolution, kFreeTilt) * sin_axes_) {
    if (!kWithinLimits) out.missing_by = missing_by(tilt, short_by);
    return out;
  }
  if (solve_branch<kWithinLimits>(tilt, 1.0, seed_inner, options, out.at[0])) out.count = 1;
  // Tangent: both branches are the same within what doubles can tell (a square root of rounding).
  constexpr double kTangent = 1e-15;
  if (root2 > kTangent * kTangent &&
      solve_branch<kWithinLimits>(tilt, -1.0, seed_inner, options, out.at[out.count])) {
    ++out.count;
  }
  return out;
}

// The nearest reachable tilt differs by the difference of the two angles to the inner axis.
Angle RotarySolver::missing_by(const Tilt& tilt, double short_by) const {
  const double reach =
      std::atan2(std::abs(tilt.D), std::sqrt(std::max(0.0, sin_axes_ * sin_axes_ - tilt.D * tilt.D)));
  const double asked = std::asin(std::min(1.0, tilt.S / sin_axes_));
  return Angle::radians(std::isfinite(reach) ? std::max(std::abs(reach - asked), short_by) : short_by);
}

// The branch with ga = sign sqrt(S^2 - D^2) / |n1 x n2|^2.
template <bool kWithinLimits>
bool RotarySolver::solve_branch(const Tilt& tilt, double sign, double seed_inner,
                                const InverseOptions& options, RotarySolution& s) const {
  // v |n1 x n2|^2 = al n1 + be n2 + ga m: across n1 the first term falls out, across n2 the second.
  const double al = n1_k_ - cos_axes_ * tilt.b;
  const double be = tilt.b - cos_axes_ * n1_k_;
  const double ga = sign * tilt.root;
  const Vec3 v_across_n2 = al * n1_across_n2_ + ga * m_;
  const std::array<Turn, 2> turn = {Turn{be * n2_to_k_.y + ga * m_to_k_.y, be * n2_to_k_.x + ga * m_to_k_.x},
                                    Turn{v_across_n2.dot(tilt.n2_x_u), v_across_n2.dot(tilt.u_across_n2)}};
  s.branch = sign > 0.0 ? 0 : 1;
  s.sines_known = tilt.sine >= kDigitTilt;
  for (std::size_t k = 0; k < 2; ++k) {
    const double length = std::sqrt(turn[k].x * turn[k].x + turn[k].y * turn[k].y);
    const bool counts = k == 0 || s.sines_known;
    if (kWithinLimits && counts && window_[k].excludes(turn[k], length)) return false;
    s.sines_known = s.sines_known && length > 0.0;
    s.sines.sin[k] = turn[k].y / length;
    s.sines.cos[k] = turn[k].x / length;
  }
  s.singular = tilt.sine < kFreeTilt;
  s.angle[0] = wrapped(std::atan2(turn[0].y, turn[0].x));
  s.angle[1] = s.singular ? seed_inner : wrapped(std::atan2(turn[1].y, turn[1].x));
  if (tilt.sine < kDigitTilt && !s.singular) {
    // C kept from before as long as the tool axis then errs by less than half a digit of the CL file.
    const Vec3 kept = rotation_about(n1_, Angle::radians(s.angle[0])) *
                      (rotation_about(n2_, Angle::radians(seed_inner)) * tilt.u);
    if (angle_between(kept, kSpindle_M).rad() < options.axis_resolution) {
      s.angle[1] = seed_inner;
      s.singular = true;
    }
  }
  return true;
}

RotarySolutions rotary_solutions(const Machine& machine, const Vec3& axis_P, double seed_inner,
                                 const InverseOptions& options) {
  return RotarySolver(machine).solve(axis_P, seed_inner, options);
}

}  // namespace trunnion
