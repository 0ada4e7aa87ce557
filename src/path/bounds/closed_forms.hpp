#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "path/bounds/convex.hpp"
#include "path/bounds/expansion.hpp"
#include "path/bounds/side_by_side.hpp"

namespace trunnion::path {

// Closed forms of the certificate, in the order of their cost (README of this layer, "The certificate"). All
// bounds are proved for exact arithmetic; `rounding` covers the doubles.

/// What a search is to reach: every part below `tolerance` (a decision), or within `ratio` of the largest
/// sample. mm, or rad for the axis.
struct Goal {
  double tolerance = std::numeric_limits<double>::infinity();
  double ratio = 1.0;
  double floor = 0.0;
  bool decides() const { return tolerance < std::numeric_limits<double>::infinity(); }
};

/// How large the rotary angles at both ends of a piece are together, rad: roundings grow with them.
inline double size_of_angles(const TableKinematics& k, const Station& a, const Station& b) {
  return std::abs(k.angle(a.q, 0)) + std::abs(k.angle(b.q, 0)) + std::abs(k.angle(a.q, 1)) +
         std::abs(k.angle(b.q, 1));
}

/// Rounding of the distances of the tip on a piece, mm.
inline double tip_rounding(const TableKinematics& k, const Station& a, const Station& b) {
  return tip_rounding(a.size_mm + b.size_mm, size_of_angles(k, a, b));
}

/// AxisMotion of the piece between two stations.
inline AxisMotion<double> axis_motion(const TableKinematics& k, const Station& a, const Station& b) {
  return {k.angle(b.q, 0) - k.angle(a.q, 0), k.angle(b.q, 1) - k.angle(a.q, 1),
          k.direction(0).dot(k.spindle()), k.direction(1).dot(b.axis_P), k.direction(0).dot(k.direction(1))};
}

/// NormsOf of the piece between two stations.
inline NormsOf<double> piece_norms(const TableKinematics& k, const Station& a, const Station& b) {
  const double way = (b.w - a.w).norm();
  const double slope = k.linear_axes_first() ? way : way + (k.b(b.q) - k.b(a.q)).norm();
  return {
      std::abs(k.angle(b.q, 0) - k.angle(a.q, 0)), std::abs(k.angle(b.q, 1) - k.angle(a.q, 1)), way, slope,
      std::max(a.arm2_outer, b.arm2_outer),        std::max(a.arm2_inner, b.arm2_inner)};
}

/// Squared arm of the tool axis from the inner rotary one: turned back about it, it is as far from it as in
/// P.
inline double axis_arm2(const TableKinematics& k, const Station& s) {
  return k.direction(1).cross(Vec3(s.axis_P - s.axis_shift_P)).squaredNorm();
}

/// NormsOf for the tool axis: the unit vector k stands in the place of w, nothing moves it but the turns.
inline NormsOf<double> axis_norms(const TableKinematics& k, const Station& a, const Station& b) {
  return {
      std::abs(k.angle(b.q, 0) - k.angle(a.q, 0)),     std::abs(k.angle(b.q, 1) - k.angle(a.q, 1)), 0.0, 0.0,
      k.direction(0).cross(k.spindle()).squaredNorm(), std::max(axis_arm2(k, a), axis_arm2(k, b))};
}

/// Of the tip, and beside it of the tool axis.
inline NormsOf<Lanes> tip_and_axis_norms(const TableKinematics& k, const Station& a, const Station& b) {
  const double way = (b.w - a.w).norm();
  const double slope = k.linear_axes_first() ? way : way + (k.b(b.q) - k.b(a.q)).norm();
  return {lanes::splat<Lanes>(std::abs(k.angle(b.q, 0) - k.angle(a.q, 0))),
          lanes::splat<Lanes>(std::abs(k.angle(b.q, 1) - k.angle(a.q, 1))),
          Lanes{way, 0.0},
          Lanes{slope, 0.0},
          Lanes{std::max(a.arm2_outer, b.arm2_outer), k.direction(0).cross(k.spindle()).squaredNorm()},
          Lanes{std::max(a.arm2_inner, b.arm2_inner), std::max(axis_arm2(k, a), axis_arm2(k, b))}};
}

/// Where the tip is in the middle of a piece, without a new sine.
inline Vec3 middle_tip(const TableKinematics& k, const Station& a, const Station& b) {
  const TableKinematics::Sines mid = middle_sines(k, a, b);
  const Vec3 inner = k.turn_back(0, 0.5 * (a.w + b.w), mid);
  const Vec3 shift = 0.5 * (a.tip_shift_P + b.tip_shift_P);
  if (k.linear_axes_first()) return k.turn_back(1, inner + k.b(a.q), mid) + k.g(a.q) + shift;
  return k.turn_back(1, inner + 0.5 * (k.b(a.q) + k.b(b.q)), mid) + 0.5 * (k.g(a.q) + k.g(b.q)) + shift;
}

/// beyond_parabola with the third derivative of the middle, which changes by at most M4/2 up to the ends.
inline double beyond_parabola(const Expansion& e) {
  return beyond_parabola(e.f3.norm() + 0.5 * e.M4);
}

/// Where the tool axis points in the middle of a piece, without a new sine.
inline Vec3 middle_axis(const TableKinematics& k, const Station& a, const Station& b) {
  return k.axis_P(middle_sines(k, a, b)) + 0.5 * (a.axis_shift_P + b.axis_shift_P);
}

/// A bound on the distance of the tool axis from the plane sector that an arc spans (convex.hpp), over a
/// piece. Across the plane the axis runs as the parabola through the ends and the middle but for M3 / (72
/// sqrt 3): what it leaves its chord by is mostly its way round the sphere, which lies in the plane. How far
/// it may be beyond the ends of the arc is told by the whole bow, M2 / 8. Nothing where it may be behind the
/// sector's tip.
inline double axis_from_parabola(const ArcShape& shape, const Vec3& a, const Vec3& middle, const Vec3& b,
                                 const NormsOf<double>& norms) {
  const ArcShape::Foot foot_a = shape.foot(a);
  const ArcShape::Foot foot_b = shape.foot(b);
  const double x = shape.beside(a);
  const double y = shape.beside(b);
  const double c = shape.beside(middle) - 0.5 * (x + y);
  const double sign = c < 0.0 ? -1.0 : 1.0;
  const double across = std::max({largest_bowed(sign * x, sign * y, std::abs(c)), -sign * x, -sign * y}) +
                        beyond_parabola(norms.M3());
  const double bow = norms.M2() / 8.0;
  double over = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double beyond = largest_bowed(foot_a.over[k], foot_b.over[k], bow);
    if (beyond > 0.0 && !(std::min(foot_a.front[k], foot_b.front[k]) > bow))
      return std::numeric_limits<double>::infinity();
    over = std::max(over, beyond);
  }
  return over > 0.0 ? std::sqrt(across * across + over * over) : across;
}

/// Distance from a segment of the curve that runs through the ends and the middle of a piece as a parabola.
/// The piece itself leaves it by at most M3 max|(s + 1/2) s (s - 1/2)| / 6 = M3 / (72 sqrt 3).
class ParabolaForm {
 public:
  ParabolaForm(const Reference& r, const Station& a, const Station& b, const Vec3& middle_P)
      : bow_(middle_P - 0.5 * (a.tip_P + b.tip_P)), chord_(r.tip1_P - r.tip0_P) {
    const double length2 = chord_.squaredNorm();
    per_length2_ = length2 > 0.0 ? 1.0 / length2 : 0.0;
    a_ = foot(a.tip_P - r.tip0_P);
    b_ = foot(b.tip_P - r.tip0_P);
    m_ = foot(middle_P - r.tip0_P);
  }
  /// Largest squared distance of the ends and of the middle: not above the truth but for rounding.
  double largest_sample2() const { return std::max({distance2(a_), distance2(b_), distance2(m_)}); }

  /// Largest distance of the parabola.
  double largest() const {
    const double along = bow_.dot(chord_) * per_length2_;
    const Vec3 across = bow_ - along * chord_;
    const double size2 = across.squaredNorm();
    // Across the chord, along the bow: -x (1 - t) - y t + 4 c t (1 - t), and what the ends are off beside it.
    double reach = 0.0;
    double beside2 = 0.0;
    if (size2 > 0.0) {
      const double size = std::sqrt(size2);
      const double x = a_.across.dot(across) / size;
      const double y = b_.across.dot(across) / size;
      reach = std::max({largest_bowed(x, y, size), -x, -y});
      beside2 = std::max(a_.across.squaredNorm() - x * x, b_.across.squaredNorm() - y * y);
    } else {
      reach = std::sqrt(std::max(a_.across.squaredNorm(), b_.across.squaredNorm()));
    }
    const double over = std::max({0.0, largest_bowed(-a_.along, -b_.along, std::abs(along)),
                                  largest_bowed(a_.along - 1.0, b_.along - 1.0, std::abs(along))});
    const double across2 = reach * reach + std::max(0.0, beside2);
    if (over == 0.0) return std::sqrt(across2);
    const double ends = std::sqrt(std::max(distance2(a_), distance2(b_)));
    return std::min(std::sqrt(across2 + over * over / per_length2_), ends + bow_.norm());
  }

 private:
  struct Foot {
    Vec3 across;
    double along = 0.0;  // in lengths of the chord
  };
  Foot foot(const Vec3& v) const {
    const double along = v.dot(chord_) * per_length2_;
    return {v - along * chord_, along};
  }
  double distance2(const Foot& f) const {
    const double over = std::max({0.0, -f.along, f.along - 1.0});
    return f.across.squaredNorm() + (over > 0.0 ? over * over / per_length2_ : 0.0);
  }

  Vec3 bow_, chord_;
  double per_length2_ = 0.0;
  Foot a_, b_, m_;
};

/// Largest of |(1/4 - s^2)(f2/2 + s f3/6)| over |s| <= 1/2: f3 split along f2 (closed maximum) and across it.
inline double largest_of_cubic(const Vec3& f2, const Vec3& f3) {
  const double A = 0.5 * f2.norm();
  const double along = A > 0.0 ? std::abs(f3.dot(f2)) / (12.0 * A) : f3.norm() / 6.0;
  const double across2 = std::max(0.0, f3.squaredNorm() - 36.0 * along * along);
  double s = 0.0;
  if (along > 0.0) s = 0.25 * along / (A + std::sqrt(A * A + 0.75 * along * along));
  const double in_line = (0.25 - s * s) * (A + along * s);
  // (1/4 - s^2) s is at most 1 / (12 sqrt 3); 36 * 432 = 15552.
  return std::sqrt(in_line * in_line + across2 / 15552.0);
}

/// Distance of the curve from its chord: across the chord, and what it may overshoot its ends by.
inline double cubic_bow(const TableKinematics& k, const Station& a, const Station& b) {
  const Curve curve = tip_curve(k, a, b);
  const Expansion e = expand(curve);
  const double remainder = e.M4 / 384.0;
  const Vec3 chord = k.turn(1, b.tip_P - a.tip_P, curve.mid);
  const double length = chord.norm();
  const double whole = largest_of_cubic(e.f2, e.f3) + remainder;
  if (!(length > 0.0)) return whole;
  const Vec3 unit = chord / length;
  const double f2_along = e.f2.dot(unit);
  const double f3_along = e.f3.dot(unit);
  const double G = 0.5 * std::abs(f2_along) + std::abs(f3_along) / 12.0 + e.M4 / 48.0;
  const double overshoot = G > length ? (G - length) * (G - length) / (4.0 * G) : 0.0;
  const double across = largest_of_cubic(e.f2 - f2_along * unit, e.f3 - f3_along * unit) + remainder;
  return std::min(whole, std::hypot(across, overshoot));
}

}  // namespace trunnion::path
