#include "trunnion/diagnosis/evaluate.hpp"

#include "diagnosis/campaigns.hpp"

namespace trunnion::diagnosis {
namespace {

// What `fit` writes, `evaluate` reads: `crosstalk:XY` without a component was written with values and no
// component, and refused.
TEST(LongRoundTrip, EveryEffectIsFittedWrittenReadAndEvaluated) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  test::Campaign everything;
  everything.thermal = everything.feeds = true;
  const Dataset data =
      test::measured(machine, test::plan_text(everything),
                     "[model]\nname = \"truth\"\n[[effect]]\nid = \"crosstalk:XY\"\ncomponent = "
                     "\"EZX\"\n[effect.parameters]\n"
                     "P11_um = 8\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 12\n",
                     1);
  for (const EffectFamily& family : effect_library(machine, data.context)) {
    const Model open =
        test::model_for(machine, data, "[model]\nname = \"m\"\n[[effect]]\nid = \"" + family.id() + "\"\n");
    const Fit fitted = fit(machine, data, open, {.robust = false});
    Diagnostics diagnostics;
    const std::string text = model_text(fitted.model);
    const auto read = parse_model(text, "fitted.toml", machine, data.context, diagnostics);
    ASSERT_TRUE(read) << family.id() << ": " << read.error().text() << "\n" << text;
    const Evaluation said = evaluate(machine, data, *read);
    EXPECT_NEAR(said.chi2, fitted.chi2, 1e-6 * fitted.chi2) << family.id();
    // Fitted again, it is the same model.
    const Fit again = fit(machine, data, *read, {.robust = false});
    EXPECT_NEAR(again.chi2, fitted.chi2, 1e-3 * fitted.chi2) << family.id();
  }
}

// The component that fits best, not the first.
TEST(RoundTrip, AFitTakesTheVariantThatFitsBest) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const std::string head = "[model]\nname = \"m\"\n[[effect]]\nid = \"crosstalk:XY\"\n";
  std::string plan;
  for (const int y : {-200, -100, 0, 100, 200})
    plan += test::sweep_run("y" + std::to_string(y), "X", -200, 200, 9, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
                            "rotation", {}, "at = { Y_mm = " + std::to_string(y) + " }\n");
  const Dataset data =
      test::measured(machine, plan, head + "component = \"ECX\"\n[effect.parameters]\nP21_urad = 9\n", 2);
  const Fit f = fit(machine, data, test::model_for(machine, data, head));
  EXPECT_LT(f.chi2, 1.3 * f.dof);
  EXPECT_NE(model_text(f.model).find("component = 'EC"), std::string::npos) << model_text(f.model);
}

// Variants of one effect may have parameters that others lack.
TEST(RoundTrip, VariantsOfMoreParametersAreFittedToo) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const std::string head = "[model]\nname = \"m\"\n[[effect]]\nid = \"unbalance:AC\"\n";
  test::Campaign campaign;
  const Dataset data = test::measured(machine, test::plan_text(campaign),
                                      head +
                                          "component = \"EAA\"\n[effect.parameters]\nsin_cos_urad = 30\n"
                                          "cos_cos_urad = -40\ncos_sin_urad = 35\n",
                                      3);
  const Fit f = fit(machine, data, test::model_for(machine, data, head));
  EXPECT_LT(f.chi2, 1.3 * f.dof);
  const std::string text = model_text(f.model);
  EXPECT_NE(text.find("component = 'EAA'"), std::string::npos) << text;
  EXPECT_NE(text.find("cos_sin_urad"), std::string::npos) << text;
}

}  // namespace
}  // namespace trunnion::diagnosis
