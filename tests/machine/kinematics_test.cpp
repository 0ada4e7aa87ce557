#include "trunnion/machine/kinematics.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion {
namespace {

// Random joint positions within the limits, with a share exactly at the limits and near the pole.
class RandomJoints {
 public:
  RandomJoints(const Machine& machine, unsigned seed) : machine_(machine), random_(seed) {}

  JointVector next() {
    JointVector q;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) q[id] = position(machine_.axes[id]);
    const auto rotary = machine_.rotary_axes();
    const double kind = uniform(0.0, 1.0);
    if (kind < 0.1) {
      q[rotary[0]] = std::pow(10.0, uniform(-9.0, -1.0)) * (uniform(-1.0, 1.0) < 0.0 ? -1.0 : 1.0);
    } else if (kind < 0.15 && machine_.axes[rotary[0]].has_limits()) {
      q[rotary[0]] = kind < 0.125 ? machine_.axes[rotary[0]].min : machine_.axes[rotary[0]].max;
    }
    return q;
  }
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }

 private:
  double position(const Axis& axis) {
    return axis.has_limits() ? uniform(axis.min, axis.max) : uniform(-4.0 * kPi, 4.0 * kPi);
  }
  const Machine& machine_;
  std::mt19937_64 random_;
};

class KinematicsOf : public testing::TestWithParam<std::string> {};

TEST_P(KinematicsOf, ForwardOfInverseIsThePose) {
  const Machine machine = test::shipped_machine(GetParam());
  const int cases = test::cases(1000000, "TRUNNION_CASES");
  RandomJoints joints(machine, 20261120);
  double worst_mm = 0.0;
  double worst_rad = 0.0;
  for (int i = 0; i < cases; ++i) {
    const JointVector q = joints.next();
    const ToolPose pose = tool_pose(forward(machine, q));
    JointVector seed = q;
    seed[machine.rotary_axes()[1]] += joints.uniform(-0.5, 0.5);
    const auto solutions = inverse(machine, pose, seed);
    ASSERT_FALSE(solutions.empty()) << "case " << i;
    for (const JointSolution& s : solutions) {
      const ToolPose back = tool_pose(forward(machine, s.q));
      worst_mm = std::max(worst_mm, (back.tip_P - pose.tip_P).norm());
      worst_rad = std::max(worst_rad, angle_between(back.axis_P, pose.axis_P).rad());
    }
  }
  EXPECT_LT(worst_mm, 1e-9);
  EXPECT_LT(worst_rad, 1e-12);
  RecordProperty("worst_mm", std::to_string(worst_mm * 1e12) + "e-12");
}

TEST_P(KinematicsOf, InverseFindsTheJointsItCameFrom) {
  const Machine machine = test::shipped_machine(GetParam());
  RandomJoints joints(machine, 7);
  for (int i = 0; i < 20000; ++i) {
    const JointVector q = joints.next();
    const auto solutions = inverse(machine, tool_pose(forward(machine, q)), q);
    double best = 1e9;
    for (const JointSolution& s : solutions) {
      double difference = 0.0;
      for (AxisId id = 0; id < machine.axes.size(); ++id)
        difference = std::max(difference, std::abs(s.q[id] - q[id]));
      best = std::min(best, difference);
    }
    // The rotary positions are determined to rounding / sin(A): at A = 0 C is free, at A = 180 deg the two
    // branches meet.
    const double tilt = std::abs(std::sin(q[machine.rotary_axes()[0]]));
    ASSERT_LT(best, 1e-9 + 1e-12 / std::max(tilt, 1e-12)) << "case " << i << " tilt " << tilt;
  }
}

INSTANTIATE_TEST_SUITE_P(ShippedMachines, KinematicsOf, testing::ValuesIn(test::shipped_machines()),
                         [](const auto& test) { return test.param; });

TEST(Kinematics, MatchesThePapersInverse) {
  // Eq. (3.1) with its misprint mended: S = Rx(A) Rz(C) (P - m) + m, A = acos(u_z), C = atan2(u_x, u_y).
  const Machine machine = test::shipped_machine("paper");
  const Vec3 u = Vec3(0.8259, -0.0720, 0.5592).normalized();
  const auto solutions = inverse(machine, {Vec3(51.4984, 4.8320, -37.8134), u}, {});
  ASSERT_EQ(solutions.size(), 2u);
  const double A = std::acos(u.z());
  const double C = std::atan2(u.x(), u.y());
  const auto& s = std::abs(solutions[0].q[3] - A) < 1e-9 ? solutions[0] : solutions[1];
  EXPECT_NEAR(s.q[3], A, 1e-12);
  EXPECT_NEAR(s.q[4], C, 1e-12);
  const Vec3 d(51.4984, 4.8320, -37.8134 + 200.0);
  const Vec3 turned(std::cos(C) * d.x() - std::sin(C) * d.y(), std::sin(C) * d.x() + std::cos(C) * d.y(),
                    d.z());
  EXPECT_NEAR(s.q[0], turned.x(), 1e-9);
  EXPECT_NEAR(s.q[1], std::cos(A) * turned.y() - std::sin(A) * turned.z(), 1e-9);
  EXPECT_NEAR(s.q[2] - 150.0, std::sin(A) * turned.y() + std::cos(A) * turned.z() - 200.0,
              1e-9);  // S is 150 above the tip
}

TEST(Kinematics, MatchesThePublishedCheckOfXyzacTrt) {
  // LinuxCNC xyzac-trt: r = (3,-2,-40), y-offset 20, z-offset 150, joints (1,2,3,30,30) -> (-22.4103,
  // -42.0119, 25.3353).
  Machine machine = test::shipped_machine("xyzac_trt");
  machine.tool_length_mm = 0.0;
  machine.axes[3].point_mm = Vec3(3, -2 + 20, -40 + 150);
  machine.axes[4].point_mm = Vec3(3, -2, -40);
  JointVector q;
  q[0] = 1;
  q[1] = 2;
  q[2] = 3;
  q[3] = Angle::degrees(30).rad();
  q[4] = Angle::degrees(30).rad();
  const ToolPose pose = tool_pose(forward(machine, q));
  EXPECT_NEAR(pose.tip_P.x(), -22.4103, 5e-5);
  EXPECT_NEAR(pose.tip_P.y(), -42.0119, 5e-5);
  EXPECT_NEAR(pose.tip_P.z(), 25.3353, 5e-5);
  EXPECT_NEAR(pose.axis_P.x(), 0.25, 1e-12);
  EXPECT_NEAR(pose.axis_P.y(), 0.43301, 1e-5);
  EXPECT_NEAR(pose.axis_P.z(), 0.86603, 1e-5);
}

TEST(Kinematics, ErrorsOfZeroChangeNothing) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  RandomJoints joints(machine, 3);
  for (int i = 0; i < 100; ++i) {
    const JointVector q = joints.next();
    const Pose a = forward(machine, q, machine.tool_vector());
    const Pose b = forward(machine, q, machine.tool_vector(), ChainErrors{});
    EXPECT_EQ((a.p - b.p).norm(), 0.0);
    EXPECT_EQ((a.R - b.R).norm(), 0.0);
  }
}

TEST(Kinematics, UnreachableAxisSaysByHowMuch) {
  const Machine machine = test::shipped_machine("nutating_45");  // tilts to 90 deg at the most
  const auto solutions = rotary_solutions(machine, Vec3(0, std::sin(1.7), std::cos(1.7)), 0.0);
  EXPECT_EQ(solutions.count, 0u);
  EXPECT_NEAR(solutions.missing_by.rad(), 1.7 - kPi / 2, 1e-9);
}

TEST(Kinematics, WordsAndJointsAreInverse) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.work_offset_mm = Vec3(10, 20, 30);
  RandomJoints joints(machine, 5);
  const JointVector q = joints.next();
  const JointVector words = words_of(machine, q, machine.tool_vector());
  EXPECT_NEAR(words[2], q[2] - 150.0 - 30.0, 1e-12);
  const JointVector back = joints_of_words(machine, words, machine.tool_vector());
  for (AxisId id = 0; id < 5; ++id) EXPECT_NEAR(back[id], q[id], 1e-12);
}

}  // namespace
}  // namespace trunnion
