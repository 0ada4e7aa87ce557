#include "trunnion/machine/motion_time.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "support/machines.hpp"

namespace trunnion {
namespace {

Machine with_accelerations() {
  Machine machine = test::shipped_machine("trunnion_offset");
  for (Axis& axis : machine.axes) axis.acceleration = axis.kind == AxisKind::linear ? 1000.0 : 10.0;
  return machine;
}

struct Leg {
  JointVector to;
  double seconds;
};

JointVector at(double x, double y = 0.0, double c = 0.0) {
  JointVector out;
  out[0] = x;
  out[1] = y;
  out[4] = c;
  return out;
}

// What comes of a path from zero that ends in a stop.
std::vector<BlockRun> runs(std::optional<double> blend_mm, const std::vector<Leg>& path) {
  const Machine machine = with_accelerations();
  MotionTime time(machine, blend_mm, PlanOf::paces_and_seconds);
  std::vector<BlockRun> out;
  JointVector from;
  for (const Leg& leg : path) {
    time.go(from, leg.to, leg.seconds, out);
    from = leg.to;
  }
  time.stop(out);
  EXPECT_EQ(out.size(), path.size());
  return out;
}

// 100 mm at 50 mm/s and 1000 mm/s2: 0.05 s and 1.25 mm each for getting up and down, 97.5 mm at the speed.
TEST(MotionTime, OfABlockFromStopToStopIsATrapezoid) {
  EXPECT_NEAR(runs(std::nullopt, {{at(100.0), 2.0}})[0].seconds, 0.05 + 97.5 / 50.0 + 0.05, 1e-12);
  // A control that blends keeps half of the acceleration for a block that does not come.
  EXPECT_NEAR(runs(0.01, {{at(100.0), 2.0}})[0].seconds, 0.1 + 95.0 / 50.0 + 0.1, 1e-12);
}

// 10 mm: half of it at 1000 mm/s2 takes 0.1 s, and the speed of 500 mm/s is never reached, but 100 mm/s.
TEST(MotionTime, OfAShortBlockIsATriangle) {
  const BlockRun run = runs(std::nullopt, {{at(0.0, -10.0), 0.02}})[0];
  EXPECT_NEAR(run.seconds, 0.2, 1e-12);
  EXPECT_NEAR(run.pace, 0.2, 1e-12);
}

// The slowest of all axes decides: C turns by 1 rad at 10 rad/s2, X goes 1 mm.
TEST(MotionTime, TheAxisThatTakesLongestDecides) {
  EXPECT_NEAR(runs(std::nullopt, {{at(1.0, 0.0, 1.0), 1.0}})[0].seconds, 1.0 + 0.1, 1e-12);
}

// Where nobody knows what comes it does not slow down; where it comes to rest between two blocks it has all
// of its acceleration.
TEST(MotionTime, EndsAsItIsTold) {
  const Machine machine = with_accelerations();
  MotionTime time(machine, 0.01, PlanOf::paces_and_seconds);
  std::vector<BlockRun> out;
  time.go(at(0.0), at(100.0), 2.0, out);
  time.lose(out);
  time.go(at(0.0), at(100.0), 2.0, out);
  time.rest(out);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_NEAR(out[0].seconds, 0.05 + (100.0 - 1.25) / 50.0, 1e-12);
  EXPECT_NEAR(out[1].seconds, 0.05 + 97.5 / 50.0 + 0.05, 1e-12);
}

// Blocks of 10 mm and 0.2 s at a right angle, in which A turns, too. With half of its acceleration, 500
// mm/s2, the first goes over into the next one, which begins while the first slows down from v, d = v^2 /
// 1000 before the corner, so that the tool passes it at d cos 45 / 2: at 0.01 mm v is 5.318 mm/s.
TEST(MotionTime, ACornerIsTakenAsFastAsItsToleranceAllows) {
  const auto right_angle = runs(0.01, {{at(10.0, 0.0, 0.01), 0.2}, {at(10.0, 10.0, 0.02), 0.2}});
  const double corner = 2.0 * std::sqrt(500.0 * 0.01 * std::sqrt(2.0));
  EXPECT_NEAR(right_angle[0].seconds, 0.2 + (50.0 - corner) / 500.0, 1e-12);
  EXPECT_NEAR(right_angle[1].seconds, 0.2 + 50.0 / 500.0, 1e-12);
  // Straight on there is no corner, and 10 mm of tolerance is no limit.
  EXPECT_NEAR(runs(0.01, {{at(10.0, 0.0, 0.01), 0.2}, {at(20.0, 0.0, 0.02), 0.2}})[0].seconds, 0.2, 1e-12);
  EXPECT_NEAR(runs(10.0, {{at(10.0, 0.0, 0.01), 0.2}, {at(10.0, 10.0, 0.02), 0.2}})[0].seconds, 0.2, 1e-12);
}

// Linear axes alone, at a right angle: an arc of 0.01 / (sqrt 2 - 1) mm, with all of the acceleration.
TEST(MotionTime, BetweenLinearBlocksThereIsAnArc) {
  const auto path = runs(0.01, {{at(10.0), 0.2}, {at(10.0, 10.0), 0.2}});
  const double corner = std::sqrt(1000.0 * 0.01 / (std::sqrt(2.0) - 1.0));
  EXPECT_NEAR(path[0].seconds, 0.2 + 0.025 + (50.0 - corner) * (50.0 - corner) / (2.0 * 1000.0 * 50.0),
              1e-12);
  EXPECT_NEAR(path[1].seconds, 0.2 + 0.05 + (50.0 - corner) * (50.0 - corner) / (2.0 * 500.0 * 50.0), 1e-12);
  // Straight on it stays as fast as it is, in blocks of any length.
  std::vector<Leg> straight;
  for (int i = 1; i <= 100; ++i) straight.push_back({at(0.1 * i), 0.001});
  EXPECT_EQ(runs(0.01, straight)[50].pace, 1.0);
  EXPECT_NEAR(runs(0.01, straight)[50].seconds, 0.001, 1e-12);
}

// A corner takes no more than half of either block: between long blocks at 100 mm/s one of 1 mm, which never
// gets faster than sqrt(500 1) mm/s and lasts 1 / sqrt(500) s: the long one is down to 500 mm/s2 times that
// when it begins.
TEST(MotionTime, AShortBlockHoldsUpALongOne) {
  const auto path =
      runs(1.0, {{at(100.0, 0.0, 0.1), 1.0}, {at(101.0, 0.0, 0.101), 0.01}, {at(201.0, 0.0, 0.201), 1.0}});
  const double short_s = 1.0 / std::sqrt(500.0);
  EXPECT_NEAR(path[0].seconds, 1.0 + (100.0 - 500.0 * short_s) / 500.0, 1e-12);
  EXPECT_NEAR(path[1].seconds, short_s, 1e-12);
  EXPECT_NEAR(path[1].pace, 0.01 / short_s, 1e-12);
  EXPECT_NEAR(path[2].seconds, 1.0 + 0.2, 1e-12);
}

TEST(MotionTime, IsKnownWhereEveryAxisSaysIt) {
  Machine machine = with_accelerations();
  EXPECT_TRUE(MotionTime::is_known(machine));
  machine.axes[3].acceleration.reset();
  EXPECT_FALSE(MotionTime::is_known(machine));
}

}  // namespace
}  // namespace trunnion
