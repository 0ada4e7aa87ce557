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

// As many as T holds, in the order in which they are asked for.
template <class T>
struct SideBySide {
  std::array<lanes::Mask<T>, 2> within;
  lanes::Mask<T> known;
  RotarySolver::Positions<T> positions;

  SideBySide(const RotarySolver& solver, const std::array<Vec3, 4>& axis_P) {
    RotarySolver::Turned<T> turned;
    solver.turn_to(lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return axis_P[k]; }),
                   turned);
    solver.find_positions(turned, {true, true}, positions);
    within = turned.within;
    known = turned.known;
  }
  // Those of one of them are what `solve_within_limits` finds; gives how many.
  std::size_t expect(std::size_t k, const RotarySolutions& one, const std::string& name) const {
    const auto lane = static_cast<int>(k);
    if (known[lane] == 0) {
      EXPECT_TRUE(one.count == 0 || !one.at[0].sines_known) << name;
      return 0;
    }
    std::size_t next = 0;
    for (std::size_t branch = 0; branch < 2; ++branch) {
      if (within[branch][lane] == 0) continue;
      EXPECT_LT(next, one.count) << name;
      const RotarySolution& s = one.at[next++];
      EXPECT_EQ(s.branch, branch);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        EXPECT_EQ(positions.angle[branch][axis][lane], s.angle[axis]);
        EXPECT_EQ(positions.sin[branch][axis][lane], s.sines.sin[axis]);
        EXPECT_EQ(positions.cos[branch][axis][lane], s.sines.cos[axis]);
      }
    }
    EXPECT_EQ(next, one.count);
    return next;
  }
};

TRUNNION_FOUR std::size_t expect_of_four(const RotarySolver& solver, const std::array<Vec3, 4>& axis_P,
                                         std::size_t k, const RotarySolutions& one, const std::string& name) {
  return SideBySide<Quads>(solver, axis_P).expect(k, one, name);
}

// Two and four at a time give the same bits as one.
TEST(RotarySolver, SideBySideAreTheSolutionsThatLimitsLeave) {
  std::mt19937_64 random(20261123);
  std::array<std::size_t, 3> cases{};
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    if (machine.rotary_axes().size() < 2) continue;
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      std::array<Vec3, 4> axis_P;
      for (Vec3& axis : axis_P) axis = random_axis(random);
      if (i % 10 == 0) axis_P[1] = axis_P[3] = Vec3::UnitZ();
      const SideBySide<Lanes> two(solver, axis_P);
      for (std::size_t k = 0; k < 4; ++k) {
        const RotarySolutions one = solver.solve_within_limits(axis_P[k], 0.3);
        if (k < 2) ++cases[two.expect(k, one, name)];
        if (lanes::four_at_a_time()) ++cases[expect_of_four(solver, axis_P, k, one, name)];
      }
    }
  }
  for (const std::size_t count : cases) EXPECT_GT(count, 100U);
}

TEST(RotarySolver, SaysWhereBothBranchesAreWithinTheLimits) {
  std::mt19937_64 random(20261122);
  std::array<std::size_t, 2> cases{};
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const RotarySolver solver(machine);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 axis_P = random_axis(random);
      const bool both = solver.solve_within_limits(axis_P, 0.3).count == 2;
      EXPECT_EQ(solver.surely_on_both(axis_P), both) << name;
      ++cases[both ? 1 : 0];
    }
  }
  for (const std::size_t count : cases) EXPECT_GT(count, 100U);
}

}  // namespace
}  // namespace trunnion
