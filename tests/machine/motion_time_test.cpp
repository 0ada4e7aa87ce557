#include "trunnion/machine/motion_time.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "support/machines.hpp"

namespace trunnion {
namespace {

Machine with_accelerations() {
  Machine machine = test::shipped_machine("trunnion_offset");
  for (Axis& axis : machine.axes) axis.acceleration = axis.kind == AxisKind::linear ? 1000.0 : 10.0;
  return machine;
}

// 100 mm at 50 mm/s and 1000 mm/s2: 0.05 s and 1.25 mm each for getting up and down, 97.5 mm at the speed.
TEST(MotionTime, OfABlockFromStopToStopIsATrapezoid) {
  const Machine machine = with_accelerations();
  JointVector from, to;
  to[0] = 100.0;
  EXPECT_NEAR(MotionTime(machine, std::nullopt).go(from, to, 2.0), 0.05 + 97.5 / 50.0 + 0.05, 1e-12);
}

// 10 mm: half of it at 1000 mm/s2 takes 0.1 s, and the speed of 500 mm/s is never reached.
TEST(MotionTime, OfAShortBlockIsATriangle) {
  const Machine machine = with_accelerations();
  JointVector from, to;
  to[1] = -10.0;
  EXPECT_NEAR(MotionTime(machine, std::nullopt).go(from, to, 0.02), 0.2, 1e-12);
}

// The slowest of all axes decides: C turns by 1 rad at 10 rad/s2, X goes 1 mm.
TEST(MotionTime, TheAxisThatTakesLongestDecides) {
  const Machine machine = with_accelerations();
  JointVector from, to;
  to[0] = 1.0;
  to[4] = 1.0;
  EXPECT_NEAR(MotionTime(machine, std::nullopt).go(from, to, 1.0), 1.0 + 0.1, 1e-12);
  MotionTime blending(machine, 0.01);
  EXPECT_NEAR(blending.go(from, to, 1.0), 1.0, 1e-12);
  // Half of the acceleration, 5 rad/s2, and a full stop behind it.
  EXPECT_NEAR(blending.stop(), 1.0 / 5.0, 1e-12);
  EXPECT_EQ(blending.stop(), 0.0);
}

// Blocks of 10 mm and 0.2 s at a right angle, 500 mm/s2 each. The next block begins while the first slows
// down from v, d = v^2 / 1000 before the corner, which the tool then passes at d cos 45 / 2: at 0.01 mm v
// is 5.318 mm/s.
TEST(MotionTime, ACornerIsTakenAsFastAsItsToleranceAllows) {
  const Machine machine = with_accelerations();
  JointVector a, b, c;
  b[0] = 10.0;
  c = b;
  c[1] = 10.0;
  MotionTime time(machine, 0.01);
  EXPECT_NEAR(time.go(a, b, 0.2), 0.2, 1e-12);
  const double corner = 2.0 * std::sqrt(500.0 * 0.01 * std::sqrt(2.0));
  EXPECT_NEAR(time.go(b, c, 0.2), 0.2 + (50.0 - corner) / 500.0, 1e-12);
  // Straight on there is no corner, and 10 mm of tolerance is no limit.
  MotionTime straight(machine, 0.01);
  JointVector d = b;
  d[0] = 20.0;
  EXPECT_NEAR(straight.go(a, b, 0.2) + straight.go(b, d, 0.2), 0.4, 1e-12);
  MotionTime wide(machine, 10.0);
  EXPECT_NEAR(wide.go(a, b, 0.2) + wide.go(b, c, 0.2), 0.4, 1e-12);
}

// A corner takes no more than half of either block: behind a long block at 100 mm/s one of 1 mm, which never
// gets faster than sqrt(500 1) mm/s and lasts 1 / sqrt(500) s: the long one is down to 500 mm/s2 times that
// when it begins.
TEST(MotionTime, AShortBlockHoldsUpALongOne) {
  const Machine machine = with_accelerations();
  JointVector a, b, c;
  b[0] = 100.0;
  c[0] = 101.0;
  MotionTime time(machine, 1.0);
  EXPECT_NEAR(time.go(a, b, 1.0), 1.0, 1e-12);
  const double short_s = 1.0 / std::sqrt(500.0);
  EXPECT_NEAR(time.go(b, c, 0.01), short_s + (100.0 - 500.0 * short_s) / 500.0, 1e-12);
}

TEST(MotionTime, IsKnownWhereEveryAxisSaysIt) {
  Machine machine = with_accelerations();
  EXPECT_TRUE(MotionTime::is_known(machine));
  machine.axes[3].acceleration.reset();
  EXPECT_FALSE(MotionTime::is_known(machine));
}

}  // namespace
}  // namespace trunnion
