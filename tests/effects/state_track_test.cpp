#include "trunnion/effects/state_track.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace trunnion {
namespace {

struct Rows {
  std::vector<MachineState> states;
  std::vector<std::vector<double>> temperatures;
  void add(std::size_t run, double time, double rpm, double T) {
    MachineState s;
    s.run = run;
    s.time_s = time;
    s.spindle_rpm = rpm;
    temperatures.push_back({T});
    states.push_back(s);
  }
  StateTrack track() {
    for (std::size_t i = 0; i < states.size(); ++i) states[i].temperature_K = temperatures[i];
    return StateTrack(states);
  }
};

constexpr LagRequest kSpindle{{Signal::Kind::spindle_rpm, 0}, 1000.0};
constexpr LagRequest kTemperature{{Signal::Kind::temperature, 0}, 500.0};

TEST(StateTrack, SpindleStartsAtRestAndRisesExponentially) {
  Rows rows;
  for (const double t : {0.0, 100.0, 1000.0, 5000.0}) rows.add(0, t, 6000.0, 0.0);
  const auto y = rows.track().lag(kSpindle);
  EXPECT_EQ(y[0], 0.0);
  EXPECT_NEAR(y[1], 6000.0 * (1.0 - std::exp(-0.1)), 1e-9);
  EXPECT_NEAR(y[2], 6000.0 * (1.0 - std::exp(-1.0)), 1e-9);
  EXPECT_NEAR(y[3], 6000.0 * (1.0 - std::exp(-5.0)), 1e-9);
}

TEST(StateTrack, AValueHoldsFromItsRowToTheNext) {
  // 6000 rpm from 0 to 500 s, then 0: up, then down.
  Rows rows;
  rows.add(0, 0.0, 6000.0, 0.0);
  rows.add(0, 500.0, 0.0, 0.0);
  rows.add(0, 1500.0, 0.0, 0.0);
  const auto y = rows.track().lag(kSpindle);
  EXPECT_NEAR(y[1], 6000.0 * (1.0 - std::exp(-0.5)), 1e-9);
  EXPECT_NEAR(y[2], 6000.0 * (1.0 - std::exp(-0.5)) * std::exp(-1.0), 1e-9);
}

TEST(StateTrack, TemperaturesAreSettledAtTheStart) {
  Rows rows;
  rows.add(0, 0.0, 0.0, 4.0);
  rows.add(0, 300.0, 0.0, 6.0);
  rows.add(0, 800.0, 0.0, 6.0);
  const auto y = rows.track().lag(kTemperature);
  EXPECT_NEAR(y[0], 4.0, 1e-12);
  EXPECT_NEAR(y[1], 4.0, 1e-12);
  EXPECT_NEAR(y[2], 6.0 - 2.0 * std::exp(-1.0), 1e-12);
}

TEST(StateTrack, RunsAreSeparateAndRowsMayMixAndStandOutOfTimeOrder) {
  Rows rows;
  rows.add(1, 1000.0, 3000.0, 0.0);
  rows.add(0, 1000.0, 6000.0, 0.0);
  rows.add(0, 0.0, 6000.0, 0.0);
  rows.add(1, 0.0, 3000.0, 0.0);
  const auto y = rows.track().lag(kSpindle);
  EXPECT_NEAR(y[0], 3000.0 * (1.0 - std::exp(-1.0)), 1e-9);
  EXPECT_NEAR(y[1], 6000.0 * (1.0 - std::exp(-1.0)), 1e-9);
  EXPECT_EQ(y[2], 0.0);
  EXPECT_EQ(y[3], 0.0);
}

TEST(StateTrack, FineStepsAgreeWithTheDifferentialEquation) {
  // u = sin(w t) sampled finely: the classical response of a first-order lag.
  Rows rows;
  const double w = 0.002, tau = 1000.0;
  for (int i = 0; i <= 20000; ++i) rows.add(0, 0.5 * i, 1000.0 * std::sin(w * 0.5 * i), 0.0);
  const auto y = rows.track().lag(kSpindle);
  const double t = 10000.0;
  const double c = 1.0 + w * w * tau * tau;
  const double expected =
      1000.0 / c * (std::sin(w * t) - w * tau * std::cos(w * t) + w * tau * std::exp(-t / tau));
  EXPECT_NEAR(y.back(), expected, 0.5);  // half a step of holding: 1000 w dt / 2
}

TEST(LagFollower, EqualsTheTrackOfTheSameStates) {
  Rows rows;
  const double times[] = {0.0, 120.0, 130.0, 900.0, 2500.0};
  const double speeds[] = {6000.0, 0.0, 9000.0, 3000.0, 0.0};
  const double temperatures[] = {1.0, 2.5, 2.0, 4.0, 4.0};
  for (int i = 0; i < 5; ++i) rows.add(0, times[i], speeds[i], temperatures[i]);
  const StateTrack track = rows.track();
  const auto spindle = track.lag(kSpindle);
  const auto warm = track.lag(kTemperature);
  LagFollower follower({kSpindle, kTemperature});
  for (std::size_t i = 0; i + 1 < 5; ++i) {
    follower.hold(track.state(i), times[i + 1] - times[i]);
    EXPECT_NEAR(follower.values()[0], spindle[i + 1], 1e-9);
    EXPECT_NEAR(follower.values()[1], warm[i + 1], 1e-12);
  }
}

TEST(DirectionTracker, KeepsTheSenseOfTheLastMotion) {
  DirectionTracker tracker;
  JointVector q;
  EXPECT_EQ(tracker.move_to(q)[0], 0);
  q[0] = 1.0;
  EXPECT_EQ(tracker.move_to(q)[0], 1);
  q[1] = -1.0;
  EXPECT_EQ(tracker.move_to(q)[0], 1);
  EXPECT_EQ(tracker.move_to(q)[1], -1);
  q[0] = 0.5;
  EXPECT_EQ(tracker.move_to(q)[0], -1);
}

}  // namespace
}  // namespace trunnion
