#include "trunnion/machine/table_kinematics.hpp"

#include <gtest/gtest.h>
#include <random>

#include "support/machines.hpp"

namespace trunnion {
namespace {

Axis linear(const char* name, const Vec3& direction) {
  Axis axis;
  axis.name = name;
  axis.direction = direction;
  return axis;
}
Axis rotary(const char* name, const Vec3& direction, const Vec3& point) {
  Axis axis = linear(name, direction.normalized());
  axis.kind = AxisKind::rotary;
  axis.point_mm = point;
  return axis;
}

// Axes X Y Z (skewed) and up to two rotary ones, in the chains given by index.
Machine made(std::vector<AxisId> tool, std::vector<AxisId> part, std::size_t axes) {
  Machine m;
  m.axes = {linear("X", Vec3(1.0, 0.02, 0.0).normalized()), linear("Y", Vec3(0.01, 1.0, -0.03).normalized()),
            linear("Z", Vec3(0.0, 0.1, 1.0).normalized()),
            rotary("A", Vec3(1.0, 0.2, -0.4), Vec3(3.0, 18.0, 110.0)),
            rotary("C", Vec3(-0.3, 0.1, 1.0), Vec3(3.0, -2.0, 7.0))};
  m.axes.resize(axes);
  m.tool_chain = std::move(tool);
  m.part_chain = std::move(part);
  for (const AxisId id : m.part_chain) m.axes[id].carries_part = true;
  m.tool_length_mm = 120.0;
  m.part_zero_mm = {5.0, -7.0, 30.0};
  return m;
}

void expect_the_pose_of_forward(const Machine& machine) {
  const TableKinematics kinematics(machine, machine.tool_vector());
  std::mt19937_64 random(20261121);
  std::uniform_real_distribution<double> mm(-300.0, 300.0);
  std::uniform_real_distribution<double> rad(-7.0, 7.0);
  for (int i = 0; i < 2000; ++i) {
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      q[id] = machine.axes[id].kind == AxisKind::linear ? mm(random) : rad(random);
    }
    const Pose X_PT = forward(machine, q);
    const ToolPose fast = kinematics.pose(q);
    ASSERT_LT((fast.tip_P - X_PT.p).norm(), 1e-10);
    ASSERT_LT((fast.axis_P - X_PT.R.col(2)).norm(), 1e-14);
    const Vec3 v(1.0, 2.0, 3.0);
    ASSERT_LT((kinematics.to_machine(v, kinematics.sines(q)) - part_in_machine(machine, q).R * v).norm(),
              1e-14 * 10);
    JointVector solved = q;
    for (AxisId id = 0; id < 3; ++id) solved[id] = 0.0;
    kinematics.solve_linear(fast.tip_P, kinematics.sines(q), solved);
    // Compared at the tip: behind a rotary axis the linear axes may be nearly in one plane, and q is then
    // loose.
    ASSERT_LT((forward(machine, solved).p - X_PT.p).norm(), 1e-9);
  }
}

TEST(TableKinematics, GivesThePoseOfForwardOnEveryMachineFile) {
  for (const std::string& name : test::shipped_machines()) {
    SCOPED_TRACE(name);
    expect_the_pose_of_forward(test::shipped_machine(name));
  }
}

TEST(TableKinematics, GivesThePoseOfForwardWithLinearAxesAnywhereInThePartsChain) {
  expect_the_pose_of_forward(made({0, 1, 2}, {3, 4}, 5));
  expect_the_pose_of_forward(made({2}, {1, 0, 3, 4}, 5));
  expect_the_pose_of_forward(made({2, 1}, {3, 0, 4}, 5));
  expect_the_pose_of_forward(made({}, {1, 3, 0, 4, 2}, 5));
}

TEST(TableKinematics, GivesThePoseOfForwardWithOneRotaryAxisAndWithNone) {
  expect_the_pose_of_forward(made({0, 1, 2}, {3}, 4));
  expect_the_pose_of_forward(made({2}, {0, 3, 1}, 4));
  expect_the_pose_of_forward(made({0, 2}, {1}, 3));
}

}  // namespace
}  // namespace trunnion
