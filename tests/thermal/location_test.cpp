#include "trunnion/thermal/location.hpp"

#include <gtest/gtest.h>

#include "support/machines.hpp"

namespace trunnion::thermal {
namespace {

// Readings along X and Y at each pose, from the exact chain with errors (not from the linearisation that is
// fitted).
std::vector<DriftReading> readings_at(const Machine& machine,
                                      const std::vector<std::array<double, 2>>& poses_deg,
                                      const ChainErrors& axis_errors, const Vec3& tool_M, bool probed) {
  const AxisId A = *machine.axis("A");
  const AxisId C = *machine.axis("C");
  const auto d_P = [&](const JointVector& q, const ChainErrors& e) {
    return Vec3(forward(machine, q, machine.tool_vector(), e).p - forward(machine, q).p);
  };
  std::vector<DriftReading> out;
  for (const auto& [a_deg, c_deg] : poses_deg) {
    JointVector q;
    q[A] = Angle::degrees(a_deg).rad();
    q[C] = Angle::degrees(c_deg).rad();
    Vec3 d = d_P(q, axis_errors);
    if (probed) d -= d_P(JointVector{}, axis_errors);
    const Vec3 d_M = part_in_machine(machine, q).R * d + tool_M;
    for (const Vec3& n : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())})
      out.push_back({q, n, n.dot(d_M), 0.001});
  }
  return out;
}

class DriftOf : public testing::TestWithParam<std::string> {};

TEST_P(DriftOf, TheCAxisIsToldFromTheToolAtFourAngles) {
  const Machine machine = test::shipped_machine(GetParam());
  ChainErrors errors;
  errors.joint[*machine.axis("C")].trans_mm = Vec3(0.020, 0.0, 0.0);
  const Vec3 tool(0.007, -0.004, 0.002);
  const JointVector zero{};
  const auto split = split_drift(
      machine, readings_at(machine, {{0, 0}, {0, 90}, {0, 180}, {0, 270}}, errors, tool, true), zero);
  ASSERT_TRUE(split);
  for (const auto& [name, value] : std::vector<std::pair<std::string, double>>{
           {"X0C", 0.020}, {"Y0C", 0.0}, {"tool_x", 0.007}, {"tool_y", -0.004}, {"tool_z", 0.002}}) {
    ASSERT_TRUE(split->find(name)) << name;
    EXPECT_TRUE(split->find(name)->identifiable) << name;
    EXPECT_NEAR(split->find(name)->value_mm, value, 1e-6) << name;
  }
  EXPECT_FALSE(split->find("Y0A")->identifiable);  // A never tilted
  // At another C the split predicts what the exact chain does.
  JointVector q;
  q[*machine.axis("C")] = 0.7;
  const auto there = readings_at(machine, {{0.0, Angle::radians(0.7).deg()}}, errors, tool, true);
  const auto predicted = split->deviation_M(machine, q, zero);
  ASSERT_TRUE(predicted);
  EXPECT_NEAR(predicted->x(), there[0].value_mm, 1e-6);
  EXPECT_NEAR(predicted->y(), there[1].value_mm, 1e-6);
}

TEST_P(DriftOf, OneAngleIsRefused) {
  const Machine machine = test::shipped_machine(GetParam());
  ChainErrors errors;
  errors.joint[*machine.axis("C")].trans_mm = Vec3(0.020, 0.0, 0.0);
  const JointVector zero{};
  const auto split = split_drift(machine, readings_at(machine, {{0, 90}}, errors, Vec3::Zero(), true), zero);
  ASSERT_TRUE(split);
  EXPECT_FALSE(split->find("X0C")->identifiable);
  EXPECT_FALSE(split->find("tool_x")->identifiable);
  EXPECT_EQ(split->rank, 3);
  EXPECT_FALSE(split->null_directions.empty());
  JointVector q;
  q[*machine.axis("C")] = 2.0;
  EXPECT_FALSE(split->deviation_M(machine, q, zero));
}

// A datum that was set cold rides: a common shift of tool and axes is never seen, and at A = 0 a shift of the
// C axis is one of the tool. What any pose does can be told all the same once A was tilted.
TEST_P(DriftOf, ARidingDatumNeedsTilt) {
  const Machine machine = test::shipped_machine(GetParam());
  ChainErrors errors;
  errors.joint[*machine.axis("C")].trans_mm = Vec3(0.0, 0.020, 0.0);
  JointVector q;
  q[*machine.axis("A")] = 0.5;
  const auto there = readings_at(machine, {{Angle::radians(0.5).deg(), 0.0}}, errors, Vec3::Zero(), false);
  const auto flat = split_drift(
      machine, readings_at(machine, {{0, 0}, {0, 90}, {0, 180}, {0, 270}}, errors, Vec3::Zero(), false), {});
  EXPECT_FALSE(flat->find("Y0C")->identifiable);
  EXPECT_FALSE(flat->deviation_M(machine, q, {}));
  const auto tilted = split_drift(
      machine, readings_at(machine, {{0, 0}, {60, 0}, {90, 120}}, errors, Vec3::Zero(), false), {});
  EXPECT_FALSE(tilted->find("Y0C")->identifiable);
  const auto predicted = tilted->deviation_M(machine, q, {});
  ASSERT_TRUE(predicted);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR((*predicted)[static_cast<Eigen::Index>(i)], there[i].value_mm, 1e-6);
}

// After a probing everything comes apart when both axes are turned.
TEST_P(DriftOf, TurningBothAxesSeparatesAll) {
  const Machine machine = test::shipped_machine(GetParam());
  ChainErrors errors;  // A shifts by dA alone: C, which it carries, shifts back
  errors.joint[*machine.axis("A")].trans_mm = Vec3(0.0, 0.011, -0.006);
  errors.joint[*machine.axis("C")].trans_mm = Vec3(0.020, -0.011, 0.006);
  const Vec3 tool(0.007, -0.004, 0.002);
  const auto split = split_drift(
      machine, readings_at(machine, {{0, 0}, {0, 120}, {0, 240}, {45, 0}, {90, 90}}, errors, tool, true),
      JointVector{});
  ASSERT_TRUE(split);
  EXPECT_TRUE(split->null_directions.empty());
  EXPECT_EQ(split->rank, 7);
  for (const auto& [name, value] : std::vector<std::pair<std::string, double>>{{"X0C", 0.020},
                                                                               {"Y0C", 0.0},
                                                                               {"Y0A", 0.011},
                                                                               {"Z0A", -0.006},
                                                                               {"tool_x", 0.007},
                                                                               {"tool_y", -0.004},
                                                                               {"tool_z", 0.002}}) {
    EXPECT_NEAR(split->find(name)->value_mm, value, 2e-6) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Trunnions, DriftOf, testing::Values("paper", "trunnion_offset", "xyzac_trt"),
                         [](const auto& machine) { return machine.param; });

// research: 50, 50, 10 um read literally turns the table by 82 deg.
TEST(PaperMapping, TurnsTheTableByTensOfDegrees) {
  const PaperAngles angles = paper_offset_to_angles(Vec3(0.05, 0.05, 0.01));
  EXPECT_NEAR(angles.A.deg(), 81.95, 0.01);
  EXPECT_NEAR(angles.C.deg(), 45.0, 1e-9);
}

}  // namespace
}  // namespace trunnion::thermal
