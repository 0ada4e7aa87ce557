#include "trunnion/path/reconfiguration.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "path/choice/rotary_connection.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

Vec3 random_axis(std::mt19937_64& random, double max_tilt) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double tilt = u(random) * max_tilt;
  const double turn = u(random) * kTwoPi;
  return {std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)};
}

using Angles = RotaryConnection::Angles;

Angles nearest_turns(const Angles& angles, const Angles& to) {
  Angles out = angles;
  for (std::size_t k = 0; k < 2; ++k) out[k] += kTwoPi * std::nearbyint((to[k] - out[k]) / kTwoPi);
  return out;
}
double way(const Angles& a, const Angles& b) {
  return std::abs(b[0] - a[0]) + std::abs(b[1] - a[1]);
}

// Where the axes come to when they follow the tool axis in small steps; nothing where a step is not small.
std::optional<Angles> followed(const Machine& machine, const Vec3& from, const Vec3& to, Angles at) {
  constexpr int kWaySteps = 1500;
  for (int i = 1; i <= kWaySteps; ++i) {
    const auto solutions =
        rotary_solutions(machine, slerp(from, to, static_cast<double>(i) / kWaySteps), at[1]);
    std::optional<Angles> next;
    for (std::size_t k = 0; k < solutions.count; ++k) {
      const Angles found = nearest_turns(solutions.at[k].angle, at);
      if (!next || way(at, found) < way(at, *next)) next = found;
    }
    if (!next || way(at, *next) > 8.0 * kRadPerDegree) return std::nullopt;
    at = *next;
  }
  return at;
}

Point point(const ToolPose& pose, const JointVector& q) {
  Point out;
  out.tip_P = pose.tip_P;
  out.axis_P = pose.axis_P;
  out.q = q;
  return out;
}

TEST(Reconfiguration, ConnectedIsWhatSmallStepsCanFollow) {
  std::mt19937_64 random(71);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    const RotaryConnection connection(kinematics, Angle::degrees(0.05));
    const double max_tilt = name == "nutating_45" ? 1.5 : 2.6;
    std::size_t connected = 0;
    std::size_t beyond_half_turn = 0;
    for (int i = 0; i < 150; ++i) {
      const Vec3 from = random_axis(random, max_tilt);
      const Vec3 to = random_axis(random, max_tilt);
      if (angle_between(from, to).rad() > 3.0) continue;
      const RotaryConnection wide(kinematics, Angle::degrees(1.0));
      if (wide.passes_pole(from, to)) continue;
      const auto starts = rotary_solutions(machine, from, 0.0);
      const auto ends = rotary_solutions(machine, to, 0.0);
      for (std::size_t s = 0; s < starts.count; ++s) {
        const Angles a = starts.at[s].angle;
        const auto b = followed(machine, from, to, a);
        if (!b) continue;
        for (std::size_t e = 0; e < ends.count; ++e) {
          for (int turn = -2; turn <= 2; ++turn) {
            Angles c = nearest_turns(ends.at[e].angle, *b);
            c[1] += turn * kTwoPi;
            const bool same = way(c, *b) < 1e-6;
            connected += same;
            beyond_half_turn += same && std::abs(c[1] - a[1]) > kPi;
            ASSERT_EQ(connection.connects(a, from, c, to), same)
                << name << " case " << i << " from " << from.transpose() << " to " << to.transpose();
          }
        }
      }
    }
    EXPECT_GT(connected, 150U) << name;
    // Only where the rotary axes are not square to each other.
    EXPECT_EQ(beyond_half_turn > 0, name == "nutating_45") << name;
  }
}

TEST(Reconfiguration, ThroughThePoleTheBranchChanges) {
  const Machine machine = test::shipped_machine("paper");
  const TableKinematics kinematics(machine, machine.tool_vector());
  const double tilt = 0.5;
  const Vec3 from(0.0, std::sin(tilt), std::cos(tilt));
  // The great circle passes the pole by `miss`.
  const auto through = [&](double miss) {
    const double turn = miss / std::tan(tilt) * 2.0;
    return Vec3(-std::sin(tilt) * std::sin(turn), -std::sin(tilt) * std::cos(turn), std::cos(tilt));
  };
  const Angle tolerance = Angle::degrees(0.1);
  const RotaryConnection connection(kinematics, tolerance);
  for (const double share : {0.0, 0.15, 0.5, 2.0}) {
    const Vec3 to = through(share * tolerance.rad());
    const auto a = rotary_solutions(machine, from, 0.0).at[0].angle;
    const auto ends = rotary_solutions(machine, to, 0.0);
    for (std::size_t e = 0; e < ends.count; ++e) {
      if (ends.at[e].angle[0] * a[0] > 0.0) continue;
      EXPECT_EQ(connection.connects(a, from, nearest_turns(ends.at[e].angle, a), to), share < 0.2) << share;
    }
  }
}

// Random limits of both axes: what is planned stays within them, holds the tool axis, and goes on from piece
// to piece; what is refused passes a tool axis that no position holds.
TEST(Reconfiguration, PlansStayWithinTheLimitsOrNameWhatIsBeyondThem) {
  std::mt19937_64 random(72);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (const std::string& name : test::shipped_machines()) {
    std::size_t planned = 0;
    std::size_t refused = 0;
    std::size_t inside = 0;
    for (int i = 0; i < 250; ++i) {
      Machine machine = test::shipped_machine(name);
      const auto rotary = machine.rotary_axes();
      Axis& outer = machine.axes[rotary[0]];
      Axis& inner = machine.axes[rotary[1]];
      outer.cyclic = inner.cyclic = false;
      outer.min = -(0.05 + u(random) * 1.5);
      outer.max = 1.0 + u(random);
      if (u(random) < 0.5) outer.min = std::max(outer.min, -0.2);
      inner.min = -(1.5 + 2.0 * u(random));
      inner.max = 1.5 + 2.0 * u(random);
      ChoiceOptions options;
      options.tool_mm = machine.tool_vector();
      ToolPose from{Vec3(10, 0, 0), random_axis(random, 1.2)};
      ToolPose to{Vec3(0, 10, 0), random_axis(random, 1.2)};
      const auto starts = inverse(machine, from, {});
      const auto ends = inverse(machine, to, {});
      if (starts.empty() || ends.empty()) continue;
      const JointVector a = starts[0].q;
      const JointVector b = ends.back().q;
      bool reachable = true;
      for (int k = 0; k <= 400 && reachable; ++k)
        reachable = !inverse(machine, {from.tip_P, slerp(from.axis_P, to.axis_P, k / 400.0)}, {}).empty();
      const auto plan = plan_turns(machine, point(from, a), point(to, b), options);
      if (!plan) {
        ++refused;
        EXPECT_FALSE(reachable) << name << " case " << i << ": " << plan.error().message;
        EXPECT_NE(plan.error().message.find(" deg"), std::string::npos) << plan.error().message;
        continue;
      }
      EXPECT_TRUE(reachable) << name << " case " << i;
      planned += !plan->empty();
      ToolPose before = from;
      JointVector q = a;
      const auto holds = [&](const ToolPose& pose, const JointVector& at) {
        const ToolPose there = tool_pose(forward(machine, at));
        EXPECT_LT((there.tip_P - pose.tip_P).norm(), 1e-8);
        EXPECT_LT(angle_between(there.axis_P, pose.axis_P).rad(), 1e-7);
        for (const AxisId id : rotary) {
          EXPECT_GE(at[id], machine.axes[id].min - 1e-9);
          EXPECT_LE(at[id], machine.axes[id].max + 1e-9);
        }
      };
      for (const TurnAway& turn : *plan) {
        inside += turn.share > 0.0 && turn.share < 1.0;
        holds(turn.pose, turn.before);
        holds(turn.pose, turn.after);
        EXPECT_TRUE(connects(machine, point(before, q), point(turn.pose, turn.before), options))
            << name << " case " << i;
        before = turn.pose;
        q = turn.after;
      }
      EXPECT_TRUE(connects(machine, point(before, q), point(to, b), options)) << name << " case " << i;
    }
    std::printf("%s: %zu plans with turns (%zu inside a segment), %zu refused\n", name.c_str(), planned,
                inside, refused);
    EXPECT_GT(planned, 20U) << name;
    EXPECT_GT(refused, 2U) << name;
  }
}

}  // namespace
}  // namespace trunnion::path
