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

RotarySolver::RotarySolver(const Machine& machine) {
  Vec3 inner = Vec3::UnitZ();
  std::array<Vec3*, 2> n = {&n1_, &inner};
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
  const auto triple = [](const Vec3& v) { return lanes::Triple<double>{v.x(), v.y(), v.z()}; };
  const Vec3 m = n1_.cross(inner);
  n2_ = triple(inner);
  m_ = triple(m);
  sin_axes_ = m.norm();
  cos_axes_ = n1_.dot(inner);
  n1_k_ = n1_.dot(kSpindle_M);
  n1_k_n2_ = n1_.dot(kSpindle_M - inner);
  n1_across_n2_ = triple(across(n1_, inner));
  const Vec3 k = across(kSpindle_M, n1_);
  const auto turn_to_k = [&](const Vec3& from) { return Turn{n1_.dot(from.cross(k)), from.dot(k)}; };
  n2_to_k_ = turn_to_k(across(inner, n1_));
  m_to_k_ = turn_to_k(m);
  square_ = cos_axes_ == 0.0 && n1_k_n2_ == 0.0;
  mirrors_ = square_ && n1_k_ == 0.0 && sin_axes_ == 1.0 && n2_to_k_.y == 0.0 && m_to_k_.x == 0.0;
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
  const Tilt<double> tilt = tilt_of(lanes::Triple<double>{axis_P.x(), axis_P.y(), axis_P.z()});
  RotarySolutions out;
  const double short_by = std::abs(tilt.D) - tilt.S;  // of |n1 x n2| times the sine
  if (short_by > std::max(options.axis_resolution, kFreeTilt) * sin_axes_) {
    if (!kWithinLimits) out.missing_by = missing_by(tilt, short_by);
    return out;
  }
  const Asked asked{axis_P, seed_inner, options};
  if (solve_branch<kWithinLimits>(tilt, 1.0, asked, out.at[0])) out.count = 1;
  if (tilt.root2 > kTangent * kTangent && solve_branch<kWithinLimits>(tilt, -1.0, asked, out.at[out.count])) {
    ++out.count;
  }
  return out;
}

bool RotarySolver::surely_on_both(const Vec3& axis_P) const {
  if (count_ != 2) return false;
  const Tilt<double> tilt = tilt_of(lanes::Triple<double>{axis_P.x(), axis_P.y(), axis_P.z()});
  if (!(tilt.sine >= kDigitTilt && tilt.root2 > kTangent * kTangent)) return false;
  for (const double sign : {1.0, -1.0}) {
    const std::array<Turn, 2> turn = turns(tilt, sign);
    for (std::size_t k = 0; k < 2; ++k) {
      const double length = std::sqrt(turn[k].x * turn[k].x + turn[k].y * turn[k].y);
      if (window_[k].excludes<double>(turn[k], length)) return false;
    }
  }
  return true;
}

// The nearest reachable tilt differs by the difference of the two angles to the inner axis.
Angle RotarySolver::missing_by(const Tilt<double>& tilt, double short_by) const {
  const double reach =
      std::atan2(std::abs(tilt.D), std::sqrt(std::max(0.0, sin_axes_ * sin_axes_ - tilt.D * tilt.D)));
  const double asked = std::asin(std::min(1.0, tilt.S / sin_axes_));
  return Angle::radians(std::isfinite(reach) ? std::max(std::abs(reach - asked), short_by) : short_by);
}

template <bool kWithinLimits>
bool RotarySolver::solve_branch(const Tilt<double>& tilt, double sign, const Asked& asked,
                                RotarySolution& s) const {
  const std::array<Turn, 2> turn = turns(tilt, sign);
  s.branch = sign > 0.0 ? 0 : 1;
  s.sines_known = tilt.sine >= kDigitTilt;
  for (std::size_t k = 0; k < 2; ++k) {
    const double length = std::sqrt(turn[k].x * turn[k].x + turn[k].y * turn[k].y);
    const bool counts = k == 0 || s.sines_known;
    if (kWithinLimits && counts && window_[k].excludes<double>(turn[k], length)) return false;
    s.sines_known = s.sines_known && length > 0.0;
    s.sines.sin[k] = turn[k].y / length;
    s.sines.cos[k] = turn[k].x / length;
  }
  s.singular = tilt.sine < kFreeTilt;
  const Lanes angle = lanes::atan2(Lanes{turn[0].y, turn[1].y}, Lanes{turn[0].x, turn[1].x});
  s.angle[0] = wrapped(angle[0]);
  s.angle[1] = s.singular ? asked.seed_inner : wrapped(angle[1]);
  if (tilt.sine < kDigitTilt && !s.singular) {
    // C kept from before as long as the tool axis then errs by less than half a digit of the CL file.
    const Vec3 kept =
        rotation_about(n1_, Angle::radians(s.angle[0])) *
        (rotation_about(Vec3(n2_.x, n2_.y, n2_.z), Angle::radians(asked.seed_inner)) * asked.axis_P);
    if (angle_between(kept, kSpindle_M).rad() < asked.options.axis_resolution) {
      s.angle[1] = asked.seed_inner;
      s.singular = true;
    }
  }
  return true;
}

std::uint8_t RotarySolver::branch_of(double outer) const {
  const auto at = lanes::sincos(outer);
  return side_of(at.sin, at.cos) > 0.0 ? 0 : 1;
}

// The outer axis stands atan2(root, be) to either side of where it takes n2 to k.
bool RotarySolver::solve_one_of_two(const Vec3& axis_P, std::uint8_t branch, RotarySolution& out) const {
  const Tilt<double> tilt = tilt_of(lanes::Triple<double>{axis_P.x(), axis_P.y(), axis_P.z()});
  const double be = tilt.b - cos_axes_ * n1_k_;
  if (count_ != 2 || tilt.sine < kDigitTilt || !(tilt.root > kTanHalfApart * std::abs(be))) return false;
  return solve_branch<true>(tilt, branch == 0 ? 1.0 : -1.0, {axis_P, 0.0, {}}, out);
}

double RotarySolver::apart(double outer) const {
  const auto at = lanes::sincos(outer);
  return std::abs(side_of(at.sin, at.cos)) / sin_axes_;
}

RotarySolutions rotary_solutions(const Machine& machine, const Vec3& axis_P, double seed_inner,
                                 const InverseOptions& options) {
  return RotarySolver(machine).solve(axis_P, seed_inner, options);
}

}  // namespace trunnion
