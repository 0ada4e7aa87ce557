#include "trunnion/machine/error_kinematics.hpp"

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

// `forward` makes products of poses: another way to the same place.
void expect_the_pose_of_forward(const Machine& machine, double mm, double rad) {
  const Vec3 tool = machine.tool_vector();
  const ErrorKinematics kinematics(machine, tool);
  std::mt19937_64 random(20261121);
  std::uniform_real_distribution<double> length(-300.0, 300.0);
  std::uniform_real_distribution<double> angle(-7.0, 7.0);
  for (int i = 0; i < 1000; ++i) {
    JointVector q;
    ChainErrors errors;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      q[id] = machine.axes[id].kind == AxisKind::linear ? length(random) : angle(random);
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
