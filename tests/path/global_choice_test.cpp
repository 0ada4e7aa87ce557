#include "path/choice/global_choice.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <random>

#include "support/machines.hpp"

namespace trunnion::path {
namespace {

ChoiceOptions choice_of(const Machine& machine) {
  ChoiceOptions options;
  options.tool_mm = machine.tool_vector();
  return options;
}

Machine with_c_limits(double min_turns, double max_turns) {
  Machine machine = test::shipped_machine("paper");  // A from -200 to 200 deg
  machine.axes[4].cyclic = false;
  machine.axes[4].min = min_turns * kTwoPi;
  machine.axes[4].max = max_turns * kTwoPi;
  return machine;
}

// The tool axis goes round C at one tilt; tips near the middle, so that the rotary axes decide.
std::vector<ChoicePoint> winding(double turns, std::size_t points_of_turn) {
  std::vector<ChoicePoint> out;
  const auto count = static_cast<std::size_t>(std::abs(turns) * static_cast<double>(points_of_turn));
  for (std::size_t i = 0; i <= count; ++i) {
    const double turn = 0.3 + turns * kTwoPi * static_cast<double>(i) / static_cast<double>(count);
    ChoicePoint p;
    p.pose.axis_P = Vec3(std::sin(0.5) * std::cos(turn), std::sin(0.5) * std::sin(turn), std::cos(0.5));
    p.pose.tip_P = Vec3(1.0, 2.0, 3.0);
    p.rapid = i == 0;
    out.push_back(p);
  }
  return out;
}

std::size_t reconfigurations(const Machine& machine, const std::vector<ChoicePoint>& path) {
  std::vector<ChosenPoint> out;
  ChoiceSummary summary;
  const auto done = choose_solutions(machine, {path, {}, "part.cls"}, choice_of(machine), out, summary);
  EXPECT_TRUE(done);
  for (const ChosenPoint& p : out) EXPECT_TRUE(machine.axes[4].within_limits(p.q[4]));
  return summary.reconfigurations;
}

// All positions of all branches and turns at every point, none left out: the shortest path by Bellman's
// recursion, costed by the public kinematics. Rapids only, so that no step is forbidden.
double exhaustive_seconds(const Machine& machine, const std::vector<ChoicePoint>& path,
                          const JointVector& seed) {
  std::vector<std::pair<JointVector, double>> before = {{seed, 0.0}};
  for (const ChoicePoint& p : path) {
    std::vector<std::pair<JointVector, double>> after;
    const RotarySolutions s = rotary_solutions(machine, p.pose.axis_P, 0.0);
    for (std::size_t n = 0; n < s.count; ++n) {
      for (int a = -1; a <= 1; ++a) {
        for (int c = -120; c <= 120; ++c) {
          JointVector q;
          q[3] = s.at[n].angle[0] + a * kTwoPi;
          q[4] = s.at[n].angle[1] + c * kTwoPi;
          if (!machine.axes[3].within_limits(q[3]) || !machine.axes[4].within_limits(q[4])) continue;
          solve_linear(machine, p.pose.tip_P, machine.tool_vector(), q);
          double least = std::numeric_limits<double>::infinity();
          for (const auto& [from, cost] : before) {
            double way = cost;
            for (AxisId id = 0; id < 5; ++id) way += std::abs(q[id] - from[id]) / *machine.axes[id].rapid;
            least = std::min(least, way);
          }
          after.emplace_back(q, least);
        }
      }
    }
    before = std::move(after);
  }
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [q, cost] : before) best = std::min(best, cost);
  return best;
}

TEST(GlobalChoice, EqualsAnExhaustiveSearchWithManyTurns) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < 24; ++i) {
    const double low = -3.0 + 2.5 * u(random);
    const double turns = i % 2 == 0 ? 20.0 : 100.0;
    const Machine machine = with_c_limits(low, low + 6.0 + turns * std::abs(u(random)));
    std::vector<ChoicePoint> path;
    for (int k = 0; k < 5; ++k) {
      const double tilt = 0.2 + std::abs(u(random));
      const double turn = kPi * u(random);
      ChoicePoint p;
      p.pose.axis_P = Vec3(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt));
      p.pose.tip_P = 30.0 * Vec3(u(random), u(random), u(random));
      p.rapid = true;
      path.push_back(p);
    }
    JointVector seed;
    seed[4] = machine.axes[4].min + 0.5 * (1.0 + u(random)) * (machine.axes[4].max - machine.axes[4].min);
    std::vector<ChosenPoint> out;
    ChoiceSummary summary;
    ASSERT_TRUE(choose_solutions(machine, {path, seed, "part.cls"}, choice_of(machine), out, summary));
    EXPECT_NEAR(summary.axis_time_s, exhaustive_seconds(machine, path, seed), 1e-4) << "path " << i;
  }
}

// A path that winds C by nearly all of its travel must begin at the far end of it, many turns away from where
// the axis stands: the only way without leaving the part.
TEST(GlobalChoice, BeginsSoManyTurnsAwayAsThePathWinds) {
  for (const double turns : {5.0, 9.0, 14.0, 27.0}) {
    for (const double sense : {-1.0, 1.0}) {
      for (const bool one_branch : {false, true}) {
        Machine machine = with_c_limits(-0.5 * turns - 0.55, 0.5 * turns + 0.55);
        if (one_branch) machine.axes[3].min = 0.0;
        EXPECT_EQ(reconfigurations(machine, winding(sense * turns, 9)), 0u) << turns << " x " << sense;
        // More turns than there are.
        EXPECT_GE(reconfigurations(machine, winding(sense * (turns + 2.0), 9)), 1u)
            << turns << " x " << sense;
      }
    }
  }
}

// The start is where C stands, though the limits begin thousands of degrees away.
TEST(GlobalChoice, WideLimitsDoNotTurnTheAxisAway) {
  Machine machine = with_c_limits(-9999.999 / 360.0, 9999.999 / 360.0);
  std::vector<ChosenPoint> out;
  ChoiceSummary summary;
  ASSERT_TRUE(
      choose_solutions(machine, {winding(0.4, 20), {}, "part.cls"}, choice_of(machine), out, summary));
  for (const ChosenPoint& p : out) EXPECT_LT(std::abs(p.q[4]), kTwoPi);
  const auto all = winding(0.4, 20);
  for (const auto method : {ChoiceMethod::combined, ChoiceMethod::largest, ChoiceMethod::sum}) {
    ChoiceOptions local = choice_of(machine);
    local.method = method;
    out.clear();
    ASSERT_TRUE(choose_solutions(machine, {all, {}, "part.cls"}, local, out, summary));
    for (const ChosenPoint& p : out) EXPECT_LT(std::abs(p.q[4]), kTwoPi);
  }
}

TEST(StepTraces, ReadsBackWhatWasWritten) {
  std::mt19937_64 random(4);
  std::vector<std::vector<TracedStep>> layers;
  std::vector<bool> plain;
  StepTraces traces;
  for (int i = 0; i < 4000; ++i) {
    const std::array<std::size_t, 5> most = {1, 2, 6, 16, 300};
    const std::size_t count = 1 + random() % most[random() % most.size()];
    const std::size_t before = layers.empty() ? 1 : layers.back().size();
    std::vector<TracedStep> layer;
    for (std::size_t k = 0; k < count; ++k)
      layer.push_back(
          {static_cast<std::uint16_t>(random() % before), static_cast<std::uint16_t>(random() % count)});
    plain.push_back(count <= 2 && before <= 2 && random() % 2 == 0);
    if (plain.back() && count == 1) {
      layer[0] = {};
      traces.add_one();
    } else if (plain.back()) {
      layer[0].pick = 0;
      layer[1].pick = 1;
      traces.add_two(layer[0].from, layer[1].from);
    } else {
      traces.add(layer);
    }
    layers.push_back(layer);
  }
  ASSERT_EQ(traces.layers(), layers.size());
  for (std::size_t i = layers.size(); i-- > 0;) {
    const std::size_t at = random() % layers[i].size();
    const bool straight =
        plain[i] && layers[i].size() == 2 && layers[i][0].from == 0 && layers[i][1].from == 1;
    if (!straight || random() % 2 == 0) {
      EXPECT_EQ(traces.take_straight(), straight);
      if (straight) continue;
    }
    const StepTraces::Read read = traces.take_last(at);
    EXPECT_EQ(read.plain, plain[i]);
    if (plain[i]) {
      EXPECT_EQ(read.count, layers[i].size());
    }
    EXPECT_EQ(read.step.from, layers[i][at].from);
    EXPECT_EQ(read.step.pick, layers[i][at].pick);
  }
  EXPECT_EQ(traces.layers(), 0u);
}

}  // namespace
}  // namespace trunnion::path
