#include "trunnion/path/solution_choice.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/machines.hpp"

namespace trunnion::path {
namespace {

ChoiceOptions options_for(const Machine& machine, ChoiceMethod method) {
  ChoiceOptions options;
  options.method = method;
  options.axis = "C";
  options.tool_mm = machine.tool_vector();
  return options;
}

// A smooth random path of the tool axis that may pass near the pole, tips on a small loop.
std::vector<ChoicePoint> random_path(std::mt19937_64& random, std::size_t count, double max_tilt) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const double a = u(random) * 3.0;
  const double b = u(random) * 3.0;
  const double c = u(random) * kPi;
  const double lean = std::abs(u(random)) * max_tilt;
  const double swing = std::abs(u(random)) * (max_tilt - lean);
  std::vector<ChoicePoint> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count);
    const double tilt = lean + swing * std::sin(6.0 * t + a);
    const double turn = 8.0 * t * b + c;
    ChoicePoint p;
    p.pose.axis_P = Vec3(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt));
    p.pose.tip_P = Vec3(30.0 * std::cos(5 * t), 30.0 * std::sin(4 * t), 10.0 * t);
    p.where = {static_cast<std::uint32_t>(i + 1), 1};
    p.rapid = i == 0;
    out.push_back(p);
  }
  return out;
}

double chosen_time(const Machine& machine, const std::vector<ChoicePoint>& path, const JointVector& seed,
                   ChoiceMethod method, ChoiceSummary& summary) {
  std::vector<ChosenPoint> out;
  const auto result =
      choose_solutions(machine, {path, seed, "part.cls"}, options_for(machine, method), out, summary);
  EXPECT_TRUE(result) << (result ? "" : result.error().text());
  EXPECT_EQ(out.size(), path.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const ToolPose pose = tool_pose(forward(machine, out[i].q));
    EXPECT_LT((pose.tip_P - path[i].pose.tip_P).norm(), 1e-9);
    EXPECT_LT(angle_between(pose.axis_P, path[i].pose.axis_P).rad(), 1e-11);
  }
  return summary.axis_time_s + kReconfigureSeconds * static_cast<double>(summary.reconfigurations);
}

TEST(SolutionChoice, GlobalIsNeverLongerThanAnyLocalMetric) {
  std::mt19937_64 random(11);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    if (!machine.axis("A")) continue;  // the named axis of the local metric
    for (int i = 0; i < 40; ++i) {
      const auto path = random_path(random, 300, name == "trunnion_offset" ? 1.9 : 1.4);
      const JointVector seed;
      ChoiceSummary global;
      const double least = chosen_time(machine, path, seed, ChoiceMethod::global, global);
      for (const auto method :
           {ChoiceMethod::combined, ChoiceMethod::largest, ChoiceMethod::sum, ChoiceMethod::axis}) {
        ChoiceSummary local;
        const double time = chosen_time(machine, path, seed, method, local);
        // The tie-breaking preference for the middle of the travel is worth at most 1e-6 s a point.
        ASSERT_LE(least, time + 300 * 2e-6) << name << " path " << i;
      }
    }
  }
}

TEST(SolutionChoice, GlobalEqualsAnExhaustiveSearchOnShortPaths) {
  Machine machine = test::shipped_machine("paper");
  machine.axes[4].cyclic = false;  // C within +-400 deg: two or three turns of each branch
  machine.axes[4].min = -400.0 * kRadPerDegree;
  machine.axes[4].max = 400.0 * kRadPerDegree;
  std::mt19937_64 random(5);
  for (int i = 0; i < 30; ++i) {
    auto path = random_path(random, 5, 1.2);
    for (auto& p : path) p.rapid = true;  // no step is forbidden: the cost is the travel alone
    ChoiceSummary summary;
    const double found = chosen_time(machine, path, {}, ChoiceMethod::global, summary);
    // All sequences of (branch, turn of C), costed by the public kinematics only.
    double best = 1e300;
    for (int code = 0; code < 6 * 6 * 6 * 6 * 6; ++code) {
      int rest = code;
      JointVector before;
      double cost = 0.0;
      bool possible = true;
      for (const ChoicePoint& p : path) {
        const int choice = rest % 6;
        rest /= 6;
        const auto s = rotary_solutions(machine, p.pose.axis_P, 0.0);
        const auto branch = static_cast<std::size_t>(choice % 2);
        if (branch >= s.count) possible = false;
        if (!possible) break;
        JointVector q;
        q[3] = s.at[branch].angle[0];
        q[4] = s.at[branch].angle[1] + kTwoPi * (choice / 2 - 1);
        if (!machine.axes[3].within_limits(q[3]) || !machine.axes[4].within_limits(q[4])) possible = false;
        solve_linear(machine, p.pose.tip_P, machine.tool_vector(), q);
        for (AxisId id = 0; id < 5; ++id) cost += std::abs(q[id] - before[id]) / *machine.axes[id].rapid;
        before = q;
      }
      if (possible) best = std::min(best, cost);
    }
    EXPECT_NEAR(found, best, 1e-4) << "path " << i;
  }
}

TEST(SolutionChoice, BeyondLimitsNamesLineAxisAndAmount) {
  const Machine machine = test::shipped_machine("trunnion_offset");  // A from -30 to 120 deg
  ChoicePoint p;
  const double tilt = 130.0 * kRadPerDegree;
  p.pose.axis_P = Vec3(0, std::sin(tilt), std::cos(tilt));
  p.where = {17, 3};
  std::vector<ChosenPoint> out;
  ChoiceSummary summary;
  const auto result = choose_solutions(machine, {std::span(&p, 1), {}, "part.cls"},
                                       options_for(machine, ChoiceMethod::global), out, summary);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::check_failed);
  EXPECT_EQ(
      result.error().text(),
      "part.cls:17:3: error: tool axis (0.0000000, 0.7660444, -0.6427876) cannot be reached: axis A "
      "would have to go to 130.0000 deg, 10.0000 deg beyond its limits of -30.0000 deg to 120.0000 deg");
}

TEST(SolutionChoice, LimitedCTurnsBackAtARapidOrIsFlagged) {
  Machine machine = test::shipped_machine("paper");
  machine.axes[4].cyclic = false;
  machine.axes[4].min = -200.0 * kRadPerDegree;
  machine.axes[4].max = 200.0 * kRadPerDegree;
  machine.axes[3].min = 0.0;  // one branch only
  std::vector<ChoicePoint> path;
  for (int i = 0; i <= 90; ++i) {  // one and a half turns of C
    const double turn = i * 6.0 * kRadPerDegree;
    ChoicePoint p;
    p.pose.axis_P = Vec3(std::sin(0.5) * std::cos(turn), std::sin(0.5) * std::sin(turn), std::cos(0.5));
    p.rapid = i == 0;
    path.push_back(p);
  }
  ChoiceSummary summary;
  chosen_time(machine, path, {}, ChoiceMethod::global, summary);
  EXPECT_EQ(summary.reconfigurations, 1u);
  path[45].rapid = true;  // C stands at -180 deg and may turn back here without leaving the part
  ChoiceSummary with_rapid;
  chosen_time(machine, path, {}, ChoiceMethod::global, with_rapid);
  EXPECT_EQ(with_rapid.reconfigurations, 0u);
}

TEST(SolutionChoice, PoleKeepsC) {
  const Machine machine = test::shipped_machine("paper");
  std::vector<ChoicePoint> path(3);
  for (auto& p : path) p.pose.axis_P = Vec3::UnitZ();
  JointVector seed;
  seed[4] = 1.234;
  std::vector<ChosenPoint> out;
  ChoiceSummary summary;
  ASSERT_TRUE(
      choose_solutions(machine, {path, seed, "p"}, options_for(machine, ChoiceMethod::global), out, summary));
  EXPECT_EQ(out[2].q[4], 1.234);
  EXPECT_EQ(summary.pole_points, 3u);
}

}  // namespace
}  // namespace trunnion::path
