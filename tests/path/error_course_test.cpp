#include "trunnion/path/error_course.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/path/certificate.hpp"

#include "effects/table_effect.hpp"
#include "support/cases.hpp"
#include "support/effect_cases.hpp"
#include "support/lanes.hpp"

namespace trunnion::path {
namespace {

// Every effect of the library at random values of twice its usual size, memory at rest.
Model everything(const Machine& machine, test::RandomStates& random) {
  Model model;
  for (const EffectFamily& family : effect_library(machine, test::effect_context())) {
    ModelEffect entry = model_effect(family.variants.front());
    for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
      const Parameter& p = entry.effect->info().parameters[k];
      if (p.role == ParameterRole::linear) entry.parameters[k].value = random.uniform(-2.0, 2.0) * p.usual;
    }
    model.effects.push_back(std::move(entry));
  }
  return model;
}

struct Motion {
  MachineState from, to;
};

// Turns of 1e-3 to 1 rad, ways of up to 200 mm.
Motion motion(const Machine& machine, test::RandomStates& random) {
  Motion out{random.next(), {}};
  out.to = out.from;
  const double size = std::pow(10.0, random.uniform(-3.0, 0.0));
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    out.to.q[id] += size * random.uniform(-1.0, 1.0) * (rotary ? 1.0 : 200.0);
  }
  return out;
}

ToolPose actual(const Machine& machine, const ModelEvaluator& truth, MachineState state,
                const JointVector& q) {
  state.q = q;
  return tool_pose(forward(machine, q, machine.tool_vector(), truth.errors(state)));
}

// Deviation of tip and axis from the nominal chain.
ToolPose shift(const Machine& machine, const ModelEvaluator& truth, const MachineState& state,
               const JointVector& q) {
  const ToolPose with = actual(machine, truth, state, q);
  const ToolPose without = tool_pose(forward(machine, q));
  return {with.tip_P - without.tip_P, with.axis_P - without.axis_P};
}

// How far the errors of samples of a motion are off the straight line between those of its ends.
struct Departure {
  double tip_mm = 0.0, axis_rad = 0.0;
};
Departure departure(const Machine& machine, const ModelEvaluator& truth, const Motion& m, int parts) {
  const ToolPose s0 = shift(machine, truth, m.from, m.from.q);
  const ToolPose s1 = shift(machine, truth, m.from, m.to.q);
  Departure out;
  for (int k = 1; k < parts; ++k) {
    const double t = static_cast<double>(k) / parts;
    const ToolPose s = shift(machine, truth, m.from, JointVector::interpolate(m.from.q, m.to.q, t));
    out.tip_mm = std::max(out.tip_mm, (s.tip_P - (1.0 - t) * s0.tip_P - t * s1.tip_P).norm());
    out.axis_rad = std::max(out.axis_rad, (s.axis_P - (1.0 - t) * s0.axis_P - t * s1.axis_P).norm());
  }
  return out;
}

TEST(ErrorCourse, ErrorsNeverLeaveTheirStraightCourseByMore) {
  constexpr double kRounding = 1e-12;  // mm: a few units in the last place of the coordinates
  double worst = 0.0;
  for (const std::string& name : test::effect_machines()) {
    const Machine machine = test::effect_machine(name);
    test::RandomStates random(machine, 21);
    for (int i = 0; i < test::cases(200); ++i) {
      const ModelEvaluator truth(everything(machine, random));
      const ErrorCourse course(machine, machine.tool_vector(), truth);
      const Motion m = motion(machine, random);
      const ErrorCourse::Bend bend = course.over(m.from, m.to);
      ASSERT_EQ(bend.unbounded, nullptr);
      const Departure seen = departure(machine, truth, m, 40);
      ASSERT_LE(seen.tip_mm, bend.tip_mm + kRounding) << name << " " << i;
      ASSERT_LE(seen.axis_rad, bend.axis_rad + 1e-14) << name << " " << i;
      if (seen.tip_mm > 1e-6) worst = std::max(worst, bend.tip_mm / seen.tip_mm);
    }
  }
  // The bound comes from norms; a wrong power of a step would make it useless.
  EXPECT_LT(worst, 1000.0);
  RecordProperty("worst_ratio", std::to_string(worst));
}

// One effect at a time, its twist straight over the motion: the chain's own curvature is all there is, and a
// term that is left out shows.
TEST(ErrorCourse, OneStraightTwistAtATime) {
  double tightest = 1e9;
  for (const std::string& name : test::effect_machines()) {
    const Machine machine = test::effect_machine(name);
    test::RandomStates random(machine, 23);
    for (const EffectFamily& family : effect_library(machine, test::effect_context())) {
      Model model;
      model.effects.push_back(model_effect(family.variants.front()));
      ModelEffect& entry = model.effects.front();
      for (int i = 0; i < 60; ++i) {
        for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
          const Parameter& p = entry.effect->info().parameters[k];
          // Rotations of a tenth of a radian: their second order shows too.
          if (p.role == ParameterRole::linear)
            entry.parameters[k].value = random.uniform(-1.0, 1.0) * p.usual * (i % 2 == 0 ? 1.0 : 1e3);
        }
        const ModelEvaluator truth(model);
        const Motion m = motion(machine, random);
        const auto rest = entry.effect->bend(m.from, m.to, entry.values());
        ASSERT_TRUE(rest);
        if (!rest->is_zero()) continue;
        const ErrorCourse::Bend bend = ErrorCourse(machine, machine.tool_vector(), truth).over(m.from, m.to);
        const ToolPose s0 = shift(machine, truth, m.from, m.from.q);
        const ToolPose s1 = shift(machine, truth, m.from, m.to.q);
        double largest = 0.0;
        for (int k = 1; k < 16; ++k) {
          const double t = k / 16.0;
          const ToolPose s = shift(machine, truth, m.from, JointVector::interpolate(m.from.q, m.to.q, t));
          const double tip = (s.tip_P - (1.0 - t) * s0.tip_P - t * s1.tip_P).norm();
          largest = std::max(largest, tip);
          ASSERT_LE(tip, bend.tip_mm + 1e-12) << name << " " << entry.id() << " " << i;
          ASSERT_LE((s.axis_P - (1.0 - t) * s0.axis_P - t * s1.axis_P).norm(), bend.axis_rad + 1e-14)
              << name << " " << entry.id() << " " << i;
        }
        if (largest > 1e-6) tightest = std::min(tightest, bend.tip_mm / largest);
      }
    }
  }
  // Where the bound is sharp nothing is left to hide a missing term in.
  EXPECT_LT(tightest, 1.02);
  RecordProperty("tightest_ratio", std::to_string(tightest));
}

// The bound from what the errors are at most anywhere, for one effect at a time and for all that know their
// range together.
TEST(ErrorCourse, AtMostHoldsWhereverTheMachineStands) {
  double tightest = 1e9;
  int found = 0;
  int changes = 0;
  double nearest = 1e9;
  for (const std::string& name : test::effect_machines()) {
    const Machine machine = test::effect_machine(name);
    test::RandomStates random(machine, 24);
    std::vector<Model> models(1);
    for (const EffectFamily& family : effect_library(machine, test::effect_context())) {
      const auto& effect = family.variants.front();
      const ModelEffect entry = model_effect(effect);
      if (effect->depends_on() != DependsOn::nothing && !effect->range(entry.values(), machine.axes))
        continue;
      models.push_back({});
      models.back().effects.push_back(entry);
      models.front().effects.push_back(entry);
    }
    EXPECT_GT(models.size(), 10U);
    for (Model& model : models) {
      for (int i = 0; i < 30; ++i) {
        for (ModelEffect& entry : model.effects) {
          for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
            const Parameter& p = entry.effect->info().parameters[k];
            if (p.role == ParameterRole::linear)
              entry.parameters[k].value = random.uniform(-1.0, 1.0) * p.usual * (i % 2 == 0 ? 1.0 : 30.0);
          }
        }
        const ModelEvaluator truth(model);
        Motion m = motion(machine, random);
        // One axis alone shows what the others would hide.
        const auto alone = static_cast<AxisId>(i) % (2 * machine.axes.size());
        for (AxisId id = 0; id < machine.axes.size(); ++id) {
          m.to.q[id] = std::clamp(m.to.q[id], machine.axes[id].min, machine.axes[id].max);
          if (alone < machine.axes.size() && id != alone) m.to.q[id] = m.from.q[id];
        }
        const auto most = ErrorCourse(machine, machine.tool_vector(), truth).at_most(m.from.q, m.to.q);
        // Of motions there and back: the same bits, and nothing where one of them has nothing.
        std::array<std::array<double, 8>, kMaxAxes> rows{};
        ErrorCourse::Columns columns{};
        for (AxisId id = 0; id < kMaxAxes; ++id) {
          for (std::size_t row = 0; row < 8; ++row)
            rows[id][row] = row == 0 || row == 2 ? m.from.q[id] : m.to.q[id];
          columns[id] = rows[id].data();
        }
        for (const lanes::Way way : test::kEveryWay) {
          const test::Calculating lanes(way);
          std::array<double, 6> tip_mm{};
          std::array<double, 6> axis_rad{};
          const bool known = ErrorCourse(machine, machine.tool_vector(), truth)
                                 .at_most(columns, 3, tip_mm.data(), axis_rad.data());
          ASSERT_EQ(known, most.has_value());
          for (std::size_t row = 0; row < 3 && known; ++row) {
            ASSERT_EQ(tip_mm[row], most->tip_mm);
            ASSERT_EQ(axis_rad[row], most->axis_rad);
          }
        }
        if (!most) continue;
        ++found;
        const Departure seen = departure(machine, truth, m, 16);
        ASSERT_LE(seen.tip_mm, most->tip_mm + 1e-12) << name << " " << i;
        ASSERT_LE(seen.axis_rad, most->axis_rad + 1e-14) << name << " " << i;
        if (seen.tip_mm > 1e-6) tightest = std::min(tightest, most->tip_mm / seen.tip_mm);
        // Linear axes alone.
        for (const AxisId id : machine.rotary_axes()) m.to.q[id] = m.from.q[id];
        const auto change =
            ErrorCourse(machine, machine.tool_vector(), truth).change_at_most(m.from.q, m.to.q);
        if (!change) continue;
        ++changes;
        const double changed =
            (shift(machine, truth, m.from, m.to.q).tip_P - shift(machine, truth, m.from, m.from.q).tip_P)
                .norm();
        ASSERT_LE(changed, *change + 1e-12) << name << " " << i;
        if (changed > 1e-6) nearest = std::min(nearest, *change / changed);
      }
    }
  }
  EXPECT_GT(found, 2500);
  EXPECT_GT(changes, 2500);
  // A positioning error alone.
  EXPECT_LT(nearest, 1.1);
  // A shift that turns with an axis: the bound is the sagitta of its arc.
  EXPECT_LT(tightest, 1.1);
}

// A table whose value goes up to a node and down behind it: the middle is off by half of what the slope makes
// of the motion, for a position and for an angle.
TEST(ErrorCourse, AtMostKnowsTheKinksOfTables) {
  const Machine machine = test::effect_machine("trunnion_offset");
  for (const char* component : {"EXX", "ECX"}) {
    Diagnostics d;
    const bool turns = component[1] == 'C';
    const auto table = parse_error_table(
        std::string("X_mm,") + component + (turns ? "_urad" : "_um") + "\n-300,0\n0,60\n300,0\n", "t.csv",
        machine, d);
    ASSERT_TRUE(table);
    const auto effect = effects::TableEffect::make({component, "t.csv", {}, false, false}, *table, machine);
    ASSERT_TRUE(effect);
    Model model;
    model.effects.push_back(model_effect(*effect));
    const ModelEvaluator truth(model);
    const ErrorCourse course(machine, machine.tool_vector(), truth);
    MachineState state;
    const AxisId x = *machine.axis("X");
    JointVector from;
    JointVector to;
    from[x] = -100.0;
    to[x] = 100.0;
    const auto most = course.at_most(from, to);
    ASSERT_TRUE(most);
    const ToolPose s0 = shift(machine, truth, state, from);
    const ToolPose s1 = shift(machine, truth, state, to);
    const ToolPose s = shift(machine, truth, state, JointVector::interpolate(from, to, 0.5));
    const double tip = (s.tip_P - 0.5 * (s0.tip_P + s1.tip_P)).norm();
    EXPECT_LE(tip, most->tip_mm);
    if (!turns) {
      EXPECT_NEAR(tip, 0.02, 1e-9);
      EXPECT_NEAR(most->tip_mm, 0.02, 1e-4);
    } else {
      const double axis = (s.axis_P - 0.5 * (s0.axis_P + s1.axis_P)).norm();
      EXPECT_LE(axis, most->axis_rad);
    }
    // Nothing is said beyond the travel.
    to[x] = machine.axes[x].max + 1.0;
    EXPECT_FALSE(course.at_most(from, to));
  }
}

// The certificate between shifted stations plus the bend holds on the machine with errors.
TEST(LongErrorCourse, CertificateHoldsOnTheMachineWithErrors) {
  for (const std::string& name : test::effect_machines()) {
    const Machine machine = test::effect_machine(name);
    const Certifier certifier(TableKinematics(machine, machine.tool_vector()));
    test::RandomStates random(machine, 22);
    for (int i = 0; i < test::cases(500); ++i) {
      const ModelEvaluator truth(everything(machine, random));
      const ErrorCourse course(machine, machine.tool_vector(), truth);
      const Motion m = motion(machine, random);
      const auto at = [&](const JointVector& q) {
        const ToolPose s = shift(machine, truth, m.from, q);
        return shifted(station(certifier.kinematics(), q), s.tip_P, s.axis_P);
      };
      const Station a = at(m.from.q);
      const Station b = at(m.to.q);
      const Reference r{a.tip_P - a.tip_shift_P, b.tip_P - b.tip_shift_P, a.axis_P - a.axis_shift_P,
                        b.axis_P - b.axis_shift_P};
      const ErrorCourse::Bend bend = course.over(m.from, m.to);
      const double tip_mm = certifier.tip(a, b, r).upper + bend.tip_mm;
      const double axis_rad = certifier.axis(a, b, r).upper + 1.001 * bend.axis_rad;
      for (int k = 0; k <= 20; ++k) {
        const ToolPose pose =
            actual(machine, truth, m.from, JointVector::interpolate(m.from.q, m.to.q, k / 20.0));
        const double d = distance_to_segment(pose.tip_P, r.tip0_P, r.tip1_P);
        ASSERT_LE(d, tip_mm) << name << " " << i;
        double angle = kPi;
        for (int j = 0; j <= 400; ++j)
          angle = std::min(angle, angle_between(pose.axis_P, slerp(r.axis0_P, r.axis1_P, j / 400.0)).rad());
        // The sampled arc is off its nearest point by half a step at most.
        const double step = angle_between(r.axis0_P, r.axis1_P).rad() / 400.0;
        ASSERT_LE(std::sqrt(std::max(0.0, angle * angle - 0.26 * step * step)), axis_rad + 1e-12)
            << name << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace trunnion::path
