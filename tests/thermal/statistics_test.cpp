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

// scipy 1.10.1 (Debian 12) over i^1.5, ln i and sqrt i, i = 1..n: exact for 3, and both approximations up to
// the largest sample.
TEST(ShapiroWilk, EqualsTheReferenceTableFromThreeToFiveThousand) {
  struct Row {
    int n;
    double W[3], p[3];
  };
  const std::vector<Row> table = {
      {3, {0.9945243, 0.9776538, 0.9942558}, {0.8585432, 0.7134264, 0.8551111}},
      {4, {0.9835830, 0.9599605, 0.9854948}, {0.9226951, 0.7786607, 0.9334033}},
      {5, {0.9747351, 0.9471766, 0.9788063}, {0.9046815, 0.7170103, 0.928134}},
      {7, {0.9625363, 0.9298002, 0.9699050}, {0.8401771, 0.5492017, 0.8977642}},
      {11, {0.9494909, 0.9098279, 0.9606510}, {0.6374543, 0.242752, 0.7797885}},
      {12, {0.9474753, 0.9063839, 0.9592376}, {0.6004173, 0.1917095, 0.7728931}},
      {13, {0.9457611, 0.9033191, 0.9580373}, {0.5356619, 0.1485174, 0.723148}},
      {25, {0.9361356, 0.8814816, 0.9512930}, {0.1204958, 0.007415459, 0.2680741}},
      {100, {0.9302592, 0.8492513, 0.9470947}, {5.148346e-05, 1.112826e-08, 0.0005366037}},
      {500, {0.9297140, 0.8290448, 0.9467863}, {1.440208e-14, 1.015904e-22, 2.035489e-12}},
      {1000, {0.9297280, 0.8243052, 0.9468426}, {3.023727e-21, 1.03837e-31, 1.689463e-18}},
      {2000, {0.9297455, 0.8211365, 0.9468915}, {1.153599e-29, 1.374674e-42, 2.866817e-26}},
      {5000, {0.9297584, 0.8185927, 0.9469339}, {1.87774e-43, 0.0, 3.808557e-39}}};
  for (const Row& row : table) {
    const std::vector<double> x[3] = {sequence(row.n, [](double i) { return std::pow(i, 1.5); }),
                                      sequence(row.n, [](double i) { return std::log(i); }),
                                      sequence(row.n, [](double i) { return std::sqrt(i); })};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto result = shapiro_wilk(x[k]);
      ASSERT_TRUE(result);
      // The reference adds up in single precision: the sixth digit of W and, far in the tail, the third of p.
      EXPECT_NEAR(result->W, row.W[k], 1e-5) << row.n << " " << k;
      EXPECT_NEAR(result->p, row.p[k], 1e-5) << row.n << " " << k;
      if (row.p[k] > 1e-30) {
        EXPECT_NEAR(result->p / row.p[k], 1.0, 2e-2) << row.n << " " << k;
      }
    }
  }
  const auto logistic = [](int n) {
    std::vector<double> out;
    for (int i = 1; i <= n; ++i) {
      const double u = std::fmod(i * 0.6180339887498949, 1.0);
      out.push_back(std::log(u / (1.0 - u)));
    }
    return shapiro_wilk(out);
  };
  EXPECT_NEAR(logistic(12)->W, 0.9951775, 2e-6);
  EXPECT_NEAR(logistic(50)->W, 0.9977857, 2e-6);
  EXPECT_NEAR(logistic(500)->W, 0.9948465, 2e-6);
  EXPECT_NEAR(logistic(500)->p, 0.0929831, 1e-4);
  EXPECT_NEAR(logistic(5000)->W, 0.9925767, 1e-5);
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
