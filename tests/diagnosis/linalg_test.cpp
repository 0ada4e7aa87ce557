#include "diagnosis/fit/linalg.hpp"

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "diagnosis/fit/float_products.hpp"

namespace trunnion::diagnosis {
namespace {

MatrixXd random_columns(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  MatrixXd out(rows, columns);
  for (double& v : out.reshaped()) v = normal(engine);
  return out;
}

// Lengths that fill no register, no tile and no chunk.
TEST(FloatProducts, AreThoseOfDoubles) {
  for (const auto& [rows, left, right] :
       {std::array{1, 1, 1}, std::array{7, 3, 2}, std::array{1031, 5, 4}, std::array{4099, 9, 13}}) {
    const MatrixXd a = random_columns(rows, left, 1), b = random_columns(rows, right, 2);
    const MatrixXd exact = a.transpose() * b;
    const MatrixXd found = inner_products(a.cast<float>(), b.cast<float>()).cast<double>();
    const double rounding = 1e-6 * std::sqrt(static_cast<double>(rows));
    EXPECT_LT((found - exact).cwiseAbs().maxCoeff(), 4.0 * rounding + 1e-6) << rows << " readings";
  }
}

TEST(FloatProducts, OfPartsOfMatrices) {
  const Eigen::MatrixXf all = random_columns(100, 8, 3).cast<float>();
  const Eigen::MatrixXf part = all.middleCols(2, 3);
  EXPECT_EQ(inner_products(all.middleCols(2, 3), all), inner_products(part, all));
  EXPECT_EQ(inner_products(all.leftCols(0), all).rows(), 0);
}

// Columns from 1 down to 1e-4 of new directions: the same rank, pivots and span as Householder's.
TEST(PivotedQr, OfLongColumnsIsThatOfHouseholder) {
  MatrixXd a = random_columns(600, 12, 4);
  for (auto column : a.colwise()) column.normalize();
  for (Eigen::Index k = 6; k < 12; ++k)
    a.col(k) = a.col(k - 6) + std::pow(10.0, -static_cast<double>(k - 5)) * a.col(k);
  for (const double threshold : {3e-3, 3e-4, 3e-5}) {
    Eigen::ColPivHouseholderQR<MatrixXd> householder(a);
    Eigen::Index rank = 0;
    while (rank < 12 && std::abs(householder.matrixQR()(rank, rank)) > threshold) ++rank;
    const PivotedQr found = pivoted_qr(a, threshold);
    ASSERT_EQ(found.Q.cols(), rank);
    EXPECT_LT((found.Q.transpose() * found.Q - MatrixXd::Identity(rank, rank)).norm(), 1e-12);
    for (Eigen::Index k = 0; k < rank; ++k)
      EXPECT_NEAR(found.diagonal[k], std::abs(householder.matrixQR()(k, k)), 1e-5 * found.diagonal[k]);
    const MatrixXd q = householder.householderQ() * MatrixXd::Identity(600, rank);
    EXPECT_LT((found.Q - q * (q.transpose() * found.Q)).norm(), 1e-6);
  }
}

TEST(PivotedQr, OfNothingIsNothing) {
  const PivotedQr zero = pivoted_qr(MatrixXd::Zero(50, 3), 1e-5);
  EXPECT_EQ(zero.Q.cols(), 0);
  EXPECT_EQ(zero.order.size(), 3);
}

TEST(PivotedCholesky, FactorsWhatIsAboveTheThreshold) {
  const MatrixXd a = random_columns(4, 9, 5);  // rank 4 of 9
  const MatrixXd gram = a.transpose() * a;
  const PivotedCholesky found = pivoted_cholesky(gram, 1e-9);
  ASSERT_EQ(found.rank, 4);
  for (Eigen::Index i = 0; i < 4; ++i)
    for (Eigen::Index k = 0; k < 4; ++k)
      EXPECT_NEAR(found.lower.row(i).dot(found.lower.row(k)), gram(found.order[i], found.order[k]), 1e-10);
}

}  // namespace
}  // namespace trunnion::diagnosis
