#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::thermal {

struct ShapiroWilk {
  double W = 0.0;
  double p = 0.0;
};

/// Shapiro-Wilk test of normality for 3 <= n <= 5000 (P. Royston, Algorithm AS R94, Appl. Stat. 44 (1995)
/// 547-551). Fails for other n, for values that are not finite and for values that are all the same. What it
/// says of temperatures: see README ("Screening").
Result<ShapiroWilk> shapiro_wilk(std::span<const double> values);

/// Multiple linear regression y = b + X w by ordinary least squares.
struct Regression {
  double intercept = 0.0;
  Eigen::VectorXd weight;
  Eigen::VectorXd p;  // two-sided, Student's t: is the weight zero?
  Eigen::VectorXd standard_error;
  double intercept_standard_error = 0.0;
  double residual_sd = 0.0;
  long degrees_of_freedom = 0;
};

/// Fails (wrong_input) when there are no spare degrees of freedom or the columns are linearly dependent:
/// p-values do not exist there.
Result<Regression> regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y);

/// Variance inflation factor of each column: 1 / (1 - R^2) of its regression on the others; infinite when it
/// is a combination of them.
Eigen::VectorXd variance_inflation(const Eigen::MatrixXd& X);
/// Ratio of the largest to the smallest singular value of the centred columns of unit length; infinite when
/// they are dependent.
double condition_number(const Eigen::MatrixXd& X);

}  // namespace trunnion::thermal
