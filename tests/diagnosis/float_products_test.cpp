#include "diagnosis/fit/float_products.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/random_columns.hpp"

namespace trunnion::diagnosis {
namespace {

using Eigen::MatrixXd;

using test::random_columns;

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

}  // namespace
}  // namespace trunnion::diagnosis
