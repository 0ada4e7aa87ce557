#include "trunnion/post/plane_frame.hpp"

#include <cmath>

namespace trunnion::post {
namespace {

Mat3 about(int axis, double rad) {
  return rotation_about(Vec3::Unit(axis), Angle::radians(rad));
}

// sine of the middle angle (its cosine for the others) below which the outer two turn about one line.
constexpr double kOneLine = 1e-12;

}  // namespace

Mat3 plane_axes(nc::PlaneAngles convention, const std::array<double, 3>& angles_rad) {
  const auto& [a, b, c] = angles_rad;
  switch (convention) {
    case nc::PlaneAngles::euler_zxz:
      return about(2, a) * about(0, b) * about(2, c);
    case nc::PlaneAngles::euler_xyz:
      return about(0, a) * about(1, b) * about(2, c);
    case nc::PlaneAngles::fixed_xyz:
      break;
  }
  return about(2, c) * about(1, b) * about(0, a);
}

std::array<double, 3> plane_angles(nc::PlaneAngles convention, const Mat3& R) {
  if (convention == nc::PlaneAngles::euler_zxz) {
    const double sine = std::hypot(R(0, 2), R(1, 2));
    const double b = std::atan2(sine, R(2, 2));
    if (sine < kOneLine) return {std::atan2(R(1, 0), R(0, 0)), b, 0.0};
    return {std::atan2(R(0, 2), -R(1, 2)), b, std::atan2(R(2, 0), R(2, 1))};
  }
  if (convention == nc::PlaneAngles::euler_xyz) {
    const double cosine = std::hypot(R(0, 0), R(0, 1));
    const double b = std::atan2(R(0, 2), cosine);
    if (cosine < kOneLine) return {std::atan2(R(2, 1), R(1, 1)), b, 0.0};
    return {std::atan2(-R(1, 2), R(2, 2)), b, std::atan2(-R(0, 1), R(0, 0))};
  }
  const double cosine = std::hypot(R(0, 0), R(1, 0));
  const double b = std::atan2(-R(2, 0), cosine);
  if (cosine < kOneLine) return {std::atan2(-R(1, 2), R(1, 1)), b, 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), b, std::atan2(R(1, 0), R(0, 0))};
}

PlaneFrame PlaneFrame::of(const nc::Controller& controller, const Pose& X_PF, const Vec3& zero,
                          nc::TiltedPlane& block) {
  const nc::AxisFormat& format = controller.numbers.axes;
  const auto angles = plane_angles(controller.tilted_plane.angles, X_PF.R);
  const Vec3 origin = X_PF.p + zero;
  block.on = true;
  for (std::size_t i = 0; i < 3; ++i) {
    block.origin[i] = format.quanta(nc::AxisLetter::X, origin[static_cast<Eigen::Index>(i)]);
    block.angles[i] = format.quanta(nc::AxisLetter::A, angles[i]);
  }
  return of(controller, block, zero);
}

PlaneFrame PlaneFrame::of(const nc::Controller& controller, const nc::TiltedPlane& block, const Vec3& zero) {
  const nc::AxisFormat& format = controller.numbers.axes;
  std::array<double, 3> angles{};
  PlaneFrame out;
  for (std::size_t i = 0; i < 3; ++i) {
    angles[i] = format.internal(nc::AxisLetter::A, block.angles[i]);
    out.X_PF.p[static_cast<Eigen::Index>(i)] = format.internal(nc::AxisLetter::X, block.origin[i]);
  }
  out.X_PF.p -= zero;
  out.X_PF.R = plane_axes(controller.tilted_plane.angles, angles);
  return out;
}

}  // namespace trunnion::post
