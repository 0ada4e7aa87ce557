#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <random>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "diagnosis/campaigns.hpp"

// Effects so large that what they do to each other is above the noise: the search is linear in each.
namespace trunnion::diagnosis {
namespace {

constexpr double kNoise_um = 0.15;

/// Readings of a tip that is cutting, actual minus commanded: every axis is where it was `late_s` before.
/// Made with whole positions, not with what they change in first order.
Dataset late_axes(const Machine& machine, const JointVector& late_s, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kNoise_um);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  const Vec3 tool(0.0, 0.0, -150.0);
  std::string text = "run_id,time_s,";
  for (const Axis& axis : machine.axes) {
    const std::string unit = axis.kind == AxisKind::linear ? "_mm" : "_deg";
    text += axis.name + unit + ",dir_" + axis.name + ",vel_" + axis.name + unit + "_min,";
  }
  text += "quantity,n_x,n_y,n_z,value,unit,u_random,u_common\n";
  for (int k = 0; k < 600; ++k) {
    JointVector q, actual;
    text += "cut-" + std::to_string(1 + k / 150) + "," + shortest_text(0.05 * k) + ",";
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const bool linear = machine.axes[id].kind == AxisKind::linear;
      const double unit = linear ? 1.0 : kDegreePerRad;
      q[id] = (linear ? between(-40.0, 40.0) : between(10.0, 60.0)) / unit;
      const double v = (linear ? between(-60.0, 60.0) : between(-150.0, 150.0)) / unit;
      actual[id] = q[id] - late_s[id] * v;
      text += fixed_text(q[id] * unit, 9) + (v < 0.0 ? ",-1," : ",1,") + fixed_text(v * unit * 60.0, 6) + ",";
    }
    const Vec3 n = Vec3::Unit(k % 3);
    const Vec3 moved = forward(machine, actual, tool).p - forward(machine, q, tool).p;
    const double value = n.dot(part_in_machine(machine, q).R * moved) / kMmPerUm + noise(random);
    text += "displacement," + fixed_text(n.x(), 0) + "," + fixed_text(n.y(), 0) + "," + fixed_text(n.z(), 0) +
            "," + fixed_text(value, 4) + ",um," + fixed_text(kNoise_um, 2) + ",0\n";
  }
  Diagnostics diagnostics;
  auto data = parse_measurements(std::array{NamedText{"late.csv", text}}, machine, diagnostics);
  if (!data) throw std::runtime_error(data.error().text());
  return *data;
}

// Y 3.5 ms late in the part, which a table that is 3 ms late turns by 0.4 degrees: 1 um beside 100 um of Y
// and 0.15 um of noise. It passed for a period of X and a step, and then for nothing of the library, since
// one function of the velocity does without them.
TEST(LongLargeEffects, WhatTheyDoToEachOtherIsNoEffect) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const auto& [axis, late_ms] : {std::pair("Y", 3.5), {"X", 6.3}, {"Z", 1.9}, {"A", 3.0}}) {
    JointVector late_s;
    const auto id = machine.axis(axis);
    ASSERT_TRUE(id);
    late_s[*id] = late_ms * 1e-3;
    late_s[*machine.axis("C")] = 7.5e-3;
    const Dataset data = late_axes(machine, late_s, 11);
    const Model known = test::model_for(machine, data,
                                        "[model]\nname = \"c\"\n[[effect]]\nid = \"servo_lag:C\"\n"
                                        "[effect.parameters]\ntau_ms = 7.5\n");
    const Diagnosis d = diagnose(machine, data, known, {});
    EXPECT_EQ(d.verdict, Verdict::named) << axis << ": " << d.paragraph;
    EXPECT_EQ(d.effects, std::vector<std::string>{std::string("servo_lag:") + axis});
    ASSERT_EQ(d.additions.size(), 1U) << axis;
    EXPECT_NEAR(d.additions[0].parameters[0].value, late_s[*id], 5e-6);
  }
}

// Two are missing, and a small third one is still seen beside them.
TEST(LongLargeEffects, SmallOnesBesideThemAreFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  JointVector late_s;
  late_s[*machine.axis("C")] = 7.5e-3;
  late_s[*machine.axis("Y")] = 3.5e-3;
  late_s[*machine.axis("X")] = 0.01e-3;
  const Dataset data = late_axes(machine, late_s, 12);
  const Model known = test::model_for(machine, data, "[model]\nname = \"nothing\"\n");
  const Diagnosis d = diagnose(machine, data, known, {});
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_THAT(d.effects, testing::UnorderedElementsAre("servo_lag:C", "servo_lag:Y", "servo_lag:X"));
}

}  // namespace
}  // namespace trunnion::diagnosis
