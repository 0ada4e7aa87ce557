#include "thermal/sigma.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace trunnion::thermal {
namespace {

// Runs whose errors are normal with a variance that is known: it grows since the last measurement, and some
// runs are wilder than others. A measurement is made known every 30 min.
HeldOutRuns known_runs(std::size_t count, unsigned seed, double spread) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  HeldOutRuns out;
  for (std::size_t r = 0; r < count; ++r) {
    const double wild = std::exp(spread * normal(random));
    out.emplace_back();
    for (int i = 1; i <= 480; ++i) {
      HeldOut row;
      row.causes.age_s = 30.0 * (i % 60 == 0 ? 60 : i % 60);
      row.causes.change_mm = 1e-3 * std::abs(normal(random));
      row.error_mm = wild * normal(random) *
                     std::sqrt(1e-6 + 2e-9 * row.causes.age_s + 0.25 * std::pow(row.causes.change_mm, 2));
      row.made_known = i % 60 == 0;
      out.back().push_back(row);
    }
  }
  return out;
}

TEST(LongThermalSigma, FindsVariancesThatAreKnown) {
  const SigmaModel model = fit_sigma(known_runs(40, 1, 0.0));
  EXPECT_NEAR(model.floor_mm, 1e-3, 1e-4);
  EXPECT_NEAR(model.growth_mm_per_sqrt_s, std::sqrt(2e-9), 0.15 * std::sqrt(2e-9));
  EXPECT_NEAR(model.per_change, 0.5, 0.1);
  EXPECT_NEAR(model.coverage.quiet, 1.0, 0.05);  // normal errors: 1.96 sigma are 95 %
}

TEST(ThermalSigma, CoversWhatItPromisesInRunsThatAreHeldOut) {
  const HeldOutRuns runs = known_runs(30, 2, 0.4);
  const auto coverage = coverage_of(runs, held_out_sigmas(runs));
  double mean = 0.0;
  for (const double c : coverage) mean += c / static_cast<double>(coverage.size());
  EXPECT_GT(mean, 0.93);
  EXPECT_LT(mean, 0.97);
}

// The measurements of a run tell how wild it is: three times the errors end in about three times the sigma.
TEST(ThermalSigma, FollowsARunThatIsWilderThanPromised) {
  RunScale calm;
  RunScale wild;
  for (int i = 0; i < 30; ++i) {
    calm.add(i % 2 == 0 ? 1.0 : -1.0);
    wild.add(i % 2 == 0 ? 3.0 : -3.0);
  }
  EXPECT_NEAR(calm.factor(4.0), 1.0, 1e-12);
  EXPECT_GT(wild.factor(2.0), 2.6);
  EXPECT_LT(wild.factor(2.0), 3.0);
  EXPECT_EQ(wild.factor(0.0), 1.0);
}

}  // namespace
}  // namespace trunnion::thermal
