#include "trunnion/thermal/offsets.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "support/machines.hpp"

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
  const auto again = parse_offsets(offsets_text(*table, {" note"}), "again.csv", diagnostics);
  ASSERT_TRUE(again);
  EXPECT_NEAR(again->at_time(25.0).x(), 0.0025, 1e-15);
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

class OffsetsOn : public testing::TestWithParam<std::string> {};

// The chain with the offset as an error deviates by the offset, in the frame that it names.
TEST_P(OffsetsOn, AreDeviationsOfTheChain) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      q[id] = uniform(random) * (machine.axes[id].kind == AxisKind::rotary ? 1.0 : 100.0);
    const Vec3 d(0.01 * uniform(random), 0.01 * uniform(random), 0.01 * uniform(random));
    const Pose nominal = forward(machine, q);
    const Mat3 R_MP = part_in_machine(machine, q).R;
    const Vec3 in_machine =
        R_MP *
        (forward(machine, q, machine.tool_vector(), chain_errors(d, OffsetFrame::machine)).p - nominal.p);
    const Vec3 in_part =
        forward(machine, q, machine.tool_vector(), chain_errors(d, OffsetFrame::part)).p - nominal.p;
    EXPECT_LT((in_machine - d).norm(), 1e-12);
    EXPECT_LT((in_part - d).norm(), 1e-12);
  }
}

// The frame trap: under TCP control the work offset turns with the table. What the control does with the
// offset is modelled here on its own: with TCP it moves the program point in P, without it the axes in M.
TEST_P(OffsetsOn, WorkOffsetsTakeTheDeviationOutAtAnyPose) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double worst_mm = 0.0;
  double worst_in_the_trap_mm = 0.0;
  for (int i = 0; i < 200; ++i) {
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      q[id] = uniform(random) * (machine.axes[id].kind == AxisKind::rotary ? 1.0 : 100.0);
    const Vec3 d(0.02 * uniform(random), 0.02 * uniform(random), 0.02 * uniform(random));
    const Vec3 wanted_P = forward(machine, q).p;
    for (const OffsetFrame frame : {OffsetFrame::machine, OffsetFrame::part}) {
      for (const bool tcp : {true, false}) {
        const Vec3 shift = work_offset_shift(machine, q, d, frame, tcp);
        // The control's new axis positions: with TCP for the shifted program point, else the words plus the
        // offset.
        const Vec3 moved_P = tcp ? Vec3(wanted_P + shift)
                                 : Vec3(part_in_machine(machine, q).inverse() *
                                        (part_in_machine(machine, q) * wanted_P + shift));
        JointVector moved = q;
        solve_linear(machine, moved_P, machine.tool_vector(), moved);
        const Vec3 actual_P = forward(machine, moved, machine.tool_vector(), chain_errors(d, frame)).p;
        worst_mm = std::max(worst_mm, (actual_P - wanted_P).norm());
      }
    }
    // -d as a work offset under TCP control: what the paper's system would send.
    JointVector trapped = q;
    solve_linear(machine, wanted_P - d, machine.tool_vector(), trapped);
    const Vec3 left =
        forward(machine, trapped, machine.tool_vector(), chain_errors(d, OffsetFrame::machine)).p - wanted_P;
    worst_in_the_trap_mm = std::max(worst_in_the_trap_mm, left.norm());
  }
  EXPECT_LT(worst_mm, 1e-9);
  EXPECT_GT(worst_in_the_trap_mm, 0.01);
}

INSTANTIATE_TEST_SUITE_P(ShippedMachines, OffsetsOn, testing::ValuesIn(test::shipped_machines()),
                         [](const auto& machine) { return machine.param; });

}  // namespace
}  // namespace trunnion::thermal
