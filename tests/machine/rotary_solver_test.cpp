#include "trunnion/machine/rotary_solver.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/machine/axis_turn.hpp"

#include "support/machines.hpp"

namespace trunnion {
namespace {

Vec3 random_axis(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Vec3 v(normal(random), normal(random), normal(random));
  return v.normalized();
}

// `forward` turns the part back by the angles found: another way to the same axis.
TEST(RotarySolver, EverySolutionTurnsTheToolAxisIntoTheSpindle) {
  std::mt19937_64 random(20261121);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const std::vector<AxisId> rotary = machine.rotary_axes();
    if (rotary.size() < 2) continue;
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 axis_P = random_axis(random);
      const RotarySolutions found = solver.solve(axis_P, 0.3);
      for (std::size_t k = 0; k < found.count; ++k) {
        const RotarySolution& s = found.at[k];
        JointVector q;
        for (std::size_t j = 0; j < 2; ++j) {
          q[rotary[j]] = s.angle[j];
          ASSERT_TRUE(s.sines_known);
          ASSERT_NEAR(s.sines.sin[j], std::sin(s.angle[j]), 4e-16);
          ASSERT_NEAR(s.sines.cos[j], std::cos(s.angle[j]), 4e-16);
        }
        ASSERT_LT((forward(machine, q).R.col(2) - axis_P).norm(), 1e-7) << name;
      }
    }
  }
}

// Two at a time give the same bits as one.
TEST(RotarySolver, SolvePairGivesTheSolutionsThatLimitsLeave) {
  std::mt19937_64 random(20261123);
  std::array<std::size_t, 3> cases{};
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    if (machine.rotary_axes().size() < 2) continue;
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      const std::array<Vec3, 2> axis_P = {random_axis(random),
                                          i % 10 == 0 ? Vec3(Vec3::UnitZ()) : random_axis(random)};
      const auto side_by_side = [&](Eigen::Index k) { return Lanes{axis_P[0][k], axis_P[1][k]}; };
      RotarySolver::Together<Lanes> pair;
      solver.solve_together<Lanes>({side_by_side(0), side_by_side(1), side_by_side(2)}, {true, true}, pair);
      for (int lane = 0; lane < 2; ++lane) {
        const RotarySolutions one = solver.solve_within_limits(axis_P[static_cast<std::size_t>(lane)], 0.3);
        if (pair.known[lane] == 0) {
          EXPECT_TRUE(one.count == 0 || !one.at[0].sines_known) << name;
          continue;
        }
        std::size_t next = 0;
        for (std::size_t branch = 0; branch < 2; ++branch) {
          if (pair.within[branch][lane] == 0) continue;
          ASSERT_LT(next, one.count) << name;
          const RotarySolution& s = one.at[next++];
          EXPECT_EQ(s.branch, branch);
          for (std::size_t k = 0; k < 2; ++k) {
            EXPECT_EQ(pair.angle[branch][k][lane], s.angle[k]);
            EXPECT_EQ(pair.sin[branch][k][lane], s.sines.sin[k]);
            EXPECT_EQ(pair.cos[branch][k][lane], s.sines.cos[k]);
          }
        }
        EXPECT_EQ(next, one.count);
        ++cases[next];
      }
    }
  }
  for (const std::size_t count : cases) EXPECT_GT(count, 100U);
}

TEST(RotarySolver, OneOfTwoIsThatOfBothAndFarFromTheOther) {
  std::mt19937_64 random(20261124);
  std::array<std::size_t, 2> cases{};
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    if (machine.rotary_axes().size() < 2) continue;
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 axis_P = i % 20 == 0 ? Vec3(Vec3::UnitZ()) : random_axis(random);
      const RotarySolutions all = solver.solve(axis_P, 0.3);
      const RotarySolutions within = solver.solve_within_limits(axis_P, 0.3);
      for (std::uint8_t branch = 0; branch < 2; ++branch) {
        RotarySolution one;
        const bool found = solver.solve_one_of_two(axis_P, branch, one);
        ++cases[found ? 1 : 0];
        if (!found) continue;
        ASSERT_EQ(all.count, 2U) << name;
        EXPECT_GT(std::abs(std::remainder(all.at[0].angle[0] - all.at[1].angle[0], kTwoPi)),
                  RotarySolver::kApart_rad);
        const RotarySolution& same = within.at[within.at[0].branch == branch ? 0 : 1];
        ASSERT_EQ(same.branch, branch);
        EXPECT_EQ(one.angle, same.angle);
        EXPECT_EQ(one.sines.sin, same.sines.sin);
        EXPECT_EQ(one.sines.cos, same.sines.cos);
        EXPECT_TRUE(one.sines_known);
        EXPECT_EQ(solver.branch_of(one.angle[0]), branch);
      }
    }
  }
  for (const std::size_t count : cases) EXPECT_GT(count, 100U);
}

TEST(RotarySolver, LimitsLeaveOutWhatNoTurnBringsWithinThem) {
  std::mt19937_64 random(20261122);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const std::vector<AxisId> rotary = machine.rotary_axes();
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 axis_P = random_axis(random);
      const RotarySolutions all = solver.solve(axis_P, 0.3);
      const RotarySolutions left = solver.solve_within_limits(axis_P, 0.3);
      std::size_t next = 0;
      for (std::size_t k = 0; k < all.count; ++k) {
        bool reachable = true;
        for (std::size_t j = 0; j < rotary.size(); ++j) {
          reachable = reachable && nearest_turn(machine.axes[rotary[j]], all.at[k].angle[j], 0.0).has_value();
        }
        const bool kept = next < left.count && left.at[next].branch == all.at[k].branch;
        ASSERT_TRUE(kept || !reachable) << name;
        if (kept) {
          ASSERT_EQ(left.at[next].angle, all.at[k].angle);
          ++next;
        }
      }
      ASSERT_EQ(next, left.count);
    }
  }
}

TEST(RotarySines, FollowASmallTurn) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> angle(-7.0, 7.0);
  std::uniform_real_distribution<double> small(-RotarySines::kSmallTurn_rad, RotarySines::kSmallTurn_rad);
  for (int i = 0; i < 10000; ++i) {
    const double a = angle(random);
    const double by = small(random);
    RotarySines s;
    s.sin[1] = std::sin(a);
    s.cos[1] = std::cos(a);
    s.turn(1, by);
    ASSERT_NEAR(s.sin[1], std::sin(a + by), 1.2e-15);  // a + by is rounded by up to 9e-16
    ASSERT_NEAR(s.cos[1], std::cos(a + by), 1.2e-15);
    ASSERT_EQ(s.sin[0], 0.0);
  }
}

TEST(AxisTurn, IsTheRotationAboutItsAxis) {
  std::mt19937_64 random(20261124);
  std::uniform_real_distribution<double> angle(-7.0, 7.0);
  for (int i = 0; i < 4000; ++i) {
    Vec3 n = random_axis(random);
    if (i % 2 == 0) n = (i % 4 == 0 ? 1.0 : -1.0) * Vec3::Unit((i / 4) % 3);
    const Vec3 v = 300.0 * random_axis(random);
    const double a = angle(random);
    const Vec3 expected = rotation_about(n, Angle::radians(a)) * v;
    ASSERT_LT((AxisTurn(n).turned(v, std::sin(a), std::cos(a)) - expected).norm(), 5e-13);
  }
}

}  // namespace
}  // namespace trunnion
