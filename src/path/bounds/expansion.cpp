#include "path/bounds/expansion.hpp"

#include <algorithm>
#include <cmath>

#include "path/bounds/side_by_side.hpp"

namespace trunnion::path {
namespace {

Curve turning(const TableKinematics& kinematics, const Station& a, const Station& b) {
  Curve c;
  c.kinematics = &kinematics;
  c.al = kinematics.angle(b.q, 0) - kinematics.angle(a.q, 0);
  c.ga = kinematics.angle(b.q, 1) - kinematics.angle(a.q, 1);
  c.mid = middle_sines(kinematics, a, b);
  return c;
}

}  // namespace

TableKinematics::Sines middle_sines(const TableKinematics& kinematics, const Station& a, const Station& b) {
  TableKinematics::Sines mid;
  for (std::size_t k = 0; k < kinematics.rotary_count(); ++k) {
    const double from = kinematics.angle(a.q, k);
    const double turn = kinematics.angle(b.q, k) - from;
    if (std::abs(turn) < kBisectorTurn) {
      const double sin = a.sines.sin[k] + b.sines.sin[k];
      const double cos = a.sines.cos[k] + b.sines.cos[k];
      const double scale = 1.0 / std::sqrt(sin * sin + cos * cos);
      mid.sin[k] = sin * scale;
      mid.cos[k] = cos * scale;
    } else {
      mid.sin[k] = std::sin(from + 0.5 * turn);
      mid.cos[k] = std::cos(from + 0.5 * turn);
    }
  }
  return mid;
}

Curve tip_curve(const TableKinematics& kinematics, const Station& a, const Station& b) {
  Curve c = turning(kinematics, a, b);
  c.r = kinematics.turn_back(0, 0.5 * (a.w + b.w), c.mid);
  c.d = kinematics.turn_back(0, b.w - a.w, c.mid);
  const Vec3 b0 = kinematics.b(a.q);
  if (kinematics.linear_axes_first()) {
    c.b = b0;
    c.d1 = Vec3::Zero();
  } else {
    const Vec3 b1 = kinematics.b(b.q);
    c.b = 0.5 * (b0 + b1);
    c.d1 = b1 - b0;
  }
  return c;
}

Curve axis_curve(const TableKinematics& kinematics, const Station& a, const Station& b) {
  Curve c = turning(kinematics, a, b);
  c.r = kinematics.turn_back(0, kinematics.spindle(), c.mid);
  c.d = c.b = c.d1 = Vec3::Zero();
  return c;
}

// u(s) = exp(-s al K0)(r + s d) + b + s d1 and its derivatives in the middle; K^3 = -K, K^4 = -K^2. The
// bounds hold on all of the piece: a rotation keeps norms, |K v| <= |v|, and |K0 (r + s d)| <= |K0 r| + |K0
// d| / 2.
Expansion expand(const Curve& c) {
  const Vec3& n0 = c.kinematics->direction(0);
  const Vec3& n1 = c.kinematics->direction(1);
  const double al = c.al;
  const double al2 = al * al;
  const double ga = c.ga;
  const double ga2 = ga * ga;
  const Vec3 Kr = n0.cross(c.r);
  const Vec3 KKr = n0.cross(Kr);
  const Vec3 Kd = n0.cross(c.d);
  const Vec3 KKd = n0.cross(Kd);
  const Vec3 u0 = c.r + c.b;
  const Vec3 u1 = c.d - al * Kr + c.d1;
  const Vec3 u2 = al2 * KKr - (2.0 * al) * Kd;
  const Vec3 u3 = (3.0 * al2) * KKd + (al2 * al) * Kr;
  const Vec3 u4 = (4.0 * al2 * al) * Kd - (al2 * al2) * KKr;
  const Vec3 Ku0 = n1.cross(u0);
  const Vec3 KKu0 = n1.cross(Ku0);
  const Vec3 Ku1 = n1.cross(u1);
  const Vec3 KKu1 = n1.cross(Ku1);
  const Vec3 Ku2 = n1.cross(u2);
  const Vec3 KKu2 = n1.cross(Ku2);
  Expansion e;
  e.f2 = u2 - (2.0 * ga) * Ku1 + ga2 * KKu0;
  e.f3 = u3 - (3.0 * ga) * Ku2 + (3.0 * ga2) * KKu1 + (ga2 * ga) * Ku0;
  e.f4 = u4 - (4.0 * ga) * n1.cross(u3) + (6.0 * ga2) * KKu2 + (4.0 * ga2 * ga) * Ku1 - (ga2 * ga2) * KKu0;

  const double a = std::abs(al);
  const double g = std::abs(ga);
  const double D = Kd.norm();
  const double rho = Kr.norm() + 0.5 * D;
  const double U5 = al2 * al2 * (5.0 * D + a * rho);
  const double U4 = al2 * a * (4.0 * D + a * rho);
  const double U3 = std::min(al2 * (3.0 * D + a * rho), u3.norm() + 0.5 * U4);
  const double U2 = std::min(a * (2.0 * D + a * rho), u2.norm() + 0.5 * U3);
  const double U1 = u1.norm() + 0.5 * U2;
  const double sig = Ku0.norm() + 0.5 * U1;
  e.M4 = ga2 * ga2 * sig + 4.0 * ga2 * g * U1 + 6.0 * ga2 * U2 + 4.0 * g * U3 + U4;
  e.M5 = ga2 * ga2 * (g * sig + 5.0 * U1) + 10.0 * ga2 * (g * U2 + U3) + 5.0 * g * U4 + U5;
  return e;
}

Expansion expand_in_part(const Curve& curve) {
  Expansion e = expand(curve);
  e.f2 = curve.kinematics->turn_back(1, e.f2, curve.mid);
  e.f3 = curve.kinematics->turn_back(1, e.f3, curve.mid);
  e.f4 = curve.kinematics->turn_back(1, e.f4, curve.mid);
  return e;
}

Vec3 tip_slope(const TableKinematics& kinematics, const Station& at, const JointVector& q0,
               const JointVector& q1) {
  const double al = kinematics.angle(q1, 0) - kinematics.angle(q0, 0);
  const double ga = kinematics.angle(q1, 1) - kinematics.angle(q0, 1);
  const Vec3 r = kinematics.turn_back(0, kinematics.w(at.q), at.sines);
  const Vec3 d = kinematics.turn_back(0, kinematics.w(q1) - kinematics.w(q0), at.sines);
  const Vec3 u0 = r + kinematics.b(at.q);
  const Vec3 u1 = d - al * kinematics.direction(0).cross(r) + (kinematics.b(q1) - kinematics.b(q0));
  const Vec3 f1 = u1 - ga * kinematics.direction(1).cross(u0);
  return kinematics.turn_back(1, f1, at.sines) + (kinematics.g(q1) - kinematics.g(q0));
}

Vec3 axis_slope(const TableKinematics& kinematics, const Station& at, const JointVector& q0,
                const JointVector& q1) {
  const double al = kinematics.angle(q1, 0) - kinematics.angle(q0, 0);
  const double ga = kinematics.angle(q1, 1) - kinematics.angle(q0, 1);
  const Vec3 r = kinematics.turn_back(0, kinematics.spindle(), at.sines);
  const Vec3 f1 = -al * kinematics.direction(0).cross(r) - ga * kinematics.direction(1).cross(r);
  return kinematics.turn_back(1, f1, at.sines);
}

}  // namespace trunnion::path
