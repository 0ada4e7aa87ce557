#include "trunnion/geom/pose.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "trunnion/geom/small_arc.hpp"

namespace trunnion {
namespace {

struct SinCos {
  double sin;
  double cos;
};

// sin and cos of multiples of pi/2 are 0 and +-1, not 6e-17: a program at C90 must not show a trace of it.
SinCos exact_at_right_angles(double rad) {
  const double quarter_turns = rad / (0.5 * kPi);
  const double whole = std::nearbyint(quarter_turns);
  if (std::abs(quarter_turns - whole) > 1e-15 * std::max(1.0, std::abs(whole)))
    return {std::sin(rad), std::cos(rad)};
  switch (static_cast<long long>(std::fmod(whole, 4.0) + 4.0) % 4) {
    case 0:
      return {0.0, 1.0};
    case 1:
      return {1.0, 0.0};
    case 2:
      return {0.0, -1.0};
    default:
      return {-1.0, 0.0};
  }
}

// sin(x)/x, (1-cos x)/x^2 and (x-sin x)/x^3 for the exponential; series below 1e-2, where the closed forms
// lose digits (the first term left out is below 1e-17 there).
struct ExpCoefficients {
  double a, b, c;
};

ExpCoefficients exp_coefficients(double x) {
  const double x2 = x * x;
  if (x < 1e-2) {
    return {1.0 - x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0)),
            0.5 - x2 / 24.0 * (1.0 - x2 / 30.0 * (1.0 - x2 / 56.0)),
            1.0 / 6.0 - x2 / 120.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0))};
  }
  return {std::sin(x) / x, (1.0 - std::cos(x)) / x2, (x - std::sin(x)) / (x2 * x)};
}

}  // namespace

Mat3 rotation_about(const Vec3& axis, Angle angle) {
  const auto [s, c] = exact_at_right_angles(angle.rad());
  return c * Mat3::Identity() + s * cross_matrix(axis) + (1.0 - c) * axis * axis.transpose();
}

Pose Pose::rotation(const Vec3& axis, const Vec3& point, Angle angle) {
  const Mat3 R = rotation_about(axis, angle);
  return {R, point - R * point};
}

Pose exp(const Twist& twist) {
  const Mat3 K = cross_matrix(twist.rot_rad);
  const Mat3 K2 = K * K;
  const auto [a, b, c] = exp_coefficients(twist.rot_rad.norm());
  const Mat3 identity = Mat3::Identity();
  return {identity + a * K + b * K2, (identity + b * K + c * K2) * twist.trans_mm};
}

Vec3 rotation_vector(const Mat3& R) {
  const Eigen::Quaterniond q(R);
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sin_half = q.vec().norm();
  const double angle = 2.0 * std::atan2(sin_half, sign * q.w());
  // Below 1e-8 the factor angle / sin(angle/2) is 2 to the last bit.
  const double factor = sin_half < 1e-8 ? 2.0 : angle / sin_half;
  return sign * factor * q.vec();
}

Angle angle_between(const Vec3& a, const Vec3& b) {
  const double sine = a.cross(b).norm();
  const double cosine = a.dot(b);
  // The series of the arc tangent where its first term left out is below 1e-17 of the angle.
  constexpr double kSeries = 5e-2;
  if (sine < kSeries * cosine) {
    const double r = sine / cosine;
    const double r2 = r * r;
    const double tail = 1.0 / 7.0 - r2 * (1.0 / 9.0 - r2 * (1.0 / 11.0 - r2 / 13.0));
    return Angle::radians(r * (1.0 - r2 * (1.0 / 3.0 - r2 * (1.0 / 5.0 - r2 * tail))));
  }
  return Angle::radians(std::atan2(sine, cosine));
}

Vec3 from_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((point - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return point - a - t * d;
}

double distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  return from_segment(point, a, b).norm();
}

Vec3 slerp(const Vec3& u0, const Vec3& u1, double t) {
  const auto triple = [](const Vec3& v) { return lanes::Triple<double>{v.x(), v.y(), v.z()}; };
  const SmallArc<double> arc(triple(u0), triple(u1));
  if (arc.holds()) {
    const lanes::Triple<double> u = arc.at(t);
    return {u.x, u.y, u.z};
  }
  const double omega = angle_between(u0, u1).rad();
  const double s = std::sin(omega);
  if (s < 1e-12) return t < 0.5 ? u0 : u1;  // equal (to 1e-12) or antipodal: no plane to turn in
  return ((std::sin((1.0 - t) * omega) * u0 + std::sin(t * omega) * u1) / s).normalized();
}

}  // namespace trunnion
