#include "probe/small_errors.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::probe {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr std::array kFactors = {0.7, 0.85, 1.0, 1.2, 1.5, 2.2, 4.0, 12.0};
constexpr std::array kLinear_um = {0.0, 0.3, 0.6, 1.2, 2.5, 5.0, 10.0, 25.0};
constexpr std::array kRotary_um = {0.0, 0.6, 2.5, 10.0};
// The readings have to speak for small errors by a thousand to one: with even odds the sigmas of machines
// that have none come out twice too large (README, "Uncertainty").
constexpr double kOddsOfNone = 1000.0;
// Beyond this many readings the matrices take longer than anybody waits; the scatter alone is looked at.
constexpr Eigen::Index kMostReadings = 400;

struct Case {
  double log_weight = 0.0;
  Vector x;
  Matrix covariance;
};

Case solve(const LinearFit& fit, const Matrix& V) {
  Case out;
  const Cholesky noise(V);
  const Matrix white_J = noise.solve_lower_all(fit.J);
  const Vector white_r = noise.solve_lower(fit.residuals);
  const Matrix normal = white_J.transpose() * white_J + Matrix(fit.precision.asDiagonal());
  const Vector right = white_J.transpose() * white_r + fit.precision.cwiseProduct(fit.expected);
  const Cholesky parts(normal);
  out.x = parts.solve(right);
  out.covariance = parts.solve_all(Matrix::Identity(normal.rows(), normal.cols()));
  const double fits =
      white_r.squaredNorm() + fit.expected.dot(fit.precision.cwiseProduct(fit.expected)) - right.dot(out.x);
  out.log_weight = -(noise.log_determinant_of_lower() + parts.log_determinant_of_lower() + 0.5 * fits);
  if (!std::isfinite(out.log_weight)) out.log_weight = -std::numeric_limits<double>::infinity();
  return out;
}

}  // namespace

Averaged average(const LinearFit& fit, const SmallErrors& errors) {
  const Matrix own = fit.u.cwiseAbs2().asDiagonal();
  const bool few = fit.residuals.size() <= kMostReadings;
  std::vector<Case> cases;
  for (const double factor : kFactors) {
    for (const double linear_um : kLinear_um) {
      for (std::size_t length = 0; length < (linear_um > 0.0 ? errors.of_linear_axes.size() : 1); ++length) {
        for (const double rotary_um : kRotary_um) {
          if (!few && (linear_um > 0.0 || rotary_um > 0.0)) continue;
          Matrix V = factor * factor * own;
          if (linear_um > 0.0) V += std::pow(linear_um * kMmPerUm, 2) * errors.of_linear_axes[length];
          if (rotary_um > 0.0) V += std::pow(rotary_um * kMmPerUm, 2) * errors.of_rotary_axes;
          Case one = solve(fit, V);
          // Each size has the same weight beforehand, whatever the number of lengths.
          if (linear_um > 0.0) one.log_weight -= std::log(static_cast<double>(errors.of_linear_axes.size()));
          if (linear_um == 0.0) one.log_weight += std::log(kOddsOfNone);
          if (rotary_um == 0.0) one.log_weight += std::log(kOddsOfNone);
          cases.push_back(std::move(one));
        }
      }
    }
  }
  double most = -std::numeric_limits<double>::infinity();
  for (const Case& one : cases) most = std::max(most, one.log_weight);
  Averaged out;
  out.x = Vector::Zero(fit.J.cols());
  out.covariance = Matrix::Zero(fit.J.cols(), fit.J.cols());
  double sum = 0.0;
  for (Case& one : cases) {
    one.log_weight = std::exp(one.log_weight - most);  // from here on the weight
    sum += one.log_weight;
  }
  for (const Case& one : cases) {
    const double weight = one.log_weight / sum;
    out.x += weight * one.x;
  }
  for (const Case& one : cases) {
    const Vector apart = one.x - out.x;
    out.covariance += one.log_weight / sum * (one.covariance + apart * apart.transpose());
  }
  return out;
}

}  // namespace trunnion::probe
