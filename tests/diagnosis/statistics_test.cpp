#include "diagnosis/fit/statistics.hpp"

#include <gtest/gtest.h>
#include <limits>

namespace trunnion::diagnosis {
namespace {

// The 5 % points that tables print.
TEST(Tails, AreThoseOfTheTables) {
  EXPECT_NEAR(chi2_tail(3.8415, 1.0), 0.05, 1e-5);
  EXPECT_NEAR(chi2_tail(18.307, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(4.9646, 1.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(3.3258, 5.0, 10.0), 0.05, 1e-5);
}

// A hopeless model of thousands of readings, and the quotient of two residuals that are nothing: each ended
// the program once.
TEST(Tails, OfWhatIsTooLargeOrNoNumber) {
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(chi2_tail(1e9, 4000.0), 0.0);
  EXPECT_EQ(chi2_tail(kInfinite, 4000.0), 0.0);
  EXPECT_EQ(chi2_tail(kNotANumber, 4000.0), 1.0);
  EXPECT_EQ(f_tail(kNotANumber, 4.0, 100.0), 1.0);
  EXPECT_EQ(f_tail(kInfinite, 4.0, 100.0), 0.0);
  EXPECT_EQ(f_tail(1.0, 4.0, 0.0), 1.0);
}

}  // namespace
}  // namespace trunnion::diagnosis
