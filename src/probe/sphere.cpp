#include "trunnion/probe/sphere.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::probe {
namespace {

constexpr int kMostSphereSteps = 60;
// Smallest over largest singular value of the directions (with a column of ones for the radius) below which
// the points fix no sphere: a cap of less than 3 degrees.
constexpr double kFlat = 1e-3;

// Directions from the centre, and 1 for the radius where it is free: the distances' derivatives, up to a
// sign.
Eigen::MatrixXd directions(const std::vector<Vec3>& points, const Vec3& center, bool radius_is_free) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(points.size()), radius_is_free ? 4 : 3);
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const Vec3 d = points[static_cast<std::size_t>(i)] - center;
    out.row(i).head<3>() = d.transpose() / std::max(d.norm(), 1e-300);
    if (radius_is_free) out(i, 3) = 1.0;
  }
  return out;
}

}  // namespace

std::optional<AlgebraicSphere> algebraic_sphere(const std::vector<Vec3>& points) {
  if (points.size() < 3) return std::nullopt;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 4);
  Eigen::VectorXd right(rows.rows());
  double scale = 0.0;
  for (const Vec3& p : points) scale = std::max(scale, (p - mean).norm());
  if (!(scale > 0.0)) return std::nullopt;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Vec3 p = (points[static_cast<std::size_t>(i)] - mean) / scale;
    rows.row(i) << 2.0 * p.transpose(), 1.0;
    right[i] = p.squaredNorm();
  }
  const Eigen::Vector4d x = shortest_least_squares(rows, right);
  const Vec3 center = x.head<3>();
  return AlgebraicSphere{mean + scale * center,
                         scale * std::sqrt(std::max(0.0, x[3] + center.squaredNorm()))};
}

std::optional<Sphere> fit_sphere(const std::vector<Vec3>& points, std::optional<double> radius_mm) {
  const std::size_t least = radius_mm ? 3 : 4;
  if (points.size() < least) return std::nullopt;
  const auto start = algebraic_sphere(points);
  if (!start) return std::nullopt;
  Vec3 center = start->center_mm;
  double radius = radius_mm.value_or(start->radius_mm);
  Eigen::VectorXd residual(static_cast<Eigen::Index>(points.size()));
  for (int step = 0;; ++step) {
    const Eigen::MatrixXd n = directions(points, center, !radius_mm);
    for (Eigen::Index i = 0; i < residual.size(); ++i)
      residual[i] = (points[static_cast<std::size_t>(i)] - center).norm() - radius;
    const Svd svd = thin_svd(n);
    const VectorXd& s = svd.s;
    if (!(s[s.size() - 1] > kFlat * s[0])) return std::nullopt;
    const Eigen::VectorXd by = svd.solve(residual);
    center += by.head<3>();
    if (!radius_mm) radius += by[3];
    if (!center.allFinite()) return std::nullopt;
    const double smallest = 1e-13 * (center.norm() + radius);
    if (by.norm() > smallest && step < kMostSphereSteps) continue;
    Sphere out;
    out.center_mm = center;
    out.radius_mm = radius;
    for (const Vec3& p : points) out.residuals_mm.push_back((p - center).norm() - radius);
    const Eigen::MatrixXd last = directions(points, center, !radius_mm);
    out.center_cofactor = inverse_of(last.transpose() * last).topLeftCorner<3, 3>();
    return out;
  }
}

// Given the radius each centre is a fit of its own, so that the sum of squares is a function of the radius
// alone: its Gauss-Newton step is the mean residual, weighted by what the centre leaves of it.
std::optional<CommonSpheres> fit_common_radius(const std::vector<std::vector<Vec3>>& sets_mm) {
  CommonSpheres out;
  double sum = 0.0;
  std::size_t count = 0;
  for (const auto& set : sets_mm) {
    const auto free = fit_sphere(set);
    if (!free) return std::nullopt;
    sum += free->radius_mm;
    ++count;
  }
  if (count == 0) return std::nullopt;
  out.radius_mm = sum / static_cast<double>(count);
  for (int step = 0; step < kMostSphereSteps; ++step) {
    out.spheres.clear();
    double right = 0.0, left = 0.0;
    for (const auto& set : sets_mm) {
      const auto one = fit_sphere(set, out.radius_mm);
      if (!one) return std::nullopt;
      const Eigen::MatrixXd n = directions(set, one->center_mm, false);
      const Eigen::VectorXd ones = Eigen::VectorXd::Ones(n.rows());
      const Eigen::VectorXd across = ones - n * one->center_cofactor * (n.transpose() * ones);
      const Eigen::Map<const Eigen::VectorXd> r(one->residuals_mm.data(), n.rows());
      right += across.dot(r);
      left += across.squaredNorm();
      out.spheres.push_back(*one);
    }
    if (!(left > 0.0)) return std::nullopt;
    const double by = right / left;
    if (std::abs(by) < 1e-12 * out.radius_mm) return out;
    out.radius_mm += by;
  }
  return out;
}

}  // namespace trunnion::probe
