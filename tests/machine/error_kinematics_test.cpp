#include "trunnion/machine/error_kinematics.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/machines.hpp"

namespace trunnion {
namespace {

Twist random_twist(std::mt19937_64& random, double mm, double rad) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&](double size) {
    return Vec3(size * Vec3(unit(random), unit(random), unit(random)));
  };
  return {vector(mm), vector(rad)};
}

// Rotary axes turn more than once.
JointVector random_position(const Machine& machine, std::mt19937_64& random) {
  std::uniform_real_distribution<double> length(-300.0, 300.0);
  std::uniform_real_distribution<double> angle(-7.0, 7.0);
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    q[id] = machine.axes[id].kind == AxisKind::linear ? length(random) : angle(random);
  return q;
}

// `forward` makes products of poses: another way to the same place.
void expect_the_pose_of_forward(const Machine& machine, double mm, double rad) {
  const Vec3 tool = machine.tool_vector();
  const ErrorKinematics kinematics(machine, tool);
  std::mt19937_64 random(20261121);
  for (int i = 0; i < 1000; ++i) {
    const JointVector q = random_position(machine, random);
    ChainErrors errors;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      if (i % 3 > 0) errors.joint[id] = random_twist(random, mm, i % 3 == 1 ? rad : 0.0);
    }
    if (i % 2 > 0) errors.spindle = random_twist(random, mm, rad);
    if (i % 5 > 0) errors.part = random_twist(random, mm, rad);
    const Pose X_PT = forward(machine, q, tool, errors);
    const ToolPose pose = kinematics.pose(q, errors);
    ASSERT_LT((pose.tip_P - X_PT.p).norm(), 1e-10);
    ASSERT_LT((pose.axis_P - X_PT.R.col(2)).norm(), 1e-13);
  }
}

// Some links always have the same errors, and two or four positions stand side by side.
void expect_the_same_held_and_in_pairs(const Machine& machine, double mm, double rad) {
  const Vec3 tool = machine.tool_vector();
  std::mt19937_64 random(20261122);
  for (int i = 0; i < 300; ++i) {
    ChainErrors constant;
    ChainLinks varying;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      varying.joint[id] = (i >> id) % 2 == 0;
      constant.joint[id] = random_twist(random, mm, i % 4 == 0 ? 0.0 : rad);
    }
    varying.spindle = i % 3 == 0;
    varying.part = i % 5 == 0;
    constant.spindle = random_twist(random, mm, rad);
    if (i % 7 > 0) constant.part = random_twist(random, mm, rad);
    std::array<JointVector, 2> q;
    std::array<ChainErrors, 2> errors{constant, constant};
    for (std::size_t k = 0; k < 2; ++k) {
      q[k] = random_position(machine, random);
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        if (varying.joint[id]) errors[k].joint[id] = random_twist(random, mm, i % 2 == 0 ? 0.0 : rad);
      }
      if (varying.spindle) errors[k].spindle = random_twist(random, mm, rad);
      if (varying.part) errors[k].part = random_twist(random, mm, rad);
    }
    std::array<RotarySines, 2> sines{};
    for (std::size_t k = 0; k < 2; ++k) {
      sines[k].cos = {1.0, 1.0};
      std::size_t rotary = 0;
      for (const AxisId id : machine.part_chain) {
        if (machine.axes[id].kind != AxisKind::rotary) continue;
        sines[k].sin[rotary] = std::sin(q[k][id]);
        sines[k].cos[rotary++] = std::cos(q[k][id]);
      }
    }
    ErrorKinematics held(machine, tool);
    held.hold(constant, varying);
    // Of the lanes the first and the last are the first position.
    const auto expect_side_by_side = [&]<class T>() {
      const auto of = [](std::size_t lane) { return lane % 3 == 0 ? 0U : 1U; };
      JointsOf<T> joints;
      for (AxisId id = 0; id < kMaxAxes; ++id)
        joints[id] = lanes::collect<T>([&](std::size_t lane) { return q[of(lane)][id]; });
      ChainErrorsOf<T> columns;
      TableKinematics::SinesOf<T> sines_of;
      for (std::size_t r = 0; r < 2; ++r) {
        sines_of.sin[r] = lanes::collect<T>([&](std::size_t lane) { return sines[of(lane)].sin[r]; });
        sines_of.cos[r] = lanes::collect<T>([&](std::size_t lane) { return sines[of(lane)].cos[r]; });
      }
      for (std::size_t lane = 0; lane < lanes::kCount<T>; ++lane)
        columns.put(static_cast<int>(lane), errors[of(lane)], varying);
      const auto tips = held.tips<T>(joints, sines_of, columns);
      const auto poses = held.poses<T>(joints, sines_of, columns);
      const auto axes = held.axes<T>(sines_of, columns);
      for (std::size_t n = 0; n < lanes::kCount<T>; ++n) {
        const int lane = static_cast<int>(n);
        ASSERT_EQ(tips.known[lane], poses.known[lane]);
        ASSERT_EQ(axes.known[lane], poses.known[lane]);
        ASSERT_TRUE(rad > 0.01 || poses.known[lane] != 0);
        if (poses.known[lane] == 0) continue;
        const Pose X_PT = forward(machine, q[of(n)], tool, errors[of(n)]);
        const auto vector = [lane](const lanes::Triple<T>& v) {
          return Vec3(v.x[lane], v.y[lane], v.z[lane]);
        };
        ASSERT_LT((vector(tips.tip_P) - X_PT.p).norm(), 1e-10);
        ASSERT_LT((vector(poses.tip_P) - X_PT.p).norm(), 1e-10);
        ASSERT_LT((vector(poses.axis_P) - X_PT.R.col(2)).norm(), 1e-13);
        ASSERT_LT((vector(axes.axis_P) - X_PT.R.col(2)).norm(), 1e-13);
      }
    };
    expect_side_by_side.operator()<Lanes>();
    expect_side_by_side.operator()<Quads>();
    for (std::size_t k = 0; k < 2; ++k) {
      const Pose X_PT = forward(machine, q[k], tool, errors[k]);
      const ToolPose pose = held.pose(q[k], errors[k]);
      ASSERT_LT((pose.tip_P - X_PT.p).norm(), 1e-10) << machine.name << " " << i;
      ASSERT_LT((pose.axis_P - X_PT.R.col(2)).norm(), 1e-13) << machine.name << " " << i;
    }
  }
}

TEST(ErrorKinematics, HoldsWhatNeverChangesAndGoesInPairs) {
  for (const std::string& name : test::shipped_machines()) {
    expect_the_same_held_and_in_pairs(test::shipped_machine(name), 0.05, 1e-4);
  }
  expect_the_same_held_and_in_pairs(test::shipped_machine("nutating_45"), 3.0, 0.3);
}

TEST(ErrorKinematics, GivesThePoseOfForwardWithErrors) {
  for (const std::string& name : test::shipped_machines()) {
    expect_the_pose_of_forward(test::shipped_machine(name), 0.05, 1e-4);
  }
}

TEST(ErrorKinematics, GivesThePoseOfForwardWithErrorsBeyondTheSeries) {
  expect_the_pose_of_forward(test::shipped_machine("nutating_45"), 3.0, 0.3);
}

}  // namespace
}  // namespace trunnion
