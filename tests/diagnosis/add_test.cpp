#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {
namespace {

using namespace trunnion::test;

// Location errors of tens of micrometres, which the model has to fit, hide half a micrometre of the screw.
const std::string kBase =
    "[model]\nname = \"m\"\n[[effect]]\nid = \"location:A\"\n[[effect]]\nid = \"location:C\"\n";
const std::string kTruth =
    "[model]\nname = \"t\"\n[[effect]]\nid = \"location:A\"\n[effect.parameters]\nY0A_um = 18\nZ0A_um = -12\n"
    "B0A_urad = 25\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 14\nA0C_urad = 30\n";
const std::string kScrew = "[[effect]]\nid = \"periodic:X\"\n";

double pitch_mm(const Model& model) {
  const ModelEffect& last = model.effects.back();
  return last.parameters[*last.find("p")].value;
}

struct ScrewData {
  Machine machine = shipped_machine("paper");  // no pitch in its file: it has to be searched
  Dataset data = measured(machine, plan_text({}),
                          kTruth + kScrew + "[effect.parameters]\nsin_um = 1.5\np_mm = 7.3\n", 5);
};

TEST(Fit, FindsAPeriodThatTheModelLeavesOpenBesideLargeBaseErrors) {
  const ScrewData s;
  const Fit found = fit(s.machine, s.data, model_for(s.machine, s.data, kBase + kScrew));
  EXPECT_NEAR(pitch_mm(found.model), 7.3, 0.05);
}

TEST(LongAdd, StartsFromTheShapeThatTheDiagnosisFound) {
  const ScrewData s;
  const Model base = model_for(s.machine, s.data, kBase);
  const Diagnosis said = diagnose(s.machine, s.data, base, {.plan = false});
  ASSERT_EQ(said.effects, std::vector<std::string>{"periodic:X"});
  auto blank = model_effect(said.additions.front().effect);
  EXPECT_NEAR(pitch_mm(add_and_fit(s.machine, s.data, base, {blank}, &said).model), 7.3, 0.05);
}

// A model file holds an effect once: `improve` wrote one with periodic:X twice, and refused to read it.
TEST(Improve, NamesNoEffectThatTheModelHas) {
  const Machine machine = shipped_machine("paper");
  Dataset data = measured(machine, sweep_run("fine", "X", -100, 100, 101, "[1, 0, 0]", "displacement", {}),
                          "[model]\nname = \"t\"\n", 5);
  const Observations o(machine, data);
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const double x = o.state(i).q[0];
    data.readings[static_cast<std::size_t>(i)].value +=
        o.response(0)(i, 0) * 3e-3 * (std::sin(0.86 * x) + std::sin(0.37 * x + 1.0));
  }
  const Model known = model_for(machine, data, "[model]\nname = \"m\"\n" + kScrew);
  const Diagnosis d = diagnose(machine, data, known);
  EXPECT_NE(d.verdict, Verdict::nothing_to_find);
  for (const auto& set : d.sets) EXPECT_EQ(std::find(set.begin(), set.end(), "periodic:X"), set.end());
  const auto steps = improve(machine, data, known);
  for (const ImproveStep& step : steps) {
    Diagnostics diagnostics;
    const std::string text = model_text(step.model);
    EXPECT_TRUE(parse_model(text, "step", machine, data.context, diagnostics)) << text;
  }
}

// A turn about Z moves a ball on a circle about Z along the circle: a ball-bar, which reads the radius, sees
// rounding of it and nothing else.
TEST(Fit, TakesNoRoundingForAMeasurement) {
  const Machine machine = shipped_machine("paper");
  std::string poses;
  for (int k = 0; k < 24; ++k) {
    const double angle = 0.2617 * k;
    poses += std::string(k > 0 ? ", " : "") + "[" + std::to_string(100.0 * std::cos(angle)) + ", " +
             std::to_string(100.0 * std::sin(angle)) + ", 100, 0, 0]";
  }
  Dataset data = measured(machine,
                          "[[run]]\nid = \"bar\"\nminutes = 10\nquantity = \"displacement\"\nn = [1, 0, 0]\n"
                          "u_random = 0.5\nu_common = 0\nposes = [" +
                              poses + "]\n",
                          "[model]\nname = \"t\"\n", 3);
  for (Reading& reading : data.readings) {
    const JointVector q = data.track.state(reading.row).q;
    reading.n = Vec3(q[0], q[1], 0.0).normalized();
  }
  const Fit found = fit(machine, data,
                        model_for(machine, data, "[model]\nname = \"m\"\n[[effect]]\nid = \"setup_tilt\"\n"));
  const ModelEffect& tilt = found.model.effects.front();
  const ParameterValue& turn = tilt.parameters[*tilt.find("C_bar")];
  EXPECT_FALSE(turn.sigma);
  EXPECT_EQ(turn.value, 0.0);
}

// Tilts of set-ups that a run cannot see stay where they started, and do not carry those that it sees away.
TEST(LongAdd, SetUpTiltsThatSomeRunsCannotSeeStayUsual) {
  const Machine machine = shipped_machine("paper");
  std::string truth = "[model]\nname = \"t\"\n[[effect]]\nid = \"setup_tilt\"\n[effect.parameters]\n";
  for (const std::string run : {"straight_x", "straight_y", "straight_z", "angle_X", "angle_Y"})
    truth += "A_" + run + "_urad = 20\nB_" + run + "_urad = -15\nC_" + run + "_urad = 10\n";
  const Dataset data = measured(machine, plan_text({}), truth, 8);
  const Diagnosis said =
      diagnose(machine, data, model_for(machine, data, "[model]\nname = \"m\"\n"), {.plan = false});
  ASSERT_FALSE(said.effects.empty()) << said.paragraph;
  ASSERT_EQ(said.effects.front(), "setup_tilt");
  for (const RankedParameter& p : said.ranking.front().parameters)
    EXPECT_LT(std::abs(p.value), 100.0) << p.key;
}

}  // namespace
}  // namespace trunnion::diagnosis
