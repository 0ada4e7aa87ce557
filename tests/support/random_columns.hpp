#pragma once
#include <Eigen/Core>
#include <random>

namespace trunnion::test {

/// Normally distributed numbers of variance 1.
inline Eigen::MatrixXd random_columns(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd out(rows, columns);
  for (double& v : out.reshaped()) v = normal(engine);
  return out;
}

}  // namespace trunnion::test
