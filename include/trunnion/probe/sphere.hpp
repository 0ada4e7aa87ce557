#pragma once
#include <optional>
#include <vector>

#include "trunnion/geom/vec.hpp"

namespace trunnion::probe {

/// A sphere through centres of the stylus: the ball's centre, and the effective radius (ball and stylus ball,
/// less what the probe travels before it says so).
struct Sphere {
  Vec3 center_mm = Vec3::Zero();
  double radius_mm = 0.0;
  /// Distance of each point from the centre less the radius, mm.
  std::vector<double> residuals_mm;
  /// Inverse of the normal matrix: times the variance of a point's distance, the covariance of the centre.
  Mat3 center_cofactor = Mat3::Zero();
};

/// The sphere of the algebraic equation |p|^2 = 2 c.p + k by least squares: where `fit_sphere` begins, and
/// what controls' cycles print.
struct AlgebraicSphere {
  Vec3 center_mm = Vec3::Zero();
  double radius_mm = 0.0;
};
std::optional<AlgebraicSphere> algebraic_sphere(const std::vector<Vec3>& points_mm);

/// Least squares of the distances (not of the algebraic equation), Gauss-Newton. With `radius_mm` the radius
/// is held, and three points suffice; else it is fitted, from four.
/// @return nothing where the points do not fix a sphere: too few, or (nearly) in one plane, or on a line.
std::optional<Sphere> fit_sphere(const std::vector<Vec3>& points_mm,
                                 std::optional<double> radius_mm = std::nullopt);

/// The same sphere radius for several sets of points, each with a centre of its own: least squares over all.
/// @return nothing where a set does not fix its centre.
struct CommonSpheres {
  double radius_mm = 0.0;
  std::vector<Sphere> spheres;
};
std::optional<CommonSpheres> fit_common_radius(const std::vector<std::vector<Vec3>>& sets_mm);

}  // namespace trunnion::probe
