#include <Eigen/Core>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "trunnion/geom/linear_algebra.hpp"
#include "trunnion/thermal/statistics.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double two_sided_p(double t, long dof) {
  if (!std::isfinite(t)) return 0.0;
  return 2.0 * cdf(complement(boost::math::students_t(static_cast<double>(dof)), std::abs(t)));
}

// Columns without their mean, of unit length; a constant column stays zero.
MatrixXd standardised(const MatrixXd& X) {
  MatrixXd Z = X.rowwise() - X.colwise().mean();
  for (Eigen::Index j = 0; j < Z.cols(); ++j) {
    const double length = Z.col(j).norm();
    if (length > 0.0) Z.col(j) /= length;
  }
  return Z;
}

}  // namespace

Result<Regression> regress(const MatrixXd& X, const VectorXd& y) {
  const Eigen::Index n = X.rows();
  const Eigen::Index columns = X.cols() + 1;
  if (n <= columns) {
    return fail(ErrorCode::wrong_input, "regression of " + std::to_string(n) + " measurements on " +
                                            std::to_string(columns - 1) +
                                            " regressors and a constant leaves no degrees of freedom");
  }
  // Centred and scaled columns: the same fit, without the loss of digits of large offsets.
  const Eigen::RowVectorXd mean = X.colwise().mean();
  MatrixXd Z = X.rowwise() - mean;
  const VectorXd scale = Z.colwise().norm().transpose();
  if (const auto constant = X.cols() - (scale.array() > 0.0).count(); constant > 0) {
    return fail(ErrorCode::wrong_input, std::to_string(constant) + " of " + std::to_string(X.cols()) +
                                            " inputs are constant in this data");
  }
  Z = Z * scale.cwiseInverse().asDiagonal();
  const LeastSquares qr(Z);
  if (qr.rank() < Z.cols()) return fail(ErrorCode::wrong_input, "the regressors are linearly dependent");
  const double y_mean = y.mean();
  const VectorXd centred = y.array() - y_mean;
  const VectorXd w = qr.solve(centred);
  const VectorXd residual = centred - Z * w;
  Regression out;
  out.degrees_of_freedom = n - columns;
  out.residual_sd = std::sqrt(residual.squaredNorm() / static_cast<double>(out.degrees_of_freedom));
  out.weight = w.cwiseQuotient(scale);
  out.intercept = y_mean - mean.dot(out.weight);
  const MatrixXd covariance =
      scale.cwiseInverse().asDiagonal() * qr.cofactor() * scale.cwiseInverse().asDiagonal();
  out.standard_error = out.residual_sd * covariance.diagonal().cwiseSqrt();
  out.intercept_standard_error =
      out.residual_sd * std::sqrt(1.0 / static_cast<double>(n) + mean * covariance * mean.transpose());
  out.p.resize(X.cols());
  for (Eigen::Index j = 0; j < X.cols(); ++j) {
    out.p[j] = two_sided_p(out.weight[j] / out.standard_error[j], out.degrees_of_freedom);
  }
  return out;
}

VectorXd variance_inflation(const MatrixXd& X) {
  const MatrixXd Z = standardised(X);
  VectorXd out(X.cols());
  for (Eigen::Index j = 0; j < X.cols(); ++j) {
    MatrixXd others(Z.rows(), Z.cols() - 1);
    others << Z.leftCols(j), Z.rightCols(Z.cols() - 1 - j);
    double left = 1.0;
    if (others.cols() > 0) {
      const VectorXd fit = others * shortest_least_squares(others, Z.col(j));
      left = (Z.col(j) - fit).squaredNorm();
    }
    // Rounding leaves about 1e-30 of a column that is a combination of the others.
    out[j] = left > 1e-24 ? 1.0 / left : std::numeric_limits<double>::infinity();
  }
  return out;
}

double condition_number(const MatrixXd& X) {
  if (X.cols() == 0) return 1.0;
  const VectorXd s = singular_values(standardised(X));
  const double smallest = X.rows() < X.cols() ? 0.0 : s[s.size() - 1];
  return smallest > s[0] * 1e-15 ? s[0] / smallest : std::numeric_limits<double>::infinity();
}

}  // namespace trunnion::thermal
