#include "trunnion/geom/linear_algebra.hpp"

#include <Eigen/QR>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/random_columns.hpp"

namespace trunnion {
namespace {

using test::random_columns;

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

// Against the conditions that define them, on random matrices with more and with fewer rows than columns.
TEST(LinearAlgebra, SolutionsMeetTheirDefinitions) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937_64 engine(seed);
    std::uniform_int_distribution<Eigen::Index> size(1, 12);
    const Eigen::Index columns = size(engine), rows = columns + size(engine) - 1;
    const MatrixXd a = random_columns(rows, columns, 1000 + seed);
    const VectorXd b = random_columns(rows, 1, 2000 + seed);
    const MatrixXd many = random_columns(rows, 3, 3000 + seed);
    const MatrixXd normal = a.transpose() * a + 0.1 * MatrixXd::Identity(columns, columns);
    const double slack = 1e-8 * (1.0 + b.norm()) * (1.0 + a.norm());

    const LeastSquares qr(a);
    ASSERT_EQ(qr.rank(), columns);
    EXPECT_LT((a.transpose() * (a * qr.solve(b) - b)).norm(), slack);
    EXPECT_LT((a.transpose() * (a * qr.solve_all(many) - many)).norm(), 4.0 * slack);
    EXPECT_LT((a.transpose() * (a * thin_svd(a).solve(b) - b)).norm(), slack);
    EXPECT_LT((a.transpose() * (a * shortest_least_squares(a, b) - b)).norm(), slack);
    EXPECT_LT((normal * solve_positive(normal, a.transpose() * b) - a.transpose() * b).norm(), slack);
    EXPECT_LT((normal * solve_positive_all(normal, normal) - normal).norm(), slack * (1.0 + normal.norm()));
    EXPECT_LT((normal * solve_square(normal, a.transpose()) - a.transpose()).norm(), slack);
    EXPECT_LT((normal * inverse_of(normal) - MatrixXd::Identity(columns, columns)).norm(), slack);

    const Cholesky lower(normal);
    EXPECT_LT((normal * lower.solve(a.transpose() * b) - a.transpose() * b).norm(), slack);
    EXPECT_LT((normal * lower.solve_all(a.transpose()) - a.transpose()).norm(), slack);
    const VectorXd white = lower.solve_lower(a.transpose() * b);
    EXPECT_NEAR(white.squaredNorm(), (a.transpose() * b).dot(lower.solve(a.transpose() * b)), slack);
    EXPECT_LT((lower.solve_lower_all(a.transpose()).transpose() * lower.solve_lower_all(a.transpose()) -
               a * lower.solve_all(a.transpose()))
                  .norm(),
              slack);
    const double log_determinant = symmetric_eigen(normal).values.array().log().sum();
    EXPECT_NEAR(2.0 * lower.log_determinant_of_lower(), log_determinant,
                1e-9 * (1.0 + std::abs(log_determinant)));
    EXPECT_NEAR(log_determinant_of_positive(normal, 1e-300), log_determinant,
                1e-9 * (1.0 + std::abs(log_determinant)));
  }
}

// Of long columns: (a' a)^-1 of well-conditioned ones, and what is not there of those that depend on others.
TEST(LinearAlgebra, RanksAndCofactors) {
  const MatrixXd a = random_columns(60, 5, 6);
  EXPECT_LT((LeastSquares(a).cofactor() * (a.transpose() * a) - MatrixXd::Identity(5, 5)).norm(), 1e-10);
  MatrixXd dependent(60, 7);
  dependent << a, a.col(0) + a.col(1), 1e-5 * random_columns(60, 1, 7) + a.col(2);
  EXPECT_EQ(LeastSquares(dependent).rank(), 6);
  EXPECT_EQ(LeastSquares(dependent, 1e-3).rank(), 5);
  // The shortest of all solutions has nothing along the null space.
  const VectorXd b = random_columns(60, 1, 8);
  const MatrixXd null = full_svd(dependent).V.rightCols(1);
  for (const VectorXd& x : {shortest_least_squares(dependent, b), thin_svd(dependent).solve(b),
                            VectorXd(pseudo_inverse(dependent) * b)}) {
    EXPECT_LT(std::abs(null.col(0).dot(x)), 1e-8 * x.norm());
    EXPECT_LT((dependent.transpose() * (dependent * x - b)).norm(), 1e-8 * b.norm());
  }
  EXPECT_LT((singular_values(dependent) - full_svd(dependent).s).norm(), 1e-12);
}

TEST(LinearAlgebra, RowsInEchelonFormSpanTheSame) {
  const MatrixXd rows = random_columns(3, 8, 9);
  const MatrixXd echelon = row_echelon(rows);
  ASSERT_EQ(echelon.rows(), 3);
  const MatrixXd span = thin_svd(rows.transpose()).U;
  EXPECT_LT((echelon.transpose() - span * (span.transpose() * echelon.transpose())).norm(), 1e-12);
  EXPECT_EQ(LeastSquares(echelon.transpose()).rank(), 3);
  // Each row less than the one before it: in some order of the columns the lower ones begin with zeros.
  EXPECT_GE((echelon.array() == 0.0).count(), 3);
}

}  // namespace
}  // namespace trunnion
