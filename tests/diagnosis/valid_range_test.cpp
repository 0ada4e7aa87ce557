#include "trunnion/diagnosis/evaluate.hpp"

#include "diagnosis/campaigns.hpp"

// A fit says where its readings were, and an evaluation where others lie beyond them.
namespace trunnion::diagnosis {
namespace {

const std::string kKnown =
    "[model]\nname = \"known\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 12\n";

class ValidRange : public testing::Test {
 protected:
  Dataset lasers(double low, double high, const std::string& more = "") const {
    return test::measured(machine_,
                          test::sweep_run("x", "X", low, high, 21, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
                                          "displacement", {}, more) +
                              test::sweep_run("c", "C", 0, 330, 12, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
                                              "displacement", {}, more),
                          kKnown, 1);
  }
  // The fitted model, written and read again.
  Model fitted(const Dataset& data, const std::string& known = kKnown) const {
    return test::model_for(machine_, data,
                           model_text(fit(machine_, data, test::model_for(machine_, data, known)).model));
  }
  static const MeasuredRange& range(const Model& model, const std::string& key) {
    const auto found = std::find_if(model.valid.begin(), model.valid.end(),
                                    [&](const MeasuredRange& r) { return r.key == key; });
    if (found == model.valid.end()) throw std::runtime_error("no range of " + key);
    return *found;
  }

  Machine machine_ = test::thermal_machine("trunnion_offset");
};

TEST_F(ValidRange, IsThatOfTheReadings) {
  const Dataset data = lasers(-150, 100, "T_ambient_degC = [[0, 21], [15, 23.5]]\n");
  const Model model = fitted(data);
  EXPECT_NEAR(range(model, "X_mm").low, -150.0, 1e-6);
  EXPECT_NEAR(range(model, "X_mm").high, 100.0, 1e-6);
  EXPECT_NEAR(range(model, "C_deg").high - range(model, "C_deg").low, 360.0, 1e-6);
  // Temperatures as the plan has them; they rise until the last reading.
  EXPECT_GE(range(model, "T_ambient_degC").low, 21.0 - 1e-6);
  EXPECT_LT(range(model, "T_ambient_degC").low, 21.5);
  EXPECT_GT(range(model, "T_ambient_degC").high, 23.0);
  EXPECT_LE(range(model, "T_ambient_degC").high, 23.5 + 1e-6);
  EXPECT_EQ(evaluate(machine_, data, model).beyond, "");
}

TEST_F(ValidRange, AnEvaluationSaysWhatLiesBeyond) {
  const Model model = fitted(lasers(-150, 100));
  EXPECT_EQ(evaluate(machine_, lasers(-100, 90), model).beyond, "");
  EXPECT_EQ(evaluate(machine_, lasers(-100, 220), model).beyond, "X -100 to 220 mm (measured: -150 to 100)");
  // A model that does not say where it was measured: nothing is said.
  const Dataset far = lasers(-240, 240);
  EXPECT_EQ(evaluate(machine_, far, test::model_for(machine_, far, kKnown)).beyond, "");
}

// A tilt of the spindle and a tool beside its axis are the same with one tool, and not with another.
TEST_F(ValidRange, IsThatOfTheTools) {
  const Model model = fitted(lasers(-150, 100));
  EXPECT_EQ(range(model, "tool_length_mm").low, 150.0);
  EXPECT_EQ(range(model, "tool_length_mm").high, 150.0);
  EXPECT_EQ(evaluate(machine_, lasers(-150, 100, "tool_z_mm = -154\n"), model).beyond, "");
  EXPECT_EQ(evaluate(machine_, lasers(-150, 100, "tool_z_mm = -230\n"), model).beyond,
            "tool length 230 mm (measured: 150)");
}

// What a fit holds is from the readings of an earlier one: both count. Else only its own do.
TEST_F(ValidRange, OfWhatIsHeldIsKept) {
  const std::string valid = "[model]\nname = \"known\"\n[model.valid]\nX_mm = [-240, 50]\n";
  const std::string effect = "[[effect]]\nid = \"location:C\"\n";
  const Dataset data = lasers(-150, 100);
  const Model held =
      fitted(data, valid + effect + "fixed = [\"Y0C_um\"]\n[effect.parameters]\nX0C_um = 12\n");
  EXPECT_NEAR(range(held, "X_mm").low, -240.0, 1e-6);
  EXPECT_NEAR(range(held, "X_mm").high, 100.0, 1e-6);
  const Model anew = fitted(data, valid + effect);
  EXPECT_NEAR(range(anew, "X_mm").low, -150.0, 1e-6);
}

}  // namespace
}  // namespace trunnion::diagnosis
