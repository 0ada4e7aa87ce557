#include "trunnion/path/held_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/cases.hpp"
#include "support/lanes.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

// At small tilts both branches reach nearly every point, at larger ones stretches between those that one
// reaches; through the pole, along it, and with rapids. `longest_mm`: of the steps of the tip.
std::vector<ChoicePoint> wandering(std::mt19937_64& random, std::size_t count, double max_tilt,
                                   double longest_mm = 0.2) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<ChoicePoint> out;
  Vec3 tip = Vec3::Zero();
  double x = 0.0, y = 0.0, dx = 0.0, dy = 0.0;
  std::size_t upright = 0;
  for (std::size_t i = 0; i < count; ++i) {
    ChoicePoint p;
    if (upright == 0 && random() % 300 == 0) upright = random() % 1500;
    if (upright > 0) {
      --upright;
      p.pose.axis_P = Vec3::UnitZ();
    } else {
      dx = 0.9 * dx + 0.02 * u(random);
      dy = 0.9 * dy + 0.02 * u(random);
      x = std::clamp(x + dx, -max_tilt, max_tilt);
      y = std::clamp(y + dy, -max_tilt, max_tilt);
      p.pose.axis_P = Vec3(x, y, 1.0).normalized();
    }
    tip = 0.999 * tip + longest_mm * Vec3(u(random), u(random), u(random));
    p.pose.tip_P = tip;
    p.where = {static_cast<std::uint32_t>(i + 1), 1};
    p.rapid = i == 0 || random() % 700 == 0;
    out.push_back(p);
  }
  return out;
}

class HeldRunOn : public ::testing::TestWithParam<std::string> {};

TEST_P(HeldRunOn, GivesWhatOneChoiceForAllPointsGives) {
  Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(3);
  constexpr int kEveryKind = 8;  // of limits, tilts and tolerances
  for (int i = 0; i < std::max(kEveryKind, test::cases(24)); ++i) {
    const AxisId inner = machine.rotary_axes().back();
    machine.axes[inner].cyclic = i % 3 != 2;
    machine.axes[inner].max = i % 3 == 2 ? (1.0 + i) * kPi : std::numeric_limits<double>::infinity();
    machine.axes[inner].min = -machine.axes[inner].max;
    ChoiceOptions options;
    options.tool_mm = machine.tool_vector();
    const auto path =
        wandering(random, 500 + random() % 5000,
                  std::array{0.1, 0.4, 0.8, 1.2}[static_cast<std::size_t>(i) % 4], i % 5 == 0 ? 300.0 : 0.2);
    JointVector seed;
    seed[inner] = 0.5;
    std::vector<ChosenPoint> at_once;
    ChoiceSummary summary_at_once;
    ASSERT_TRUE(choose_solutions(machine, {path, seed, "part.cls"}, options, at_once, summary_at_once));

    ChoiceOptions other = options;
    if (i % 8 == 0) other.axis_tolerance = Angle::degrees(1.0);
    HeldRun held(machine, seed, other, "part.cls");
    for (std::size_t k = 0; k < path.size();) {
      const std::size_t n = std::min<std::size_t>(path.size() - k, 1 + random() % 1500);
      held.add(std::span(path).subspan(k, n));
      k += n;
    }
    ASSERT_EQ(held.size(), path.size());
    ASSERT_TRUE(held.finish(options));
    const ChosenPoint last = held.last();
    std::vector<ChoicePoint> points;
    std::vector<ChosenPoint> chosen(path.size());
    ChoiceSummary summary;
    const auto next = [&] {
      const auto left = std::span(chosen).subspan(points.size());
      return left.first(std::min<std::size_t>(left.size(), 1 + random() % 700));
    };
    while (held.take(next(), points, summary) > 0) continue;
    ASSERT_EQ(points.size(), path.size());
    for (std::size_t k = 0; k < path.size(); ++k) {
      ASSERT_EQ(points[k].pose.tip_P, path[k].pose.tip_P);
      ASSERT_EQ(points[k].pose.axis_P, path[k].pose.axis_P);
      ASSERT_EQ(points[k].where, path[k].where);
      ASSERT_EQ(points[k].rapid, path[k].rapid);
      // Lengths along the pole are summed in another order.
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        ASSERT_NEAR(chosen[k].q[id], at_once[k].q[id], 1e-9) << k;
        ASSERT_NEAR(chosen[k].q_leave[id], at_once[k].q_leave[id], 1e-9) << k;
      }
      ASSERT_EQ(chosen[k].branch, at_once[k].branch);
      ASSERT_EQ(chosen[k].singular, at_once[k].singular);
      ASSERT_EQ(chosen[k].reconfigure, at_once[k].reconfigure);
    }
    EXPECT_EQ(last.q, chosen.back().q);
    EXPECT_EQ(last.q_leave, chosen.back().q_leave);
    EXPECT_NEAR(summary.axis_time_s, summary_at_once.axis_time_s, 1e-6);
    EXPECT_EQ(summary.branch_changes, summary_at_once.branch_changes);
    EXPECT_EQ(summary.turns_in_place, summary_at_once.turns_in_place);
    EXPECT_EQ(summary.pole_points, summary_at_once.pole_points);
  }
}

std::vector<ChosenPoint> held_in_steps(const Machine& machine, const std::vector<ChoicePoint>& path,
                                       std::size_t step) {
  ChoiceOptions options;
  options.tool_mm = machine.tool_vector();
  HeldRun held(machine, {}, options, "part.cls");
  for (std::size_t k = 0; k < path.size(); k += step)
    held.add(std::span(path).subspan(k, std::min(step, path.size() - k)));
  EXPECT_TRUE(held.finish(options));
  std::vector<ChoicePoint> points;
  std::vector<ChosenPoint> chosen(path.size());
  ChoiceSummary summary;
  held.take(chosen, points, summary);
  return chosen;
}

// Points that come one by one are looked at one by one; else four or two.
TEST_P(HeldRunOn, GivesTheSameHoweverManyComeAtATime) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(5);
  for (int i = 0; i < 6; ++i) {
    const auto path = wandering(random, 3000, i % 2 == 0 ? 0.1 : 0.4);
    const auto one_by_one = held_in_steps(machine, path, 1);
    for (const lanes::Way way : test::kEveryWay) {
      const test::Calculating lanes(way);
      const auto many = held_in_steps(machine, path, path.size());
      ASSERT_EQ(many.size(), one_by_one.size());
      for (std::size_t k = 0; k < path.size(); ++k) {
        ASSERT_EQ(many[k].q, one_by_one[k].q) << k;
        ASSERT_EQ(many[k].q_leave, one_by_one[k].q_leave) << k;
        ASSERT_EQ(many[k].reconfigure, one_by_one[k].reconfigure) << k;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, HeldRunOn, ::testing::ValuesIn(test::shipped_machines()));

ChoicePoint tilted(double tilt_deg, double azimuth, const Vec3& tip_P) {
  ChoicePoint p;
  const double tilt = tilt_deg * kRadPerDegree;
  p.pose.axis_P =
      Vec3(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
  p.pose.tip_P = tip_P;
  return p;
}

// What is chosen at once, which looks for the shorter way only where there may be one, and in a run that is
// held, which always does; the number of points on the branch that the ends are not on.
std::size_t points_on_the_other_branch(const std::vector<ChoicePoint>& path, Angle axis_tolerance) {
  Machine machine = test::shipped_machine("nutating_45");
  Axis& outer = machine.axes[machine.rotary_axes().front()];
  outer.cyclic = false;
  outer.min = -60.0 * kRadPerDegree;  // 41 degrees of tilt; on the other side all
  outer.max = 180.0 * kRadPerDegree;
  ChoiceOptions options;
  options.tool_mm = machine.tool_vector();
  options.axis_tolerance = axis_tolerance;
  std::vector<ChosenPoint> at_once;
  ChoiceSummary summary;
  EXPECT_TRUE(choose_solutions(machine, {path, {}, "part.cls"}, options, at_once, summary));
  HeldRun held(machine, {}, options, "part.cls");
  held.add(path);
  EXPECT_TRUE(held.finish(options));
  std::vector<ChoicePoint> points;
  std::vector<ChosenPoint> chosen(path.size());
  held.take(chosen, points, summary);
  std::size_t out = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(at_once[i].q, chosen[i].q) << i;
    EXPECT_EQ(at_once[i].reconfigure, chosen[i].reconfigure) << i;
    out += chosen[i].branch != chosen.front().branch ? 1U : 0U;
  }
  return out;
}

struct ToAndFro {
  std::size_t count = 100;
  bool rapids = false;
  double by_way_of_deg = 25.0;
};
// From 50 degrees, where one position reaches a point, to 25, where two do, and back. There the tip goes to
// and fro in a direction across the tool that is nearer to that of an axis on one branch than on the other.
std::vector<ChoicePoint> to_and_fro(const ToAndFro& how, double direction) {
  std::vector<ChoicePoint> out;
  const auto at = [&](double tilt, const Vec3& tip_P) { out.push_back(tilted(tilt, 0.3, tip_P)); };
  for (double tilt = 50.0; tilt > how.by_way_of_deg; tilt -= 1.0) at(tilt, Vec3::Zero());
  for (double tilt = how.by_way_of_deg; tilt < 25.0; tilt += 1.0) at(tilt, Vec3::Zero());
  const Vec3 axis_P = tilted(25.0, 0.3, Vec3::Zero()).pose.axis_P;
  const Vec3 across = axis_P.unitOrthogonal();
  const Vec3 way = std::cos(direction) * across + std::sin(direction) * axis_P.cross(across);
  for (std::size_t i = 0; i < how.count; ++i) {
    const bool is_end = i == 0 || i + 1 == how.count;
    at(25.0, is_end ? Vec3(Vec3::Zero()) : Vec3((i % 2 == 0 ? 150.0 : -150.0) * way));
    out.back().rapid = how.rapids && is_end;
  }
  for (double tilt = 25.0; tilt > how.by_way_of_deg; tilt -= 1.0) at(tilt, Vec3::Zero());
  for (double tilt = how.by_way_of_deg; tilt < 51.0; tilt += 1.0) at(tilt, Vec3::Zero());
  out.front().rapid = true;
  return out;
}

std::size_t most_on_the_other_branch(const ToAndFro& how, double axis_tolerance_deg) {
  std::size_t out = 0;
  for (int i = 0; i < 16; ++i) {
    const auto path = to_and_fro(how, i * kPi / 16.0);
    out = std::max(out, points_on_the_other_branch(path, Angle::degrees(axis_tolerance_deg)));
  }
  return out;
}

TEST(HeldRun, ALongStretchMayBeWorthLeavingThePart) {
  EXPECT_GT(most_on_the_other_branch({.count = 3000}, 0.05), 2000U);
  EXPECT_EQ(most_on_the_other_branch({.count = 100}, 0.05), 0U);
}

TEST(HeldRun, ARapidMayChangeTheBranch) {
  EXPECT_GT(most_on_the_other_branch({.count = 100, .rapids = true}, 0.05), 50U);
}

// Within a fifth of the tolerance of it.
TEST(HeldRun, ThePoleMayChangeTheBranch) {
  EXPECT_GT(most_on_the_other_branch({.count = 100, .by_way_of_deg = 4.0}, 30.0), 50U);
  EXPECT_EQ(most_on_the_other_branch({.count = 100, .by_way_of_deg = 8.0}, 30.0), 0U);
  EXPECT_EQ(most_on_the_other_branch({.count = 100, .by_way_of_deg = 4.0}, 0.05), 0U);
}

// C goes round by `turns` at one tilt.
std::vector<ChoicePoint> winding(double turns) {
  std::vector<ChoicePoint> out;
  const auto count = static_cast<std::size_t>(40.0 * turns);
  for (std::size_t i = 0; i <= count; ++i) {
    out.push_back(tilted(30.0, turns * kTwoPi * static_cast<double>(i) / static_cast<double>(count),
                         Vec3(1.0, 2.0, 3.0)));
    out.back().rapid = i == 0;
  }
  return out;
}

// The joints of a held run on a machine whose C has these limits (turns), from where C stands.
std::vector<ChosenPoint> on_limits(double least, double most, const std::vector<ChoicePoint>& path,
                                   const JointVector& seed) {
  Machine machine = test::shipped_machine("paper");
  machine.axes[4].cyclic = false;
  machine.axes[4].min = least * kTwoPi;
  machine.axes[4].max = most * kTwoPi;
  ChoiceOptions options;
  options.tool_mm = machine.tool_vector();
  HeldRun held(machine, seed, options, "part.cls");
  held.add(path);
  EXPECT_TRUE(held.finish(options));
  std::vector<ChoicePoint> points;
  std::vector<ChosenPoint> chosen(path.size());
  ChoiceSummary summary;
  held.take(chosen, points, summary);
  std::vector<ChosenPoint> at_once;
  EXPECT_TRUE(choose_solutions(machine, {path, seed, "part.cls"}, options, at_once, summary));
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(at_once[i].q, chosen[i].q) << i;
    EXPECT_TRUE(machine.axes[4].within_limits(chosen[i].q[4])) << i;
  }
  return chosen;
}

// Limits many turns away are left out of the choice at first.
TEST(LongHeldRun, FarLimitsBindWhereThePathComesToThemOnly) {
  const auto reconfigures = [](const std::vector<ChosenPoint>& chosen) {
    return std::count_if(chosen.begin(), chosen.end(), [](const ChosenPoint& p) { return p.reconfigure; });
  };
  JointVector seed;
  for (const double begins : {-12.0, 0.0, 12.0}) {
    seed[4] = begins * kTwoPi;
    const auto path = winding(9.0);
    const auto bounded = on_limits(-14.0, 14.0, path, seed);
    EXPECT_EQ(reconfigures(bounded), 0) << begins;
    const auto wide = on_limits(-1000.0, 1000.0, path, seed);
    if (begins < 0.0) {
      // C goes down by nine turns: the run begins some turns above where C stands.
      EXPECT_LT(wide.back().q[4], -14.0 * kTwoPi);
      EXPECT_GT(bounded.front().q[4], wide.front().q[4] + 6.0 * kTwoPi);
      continue;
    }
    for (std::size_t i = 0; i < path.size(); ++i) EXPECT_EQ(bounded[i].q, wide[i].q) << i;
  }
  // It goes round more often than it may.
  EXPECT_GE(reconfigures(on_limits(-14.0, 14.0, winding(30.0), {})), 1);
}

TEST(HeldRun, SaysWhichPointNothingReaches) {
  const Machine machine = test::shipped_machine("trunnion_offset");  // A from -30 to 120 deg
  std::vector<ChoicePoint> path(3000);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].where = {static_cast<std::uint32_t>(i + 1), 1};
  const double tilt = 130.0 * kRadPerDegree;
  path[2500].pose.axis_P = Vec3(0, std::sin(tilt), std::cos(tilt));
  ChoiceOptions options;
  options.tool_mm = machine.tool_vector();
  HeldRun held(machine, {}, options, "part.cls");
  held.add(path);
  const auto done = held.finish(options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().text().substr(0, 14), "part.cls:2501:");
}

}  // namespace
}  // namespace trunnion::path
