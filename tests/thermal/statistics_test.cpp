#include "trunnion/thermal/statistics.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace trunnion::thermal {
namespace {

struct Golden {
  std::vector<double> x;
  double W;
  double p;
};

std::vector<double> sequence(int n, double (*f)(double)) {
  std::vector<double> out;
  for (int i = 1; i <= n; ++i) out.push_back(f(i));
  return out;
}

// scipy 1.10 (Royston's own code, translated) and R's normality test; n = 3 exact, 4 to 11, 12 and more.
TEST(ShapiroWilk, EqualsPublishedValues) {
  const std::vector<Golden> cases = {
      {{1, 2, 4}, 0.96429, 0.63689},
      {{20.1, 20.9, 21.8, 22.3, 22.6, 22.7}, 0.89507, 0.34562},
      {{48.4, 49, 59.5, 59.6, 60.7, 88.8, 98.2, 109.4, 169.1, 227.1}, 0.80783, 0.01805},
      {{148, 154, 158, 160, 161, 162, 166, 170, 182, 195, 236}, 0.78881, 0.00670},
      {sequence(20, [](double i) { return std::pow(i, 1.5); }), 0.93864, 0.22596},
      {sequence(50, [](double i) { return std::log(i); }), 0.86332, 3.622e-5}};
  for (const Golden& golden : cases) {
    const auto result = shapiro_wilk(golden.x);
    ASSERT_TRUE(result);
    EXPECT_NEAR(result->W, golden.W, 1e-5) << golden.x.size();
    EXPECT_NEAR(result->p, golden.p, 1e-5) << golden.x.size();
  }
}

TEST(ShapiroWilk, DoesNotDependOnOffsetScaleAndOrder) {
  const std::vector<double> x = {3.1, 2.7, 9.4, 4.4, 5.0, 1.2, 7.7};
  std::vector<double> moved;
  for (auto it = x.rbegin(); it != x.rend(); ++it) moved.push_back(1000.0 - 3.0 * *it);
  EXPECT_NEAR(shapiro_wilk(x)->W, shapiro_wilk(moved)->W, 1e-12);
}

TEST(ShapiroWilk, RefusesWhatItIsNotMadeFor) {
  EXPECT_FALSE(shapiro_wilk(std::vector<double>{1, 2}));
  EXPECT_FALSE(shapiro_wilk(std::vector<double>(5001, 1.0)));
  EXPECT_FALSE(shapiro_wilk(std::vector<double>(10, 1.0)));
  EXPECT_FALSE(shapiro_wilk(std::vector<double>{1, 2, std::numeric_limits<double>::quiet_NaN()}));
  std::vector<double> largest;
  for (int i = 0; i < 5000; ++i) largest.push_back(i);
  EXPECT_TRUE(shapiro_wilk(largest));
}

// NIST StRD "Longley": certified coefficients, standard deviations and R^2; p-values and variance inflation
// as R prints them.
struct Longley {
  Eigen::MatrixXd X{16, 6};
  Eigen::VectorXd y{16};
  Longley() {
    y << 60323, 61122, 60171, 61187, 63221, 63639, 64989, 63761, 66019, 67857, 68169, 66513, 68655, 69564,
        69331, 70551;
    X.col(0) << 83.0, 88.5, 88.2, 89.5, 96.2, 98.1, 99.0, 100.0, 101.2, 104.6, 108.4, 110.8, 112.6, 114.2,
        115.7, 116.9;
    X.col(1) << 234289, 259426, 258054, 284599, 328975, 346999, 365385, 363112, 397469, 419180, 442769,
        444546, 482704, 502601, 518173, 554894;
    X.col(2) << 2356, 2325, 3682, 3351, 2099, 1932, 1870, 3578, 2904, 2822, 2936, 4681, 3813, 3931, 4806,
        4007;
    X.col(3) << 1590, 1456, 1616, 1650, 3099, 3594, 3547, 3350, 3048, 2857, 2798, 2637, 2552, 2514, 2572,
        2827;
    X.col(4) << 107608, 108632, 109773, 110929, 112075, 113270, 115094, 116219, 117388, 118734, 120445,
        121950, 123366, 125368, 127852, 130081;
    for (int i = 0; i < 16; ++i) X(i, 5) = 1947 + i;
  }
};

TEST(Regression, EqualsTheCertifiedLongleyValues) {
  const Longley data;
  const auto r = regress(data.X, data.y);
  ASSERT_TRUE(r) << r.error().text();
  const double value[] = {15.0618722713733,  -0.0358191792925910, -2.02022980381683,
                          -1.03322686717359, -0.0511041056535807, 1829.15146461355};
  const double error[] = {84.9149257747669,  0.0334910077722432, 0.488399681651699,
                          0.214274163161675, 0.226073200069370,  455.478499142212};
  const double p[] = {0.863141, 0.312681, 0.002535, 0.000944, 0.826212, 0.003037};
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(r->weight[j] / value[j], 1.0, 1e-9) << j;
    EXPECT_NEAR(r->standard_error[j] / error[j], 1.0, 1e-9) << j;
    EXPECT_NEAR(r->p[j], p[j], 1e-6) << j;
  }
  EXPECT_NEAR(r->intercept / -3482258.63459582, 1.0, 1e-9);
  EXPECT_NEAR(r->intercept_standard_error / 890420.383607373, 1.0, 1e-9);
  EXPECT_NEAR(r->residual_sd / 304.854073561965, 1.0, 1e-9);
  EXPECT_NEAR(r->r_squared, 0.995479004577296, 1e-12);
  EXPECT_EQ(r->degrees_of_freedom, 9);
}

TEST(Regression, VarianceInflationOfLongley) {
  const Eigen::VectorXd vif = variance_inflation(Longley().X);
  const double expected[] = {135.53, 1788.51, 33.62, 3.59, 399.15, 758.98};
  for (int j = 0; j < 6; ++j) EXPECT_NEAR(vif[j], expected[j], 0.005) << j;
}

TEST(Regression, RefusesWithoutSpareDegreesOfFreedomOrWithDependentColumns) {
  EXPECT_FALSE(regress(Eigen::MatrixXd::Random(6, 5), Eigen::VectorXd::Random(6)));
  Eigen::MatrixXd X = Eigen::MatrixXd::Random(20, 3);
  X.col(2) = 2.0 * X.col(0) - X.col(1);
  EXPECT_FALSE(regress(X, Eigen::VectorXd::Random(20)));
  EXPECT_TRUE(std::isinf(variance_inflation(X)[0]));
  EXPECT_TRUE(std::isinf(condition_number(X)) || condition_number(X) > 1e14);
}

TEST(Regression, ConditionOfOrthogonalColumnsIsOne) {
  Eigen::MatrixXd X(4, 2);
  X << 1, 1, -1, 1, 1, -1, -1, -1;
  EXPECT_NEAR(condition_number(X), 1.0, 1e-12);
}

}  // namespace
}  // namespace trunnion::thermal
