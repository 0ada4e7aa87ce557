#include "trunnion/diagnosis/formula.hpp"

#include <cmath>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "support/cases.hpp"

// Errors that no effect of the library makes: the formula that is proposed, added to the model, predicts
// other readings of the same machine.
namespace trunnion::diagnosis {
namespace {

std::string ball_runs(const std::vector<std::string>& places, const std::string& a, const std::string& c) {
  std::string out;
  for (std::size_t k = 0; k < places.size(); ++k)
    out += "[[run]]\nid = \"ball_" + std::to_string(k + 1) +
           "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
           "u_random = 0.8\nu_common = 0.3\ngrid = { A_deg = " +
           a + ", C_deg = " + c + " }\nball_mm = " + places[k] + "\n";
  return out;
}

std::string laser_runs(int points) {
  std::string out;
  for (int k = 0; k < 3; ++k)
    out +=
        "[[run]]\nid = \"laser_" + std::to_string(k) +
        "\"\nminutes = 15\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = "
        "0.8\nu_common = 0.3\nboth_directions = true\nsweep = { axis = \"X\", from_mm = -240, to_mm = 240, "
        "points = " +
        std::to_string(points) + " }\n";
  return out;
}

struct HiddenFormula {
  std::string name, joint, component, expression, parameters;
};

double rms_um(const Machine& machine, const Dataset& data, const Model& model) {
  return history_entry(machine, data, model).rms_um;
}

class LongProposedFormulaOf : public testing::TestWithParam<HiddenFormula> {};

TEST_P(LongProposedFormulaOf, PredictsOtherReadings) {
  const HiddenFormula& hidden = GetParam();
  const std::string truth = "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:hidden\"\njoint = \"" +
                            hidden.joint + "\"\ncomponent = \"" + hidden.component + "\"\nexpression = \"" +
                            hidden.expression + "\"\n[effect.parameters]\n" + hidden.parameters;
  const Machine machine = test::thermal_machine("trunnion_offset");
  const std::string seen =
      ball_runs({"[80, 0, 60]", "[0, 90, 120]", "[-70, -40, 40]"}, "[0, 35, 80]",
                "[0, 20, 40, 60, 80, 100, 120, 140, 160, 180, 200, 220, 240, 260, 280, 300, 320, 340]") +
      laser_runs(41);
  const std::string others = ball_runs({"[60, 50, 80]", "[-30, 70, 90]"}, "[-10, 15, 45, 75]",
                                       "[10, 50, 90, 120, 150, 170, 190, 205, 220, 270, 310]") +
                             laser_runs(30);
  const Dataset data = test::measured(machine, seen, truth, 1);
  const Dataset other = test::measured(machine, others, truth, 2);
  const Model empty = test::model_for(machine, data, "[model]\nname = \"base\"\n");
  const Diagnosis d = diagnose(machine, data, empty);
  ASSERT_TRUE(d.formula) << text_of(d.verdict) << ' ' << d.paragraph;
  std::cout << "[ figures  ] " << hidden.name << ": " << text_of(d.verdict) << ", " << d.formula->words
            << "; explains " << d.formula->explained() << ", held out " << *d.formula->heldout_before_um
            << " -> " << *d.formula->heldout_after_um << '\n';
  EXPECT_GT(d.formula->explained(), 0.8);
  EXPECT_LT(*d.formula->heldout_after_um, *d.formula->heldout_before_um);
  Model known = d.base.model;
  known.effects.insert(known.effects.end(), d.additions.begin(), d.additions.end());
  Model with = add_and_fit(machine, data, known, d.formula->alone.effects).model;
  // As they stand: nothing of the other readings is fitted.
  for (Model* model : {&known, &with})
    for (ModelEffect& effect : model->effects)
      for (ParameterValue& p : effect.parameters) p.fixed = true;
  const double noise_um = history_entry(machine, other, with).noise_floor_um;
  const double before = rms_um(machine, other, known), after = rms_um(machine, other, with);
  std::cout << "[ figures  ] other readings: " << before << " -> " << after << " um, noise " << noise_um
            << '\n';
  EXPECT_LT(after, 1.3 * noise_um);
  EXPECT_GT(before, after);
}

INSTANTIATE_TEST_SUITE_P(
    LongKinds, LongProposedFormulaOf,
    testing::Values(HiddenFormula{"product", "C", "EZC", "k * sin(2 * A) * cos(2 * C)", "k_um = 2.5\n"},
                    HiddenFormula{"two turns", "Z", "EXZ",
                                  "k * sin(A) * cos(2 * C) + h * sin(A) * sin(2 * C)",
                                  "k_um = 3.1\nh_um = -2.0\n"},
                    HiddenFormula{"part of the travel", "X", "EYX", "k * (X > 90)", "k_um = 4\n"},
                    HiddenFormula{"worn sector", "C", "EZC", "k * (C > 2.2) * (C < 3.7)", "k_um = 4\n"}));

}  // namespace
}  // namespace trunnion::diagnosis
