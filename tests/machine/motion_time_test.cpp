#include "trunnion/machine/motion_time.hpp"

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
  EXPECT_NEAR(MotionTime(machine, true).of(from, to, 2.0), 0.05 + 97.5 / 50.0 + 0.05, 1e-12);
}

// 10 mm: half of it at 1000 mm/s2 takes 0.1 s, and the speed of 500 mm/s is never reached.
TEST(MotionTime, OfAShortBlockIsATriangle) {
  const Machine machine = with_accelerations();
  JointVector from, to;
  to[1] = -10.0;
  EXPECT_NEAR(MotionTime(machine, true).of(from, to, 0.02), 0.2, 1e-12);
}

// The slowest of all axes decides: C turns by 1 rad at 10 rad/s2, X goes 1 mm.
TEST(MotionTime, TheAxisThatTakesLongestDecides) {
  const Machine machine = with_accelerations();
  JointVector from, to;
  to[0] = 1.0;
  to[4] = 1.0;
  EXPECT_NEAR(MotionTime(machine, true).of(from, to, 1.0), 1.0 + 0.1, 1e-12);
  EXPECT_NEAR(MotionTime(machine, false).of(from, to, 1.0), 1.0, 1e-12);
}

TEST(MotionTime, IsKnownWhereEveryAxisSaysIt) {
  Machine machine = with_accelerations();
  EXPECT_TRUE(MotionTime::is_known(machine));
  machine.axes[3].acceleration.reset();
  EXPECT_FALSE(MotionTime::is_known(machine));
}

}  // namespace
}  // namespace trunnion
