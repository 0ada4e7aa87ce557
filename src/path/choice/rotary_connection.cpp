#include "path/choice/rotary_connection.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {
namespace {

// Half a turn, and the rounding of an angle.
constexpr double kHalfTurn = kPi * (1.0 + 1e-9);
// Of the tolerance of the tool axis: below what inserted points lead through the pole, who have rounded
// words.
constexpr double kShare = 0.2;
/// Angle about `n` from the part of a across it to that of b, in (-pi, pi].
double turn_about(const Vec3& n, const Vec3& a, const Vec3& b) {
  return std::atan2(n.dot(a.cross(b)), a.dot(b) - n.dot(a) * n.dot(b));
}

}  // namespace

RotaryConnection::RotaryConnection(const TableKinematics& kinematics, Angle tolerance)
    : kinematics_(kinematics),
      tolerance_rad_(kShare * tolerance.rad()),
      // At the largest tilt it changes with the square of this distance.
      fold_rad_(std::sqrt(tolerance_rad_)) {
  if (kinematics.rotary_count() == 2)
    m_ = kinematics.direction(0).cross(kinematics.direction(1)).normalized();
}

Vec3 RotaryConnection::v(double outer) const {
  RotarySines s;
  s.sin[0] = std::sin(outer);
  s.cos[0] = std::cos(outer);
  return kinematics_.turn_back(0, kinematics_.spindle(), s);
}

bool RotaryConnection::passes_pole(const Vec3& axis_a_P, const Vec3& axis_b_P) const {
  const Vec3& n = kinematics_.direction(1);
  const double near = std::sin(tolerance_rad_);
  if (std::min(n.cross(axis_a_P).norm(), n.cross(axis_b_P).norm()) <= near) return true;
  const Vec3 normal = axis_a_P.cross(axis_b_P);
  constexpr double kSameAxis = 1e-9;  // below it the normal is rounding, and there is no way but the ends
  if (normal.norm() < kSameAxis && axis_a_P.dot(axis_b_P) > 0.0) return false;
  const Vec3 pole = axis_a_P.dot(n) + axis_b_P.dot(n) >= 0.0 ? n : Vec3(-n);
  const bool between = axis_a_P.cross(pole).dot(normal) >= 0.0 && pole.cross(axis_b_P).dot(normal) >= 0.0;
  return between && std::abs(normal.dot(pole)) <= near * normal.norm();
}

bool RotaryConnection::one_branch(const Vec3& v_a, const Vec3& v_b) const {
  const double a = m_.dot(v_a);
  const double b = m_.dot(v_b);
  if (a * b > 0.0) return true;
  const Vec3& n = kinematics_.direction(1);
  const auto at_fold = [&](double distance, const Vec3& at) {
    constexpr double kFarFromPole = 4.0;
    return std::abs(distance) <= fold_rad_ && n.cross(at).norm() > kFarFromPole * std::abs(distance);
  };
  return at_fold(a, v_a) || at_fold(b, v_b);
}

bool RotaryConnection::connects(const Angles& a, const Vec3& axis_a_P, const Angles& b,
                                const Vec3& axis_b_P) const {
  const std::size_t count = kinematics_.rotary_count();
  for (std::size_t k = 0; k < std::min<std::size_t>(count, 1); ++k) {
    if (std::abs(b[k] - a[k]) > kHalfTurn) return false;
  }
  if (count < 2) return true;
  const double turn = b[1] - a[1];
  if (passes_pole(axis_a_P, axis_b_P)) return std::abs(turn) <= kHalfTurn;
  const auto followed = followed_turn(a, axis_a_P, b[0], axis_b_P);
  return followed && std::abs(turn - *followed) < kSameTurn;
}

std::optional<double> RotaryConnection::followed_turn(const Angles& a, const Vec3& axis_a_P, double outer_b,
                                                      const Vec3& axis_b_P) const {
  const Vec3 v_a = v(a[0]);
  const Vec3 v_b = v(outer_b);
  if (!one_branch(v_a, v_b)) return std::nullopt;
  const Vec3& n = kinematics_.direction(1);
  return turn_about(n, v_a, v_b) - turn_about(n, axis_a_P, axis_b_P);
}

bool RotaryConnection::connects(const JointVector& a, const Vec3& axis_a_P, const JointVector& b,
                                const Vec3& axis_b_P) const {
  return connects(Angles{kinematics_.angle(a, 0), kinematics_.angle(a, 1)}, axis_a_P,
                  Angles{kinematics_.angle(b, 0), kinematics_.angle(b, 1)}, axis_b_P);
}

}  // namespace trunnion::path
