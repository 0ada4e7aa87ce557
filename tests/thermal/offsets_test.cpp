#include "trunnion/thermal/offsets.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace trunnion::thermal {
namespace {

TEST(ThermalOffsets, InterpolatesOverTimeAndHoldsOutside) {
  Diagnostics diagnostics;
  const auto table =
      parse_offsets("time_s,dx_um,dz_um,sigma_um\n0,0,1,2\n100,10,1,2\n", "o.csv", diagnostics);
  ASSERT_TRUE(table) << table.error().text();
  EXPECT_NEAR(table->at_time(25.0).x(), 0.0025, 1e-15);
  EXPECT_NEAR(table->at_time(-5.0).x(), 0.0, 1e-15);
  EXPECT_NEAR(table->at_time(1e6).x(), 0.010, 1e-15);
  EXPECT_NEAR(table->at_time(50.0).z(), 0.001, 1e-15);
}

TEST(ThermalOffsets, SaysWhereATableIsWrong) {
  const auto message = [](const char* text) {
    Diagnostics diagnostics;
    const auto table = parse_offsets(text, "o.csv", diagnostics);
    return table ? std::string("no error") : table.error().text();
  };
  EXPECT_EQ(message("time_s,operation,dx_um\n0,a,1\n"),
            "o.csv:1:1: error: an offset table has either a column 'time_s' or a column 'operation'");
  EXPECT_EQ(message("time_s\n0\n"), "o.csv:1:1: error: none of the columns dx_um, dy_um, dz_um");
  EXPECT_EQ(message("time_s,dx_um\n1,1\n0,2\n"), "o.csv:3:1: error: time 0 s does not come after 1 s");
  EXPECT_EQ(message("operation,dx_um\na,1\na,2\n"), "o.csv:3:1: error: operation 'a' stands twice");
  EXPECT_EQ(message("time_s,dx_um,frame\n0,1,part\n1,1,machine\n"),
            "o.csv:3:3: error: the frame changes within the table");
  EXPECT_EQ(message("run_id,time_s,dx_um\na,0,1\n"),
            "o.csv:1:1: error: the table holds several runs; a program has one: predict it with --run");
}

TEST(OffsetFollower, ClampsSlewsAndRests) {
  OffsetFollower follower({.enabled = true, .clamp_mm = 0.05, .slew_mm_s = 0.001, .dead_band_mm = 0.0005});
  EXPECT_EQ(follower.follow(Vec3(0.02, 0, 0), 0.0).x(), 0.02);  // nothing is being cut yet
  EXPECT_NEAR(follower.follow(Vec3(0.03, 0, 0), 2.0).x(), 0.022, 1e-15);
  EXPECT_TRUE(follower.slew_limited());
  EXPECT_FALSE(follower.clamped());
  EXPECT_NEAR(follower.follow(Vec3(0.0224, 0, 0), 100.0).x(), 0.022, 1e-15);  // within the dead band
  EXPECT_NEAR(follower.follow(Vec3(0.9, -0.9, 0), 1000.0).x(), 0.05, 1e-15);
  EXPECT_TRUE(follower.clamped());
  EXPECT_NEAR(follower.follow(Vec3(0.9, -0.9, 0), 1000.0).y(), -0.05, 1e-15);
}

// The dead band makes steps of a slow drift: the slew limit must not take them for fast ones.
TEST(OffsetFollower, IsNeverLateForADriftBelowTheSlewLimit) {
  const OffsetLimits limits{.enabled = true, .clamp_mm = 0.05, .slew_mm_s = 0.001, .dead_band_mm = 0.0005};
  OffsetLimits free = limits;
  free.slew_mm_s = std::numeric_limits<double>::infinity();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int drift = 0; drift < 100; ++drift) {
    OffsetFollower follower(limits), at_once(free);
    Vec3 wanted = Vec3::Zero();
    for (int i = 0; i < 1000; ++i) {
      const double seconds = 2.0 * uniform(random) * uniform(random);
      for (Eigen::Index k = 0; k < 3; ++k)
        wanted[k] += (2.0 * uniform(random) - 1.0) * limits.slew_mm_s * seconds;
      ASSERT_LT((follower.follow(wanted, seconds) - at_once.follow(wanted, seconds)).norm(), 1e-15);
    }
    EXPECT_FALSE(follower.slew_limited());
  }
}

TEST(OffsetFollower, SwitchedOffIsZero) {
  OffsetFollower follower({.enabled = false});
  EXPECT_TRUE(follower.follow(Vec3(0.02, 0.03, 0.04), 1.0).isZero(0.0));
}

}  // namespace
}  // namespace trunnion::thermal
