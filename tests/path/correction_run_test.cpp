#include "trunnion/path/correction_run.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/effects/library.hpp"
#include "trunnion/effects/table.hpp"
#include "trunnion/path/certificate.hpp"
#include "trunnion/path/flute.hpp"

#include "effects/table_effect.hpp"
#include "path/word_grid.hpp"
#include "support/lanes.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

// All errors that hang on the position alone and know a range, of random size, and a table with kinks; or
// `only_tables`: the constant ones of them and tables of each linear axis.
Model errors_of_the_place(const Machine& machine, std::mt19937_64& random, double size, bool only_tables) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Model model;
  for (const EffectFamily& family : effect_library(machine, {})) {
    const auto& effect = family.variants.front();
    ModelEffect entry = model_effect(effect);
    if (effect->depends_on() > (only_tables ? DependsOn::nothing : DependsOn::position)) continue;
    if (effect->depends_on() != DependsOn::nothing && !effect->range(entry.values(), machine.axes)) continue;
    for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
      const Parameter& p = effect->info().parameters[k];
      if (p.role == ParameterRole::linear) entry.parameters[k].value = size * u(random) * p.usual;
    }
    model.effects.push_back(std::move(entry));
  }
  Diagnostics d;
  const auto add = [&](const std::string& component, const std::string& text) {
    const auto table = parse_error_table(text, "t.csv", machine, d);
    const auto effect =
        effects::TableEffect::make({component, "t.csv", {}, false, false}, table.value(), machine);
    model.effects.push_back(model_effect(effect.value()));
  };
  add("EYX", "X_mm,EYX_um\n-40,0\n-20,6\n5,-4\n40,3\n");
  if (!only_tables) return model;
  add("EZX", "X_mm,EZX_um\n-60,0\n-20,-3\n70,4\n");
  add("EYY", "Y_mm,EYY_um\n-80,1\n0,0\n20,-2\n80,3\n");
  add("ECZ", "Z_mm,ECZ_urad\n-90,9\n0,0\n90,-12\n");
  return model;
}

struct PlaceWalk {
  std::vector<JointVector> nominal;
  std::vector<ToolPose> poses;
  std::vector<RotarySines> sines;
};

// Steps of all sizes; positions within the travel, some beyond the table.
PlaceWalk place_walk(const Machine& machine, const TableKinematics& kinematics, const Rounding& rounding,
                     std::mt19937_64& random, std::size_t count) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  PlaceWalk walk;
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    q[id] = machine.axes[id].kind == AxisKind::rotary ? 0.5 * u(random) : 60.0 * u(random);
  for (std::size_t i = 0; i < count; ++i) {
    const double step = std::exp(4.0 * u(random) - 3.0);
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      q[id] = std::clamp(q[id] + step * u(random) * (machine.axes[id].kind == AxisKind::rotary ? 0.02 : 1.0),
                         std::max(-100.0, machine.axes[id].min), std::min(100.0, machine.axes[id].max));
    const ToolPose pose = kinematics.pose(q);
    JointVector rounded = q;
    walk.sines.push_back(round_to_words(kinematics, rounding, pose.tip_P, rounded));
    walk.nominal.push_back(rounded);
    walk.poses.push_back(pose);
  }
  return walk;
}

// The shipped machines that are evaluated a few at a time, each with forty sets of errors and a walk:
// `with(machine, kinematics, model, m)`, m the number of the set.
template <class With>
void each_machine_with_errors(std::mt19937_64& random, const With& with) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  constexpr int kSets = 40;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    for (int m = 0; m < kSets; ++m)
      with(machine, kinematics,
           errors_of_the_place(machine, random, std::exp(3.0 * u(random) - 2.0), m % 2 == 0), m);
  }
}

// Most walks are long; some are of a few points.
std::size_t points_of_walk(int m) {
  return m % 4 == 0 ? 1 + static_cast<std::size_t>(m) / 4 : 100;
}

std::vector<CorrectionRun::NominalPlace> places_of(const PlaceWalk& walk) {
  std::vector<CorrectionRun::NominalPlace> out;
  for (std::size_t i = 0; i < walk.nominal.size(); ++i)
    out.push_back({&walk.nominal[i], &walk.poses[i].tip_P, &walk.poses[i].axis_P, &walk.sines[i]});
  return out;
}

// A few at a time, two or four: what one at a time gives, but for a digit that the last nanometre turns over.
// A motion that is said to keep does on the machine with errors, at every place of it.
TEST(CorrectionRun, CorrectsAsOneAtATimeAndKeepsWhatItSays) {
  std::mt19937_64 random(20261122);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t kept = 0, kept_as_said = 0, others = 0, digits = 0, unknown = 0;
  each_machine_with_errors(random, [&](const Machine& machine, const TableKinematics& kinematics,
                                       const Model& model, int m) {
    const Vec3 tool = machine.tool_vector();
    const Rounding rounding = test::four_decimals(machine);
    const ModelEvaluator truth(model);
    const Compensator compensator(machine, model, tool);
    const auto run_with = [&](int way) {
      const test::Calculating lanes(test::kEveryWay[static_cast<std::size_t>(way % 3)]);
      return CorrectionRun(compensator, kinematics, rounding);
    };
    CorrectionRun run = run_with(m);
    CorrectionRun other = run_with(m + 1);
    const std::size_t count = points_of_walk(m);
    const PlaceWalk walk = place_walk(machine, kinematics, rounding, random, count);
    const double tolerance_mm = 0.0008 * std::exp(2.0 * u(random));
    std::vector<CorrectionRun::NominalPlace> places = places_of(walk);
    // Every other one as if the refinement had said how far the nominal motion leaves its segment.
    const Certifier certifier(kinematics);
    for (std::size_t i = 1; i < count; i += 2) {
      const Reference segment{walk.poses[i - 1].tip_P, walk.poses[i].tip_P, walk.poses[i - 1].axis_P,
                              walk.poses[i].axis_P};
      places[i].off_mm =
          certifier
              .tip(station(kinematics, walk.nominal[i - 1]), station(kinematics, walk.nominal[i]), segment)
              .upper;
    }
    run.correct(places, tolerance_mm, 0.0);
    other.correct(places, tolerance_mm, 0.0);
    ASSERT_TRUE(std::ranges::equal(run.joints(), other.joints())) << machine.name << ' ' << m;
    ASSERT_TRUE(std::ranges::equal(run.keeps(), other.keeps())) << machine.name << ' ' << m;
    ASSERT_TRUE(std::ranges::equal(run.known(), other.known())) << machine.name << ' ' << m;
    ASSERT_EQ(run.largest_error_mm(), other.largest_error_mm());
    ASSERT_EQ(run.largest_correction_mm(), other.largest_correction_mm());
    double largest_mm = 0.0;
    std::vector<bool> known(count);
    for (std::size_t i = 0; i < count; ++i) {
      MachineState state;
      state.q = walk.nominal[i];
      const auto one = compensator.corrected(walk.poses[i].tip_P, walk.poses[i].axis_P, state);
      known[i] = one && !one->held;
      if (!known[i]) {
        ++unknown;
        continue;
      }
      largest_mm = std::max(largest_mm, one->before_mm);
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        const double expected =
            machine.axes[id].kind == AxisKind::rotary ? one->q[id] : rounding.rounded(id, one->q[id]);
        const double off = std::abs(run.joints()[i][id] - expected);
        ASSERT_LT(off, 1.1 * rounding.quantum[id]) << machine.name << ' ' << m << ' ' << i;
        digits += off > 0.5 * rounding.quantum[id];
      }
    }
    EXPECT_NEAR(run.largest_error_mm(), largest_mm, 1e-3 * largest_mm + 1e-6);
    EXPECT_EQ(run.keeps()[0], 0);
    for (std::size_t i = 1; i < count; ++i) {
      if (run.keeps()[i] == 0) {
        ++others;
        continue;
      }
      ++(i % 2 == 0 ? kept : kept_as_said);
      ASSERT_TRUE(known[i - 1] && known[i]) << machine.name << ' ' << m << ' ' << i;
      for (int k = 0; k <= 8; ++k) {
        MachineState state;
        state.q = JointVector::interpolate(run.joints()[i - 1], run.joints()[i], k / 8.0);
        const Vec3 tip_P =
            tool_pose(forward(machine, state.q, tool, truth.errors(state))).tip_P - compensator.datum_shift();
        ASSERT_LE(distance_to_segment(tip_P, walk.poses[i - 1].tip_P, walk.poses[i].tip_P), tolerance_mm)
            << machine.name << ' ' << m << ' ' << i;
      }
    }
  });
  EXPECT_GT(kept, 1000U);
  EXPECT_GT(kept_as_said, kept);  // what is known is sharper than norms
  EXPECT_GT(others, 500U);
  EXPECT_GT(unknown, 20U);
  EXPECT_LT(digits, kept / 50);
}

// With a flute: the tool points where it is prescribed within the words, as one at a time has it, and over a
// motion that keeps one place of the path serves all points of the flute.
TEST(CorrectionRun, TurnsTheToolAndKeepsItsFlute) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t kept = 0, others = 0, turned = 0, digits = 0;
  each_machine_with_errors(random, [&](const Machine& machine, const TableKinematics& kinematics,
                                       const Model& model, int m) {
    const Vec3 tool = machine.tool_vector();
    const Rounding rounding = test::four_decimals(machine);
    const ModelEvaluator truth(model);
    const Compensator compensator(machine, model, tool);
    CompensationOptions turning;
    turning.orientation = true;
    const Compensator turner(machine, model, tool, turning);
    const test::Calculating lanes(test::kEveryWay[static_cast<std::size_t>(m % 3)]);
    CorrectionRun run(compensator, kinematics, rounding);
    const std::size_t count = points_of_walk(m);
    const PlaceWalk walk = place_walk(machine, kinematics, rounding, random, count);
    const double tolerance_mm = 0.002 * std::exp(2.0 * u(random));
    const double flute_mm = 5.0 + 95.0 * u(random);
    std::vector<CorrectionRun::NominalPlace> places = places_of(walk);
    run.correct(places, tolerance_mm, flute_mm);
    const auto actual = [&](const JointVector& q) {
      MachineState state;
      state.q = q;
      ToolPose pose = tool_pose(forward(machine, q, tool, truth.errors(state)));
      pose.tip_P -= compensator.datum_shift();
      return pose;
    };
    for (std::size_t i = 0; i < count; ++i) {
      if (run.known()[i] == 0) continue;
      const JointVector& q = run.joints()[i];
      MachineState state;
      state.q = walk.nominal[i];
      const auto one = turner.corrected(walk.poses[i].tip_P, walk.poses[i].axis_P, state);
      ASSERT_TRUE(one) << machine.name << ' ' << m << ' ' << i;
      for (const AxisId id : machine.rotary_axes()) {
        const double off = std::abs(q[id] - rounding.rounded(id, one->q[id]));
        ASSERT_LT(off, 1.1 * rounding.quantum[id]) << machine.name << ' ' << m << ' ' << i;
        digits += off > 0.5 * rounding.quantum[id];
      }
      const ToolPose at = actual(q);
      ASSERT_LT((at.tip_P - walk.poses[i].tip_P).norm(), 1.1e-4) << machine.name << ' ' << m << ' ' << i;
      ++turned;
      double half_digits = 0.0;
      for (const AxisId id : machine.rotary_axes()) half_digits += 0.5 * rounding.quantum[id];
      // Where it is prescribed, but for what no turn takes out near the pole.
      ASSERT_LT((at.axis_P - one->axis_P).norm(), 1.1 * half_digits) << machine.name << ' ' << m << ' ' << i;
    }
    for (std::size_t i = 1; i < count; ++i) {
      if (run.keeps()[i] == 0) {
        ++others;
        continue;
      }
      ++kept;
      const FluteSegment segment(
          {walk.poses[i - 1].tip_P, walk.poses[i].tip_P, walk.poses[i - 1].axis_P, walk.poses[i].axis_P},
          flute_mm);
      for (int k = 0; k <= 16; ++k) {
        const double t = k / 16.0;
        const ToolPose at = actual(JointVector::interpolate(run.joints()[i - 1], run.joints()[i], t));
        const double place = segment.nearest(at.tip_P, at.axis_P, t);
        ASSERT_LE(segment.off(at.tip_P, at.axis_P, place).largest_mm(flute_mm), tolerance_mm)
            << machine.name << ' ' << m << ' ' << i;
      }
    }
  });
  EXPECT_GT(kept, 500U);
  EXPECT_GT(others, 500U);
  EXPECT_GT(turned, 4000U);
  EXPECT_LT(digits, turned / 50);
}

// Where the tip stands at the outer rotary axis its own way is short, and what the axis leaves the path by
// decides.
TEST(CorrectionRun, KeepsTheFluteWhereTheTipHardlyMoves) {
  std::mt19937_64 random(20261124);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::size_t kept = 0, others = 0, tip_alone = 0;
  each_machine_with_errors(
      random, [&](const Machine& machine, const TableKinematics& kinematics, const Model& model, int) {
        const Vec3 tool = machine.tool_vector();
        const Rounding rounding = test::four_decimals(machine);
        const ModelEvaluator truth(model);
        const Compensator compensator(machine, model, tool);
        CorrectionRun run(compensator, kinematics, rounding);
        constexpr std::size_t kCount = 60;
        const AxisId outer = machine.rotary_axes().front();
        const Vec3 at_axis_P = machine.axes[outer].point_mm - machine.part_zero_mm;
        PlaceWalk walk;
        JointVector q;
        for (const AxisId id : machine.rotary_axes()) q[id] = 0.3 + 0.2 * u(random);
        for (std::size_t i = 0; i < kCount; ++i) {
          for (const AxisId id : machine.rotary_axes())
            q[id] = std::clamp(q[id] + 0.03 * u(random), std::max(0.1, machine.axes[id].min),
                               std::min(1.2, machine.axes[id].max));
          solve_linear(machine, at_axis_P + 0.5 * Vec3(u(random), u(random), u(random)), tool, q);
          const ToolPose pose = kinematics.pose(q);
          JointVector rounded = q;
          walk.sines.push_back(round_to_words(kinematics, rounding, pose.tip_P, rounded));
          walk.nominal.push_back(rounded);
          walk.poses.push_back(pose);
        }
        const double tolerance_mm = 0.004, flute_mm = 100.0;
        run.correct(places_of(walk), tolerance_mm, 0.0);
        const std::vector<std::uint8_t> tip_keeps(run.keeps().begin(), run.keeps().end());
        run.correct(places_of(walk), tolerance_mm, flute_mm);
        for (std::size_t i = 1; i < kCount; ++i) {
          tip_alone += tip_keeps[i] != 0 && run.keeps()[i] == 0;
          if (run.keeps()[i] == 0) {
            ++others;
            continue;
          }
          ++kept;
          const FluteSegment segment(
              {walk.poses[i - 1].tip_P, walk.poses[i].tip_P, walk.poses[i - 1].axis_P, walk.poses[i].axis_P},
              flute_mm);
          for (int k = 0; k <= 16; ++k) {
            MachineState state;
            state.q = JointVector::interpolate(run.joints()[i - 1], run.joints()[i], k / 16.0);
            ToolPose at = tool_pose(forward(machine, state.q, tool, truth.errors(state)));
            at.tip_P -= compensator.datum_shift();
            const double place = segment.nearest(at.tip_P, at.axis_P, k / 16.0);
            ASSERT_LE(segment.off(at.tip_P, at.axis_P, place).largest_mm(flute_mm), tolerance_mm)
                << machine.name << ' ' << i;
          }
        }
      });
  EXPECT_GT(kept, 100U);
  EXPECT_GT(others, 100U);
  EXPECT_GT(tip_alone, 100U);
}

}  // namespace
}  // namespace trunnion::path
