#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"

// One ball on a machine whose linear axes follow B and C: positions of X, Y and Z are functions of the two
// angles, and many errors show in the same way.
namespace trunnion::diagnosis {
namespace {

Machine b_c_machine() {
  const auto axis = [](const std::string& name, const std::string& type, const std::string& lines) {
    return "[[axis]]\nname = \"" + name + "\"\ntype = \"" + type + "\"\n" + lines + "\n";
  };
  const std::string text =
      "[machine]\nname = \"B-C table\"\n[tool]\nlength_mm = 150.0\n" +
      axis("X", "linear", "direction = [1, 0, 0]\nmin_mm = -400\nmax_mm = 400") +
      axis("Y", "linear", "direction = [0, 1, 0]\nmin_mm = -300\nmax_mm = 300") +
      axis("Z", "linear", "direction = [0, 0, 1]\nmin_mm = -200\nmax_mm = 600") +
      axis("B", "rotary",
           "direction = [0, -1, 0]\npoint_mm = [0, 0, -100]\nmin_deg = -35\n"
           "max_deg = 110") +
      axis("C", "rotary", "direction = [0, 0, -1]\npoint_mm = [0, 0, -50]\ncyclic = true") +
      "[chain]\ntool = [\"X\", \"Y\", \"Z\"]\npart = [\"B\", \"C\"]\n";
  Diagnostics diagnostics;
  auto machine = parse_machine(text, "b_c.toml", diagnostics);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}

std::string one_ball(const std::string& place) {
  return "[[run]]\nid = \"ball\"\nminutes = 30\nquantity = \"displacement\"\n"
         "n = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = 1.0\nu_common = 0.3\nboth_directions = true\n"
         "grid = { B_deg = [-30, -10, 15, 40, 65, 90, 105], C_deg = [0, 30, 60, 90, 120, 150, 180, 210, 240, "
         "270, 300, 330] }\nball_mm = " +
         place + "\n";
}

const std::string kBallTruth =
    "[model]\nname = \"truth\"\n"
    "[[effect]]\nid = \"location:B\"\n[effect.parameters]\nX0B_um = 14\nZ0B_um = -9\nA0B_urad = 40\n"
    "C0B_urad = -32\n"
    "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 16\nY0C_um = -11\nA0C_urad = 35\n"
    "B0C_urad = -27\n"
    "[[effect]]\nid = \"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = 40\n"
    "[[effect]]\nid = \"squareness:B0Z\"\n[effect.parameters]\nB0Z_urad = -25\n"
    "[[effect]]\nid = \"component:EZB\"\n[effect.parameters]\ncos1_um = 4\nsin1_um = 6\n"
    "[[effect]]\nid = \"component:EZZ\"\n[effect.parameters]\nP1_um = 7\nP2_um = 4\n"
    "[[effect]]\nid = \"component:EXX\"\n[effect.parameters]\nP1_um = 6\nP2_um = -5\nP3_um = 3\n";

std::string all_of(const std::vector<std::string>& ids) {
  std::string out = "[model]\nname = \"m\"\n";
  for (const std::string& id : ids) out += "[[effect]]\nid = \"" + id + "\"\n";
  return out;
}
const std::string kMany =
    all_of({"location:B", "location:C", "squareness:C0Y", "squareness:B0Z", "component:EZB", "component:EXB",
            "component:EZZ", "component:EXX", "component:EYY"});

// Of the linear parameters, in their usual sizes.
double largest(const Model& model) {
  double out = 0.0;
  for (const ModelEffect& effect : model.effects)
    for (std::size_t k = 0; k < effect.effect->info().linear_count(); ++k)
      out = std::max(out, std::abs(effect.parameters[k].value) / effect.effect->info().parameters[k].usual);
  return out;
}

// The readings alone say Y0C = -1518 um and EYY P2 = 4332 um, 866 times the usual 5 um.
TEST(Confounded, ParametersThatOneBallLeavesOpenStayUsual) {
  const Machine machine = b_c_machine();
  const Dataset data = test::measured(machine, one_ball("[30, 0, 20]"), kBallTruth, 3);
  const Fit f = fit(machine, data, test::model_for(machine, data, kMany));
  EXPECT_LT(largest(f.model), 5.0);
  EXPECT_LT(f.chi2, 1.25 * f.dof);
  // What the readings decide is as it was: tilts of the axes, a squareness.
  const auto value = [&](std::size_t effect, const char* name) {
    const ModelEffect& e = f.model.effects[effect];
    return e.parameters[*e.find(name)];
  };
  for (const auto& [effect, name, truth] :
       {std::tuple<std::size_t, const char*, double>{0, "A0B", 40e-6}, {0, "C0B", -32e-6}, {2, "C0Y", 40e-6}})
    EXPECT_NEAR(value(effect, name).value, truth, 4.0 * *value(effect, name).sigma) << name;
  // What they leave open is said.
  EXPECT_TRUE(std::any_of(f.null_directions.begin(), f.null_directions.end(), [](const NullDirection& n) {
    return n.words.find("can hardly be separated") != std::string::npos &&
           n.words.find("P2 (component:EYY)") != std::string::npos;
  }));
}

// EYX P2 was 42 um, P4 27 um (truth 1.8 and 6): improve compensates with what it cannot know. And a fit of a
// fit is the same fit: what is open does not creep away from one step to the next.
TEST(LongConfounded, ImproveKeepsItsParametersUsual) {
  const Machine machine = b_c_machine();
  const Dataset data =
      test::measured(machine, one_ball("[110, 30, 40]"),
                     "[model]\nname = \"truth\"\n"
                     "[[effect]]\nid = \"location:B\"\n[effect.parameters]\nX0B_um = -33.19\nZ0B_um = "
                     "6.276\nA0B_urad = -47.94\nC0B_urad = 49.06\n"
                     "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = -5.115\nY0C_um = "
                     "35.62\nA0C_urad = -5.228\nB0C_urad = -41.02\n"
                     "[[effect]]\nid = \"component:EYX\"\n[effect.parameters]\nP1_um = -7.351\nP2_um = "
                     "-1.804\nP3_um = 2.227\nP4_um = 5.947\n"
                     "[[effect]]\nid = \"squareness:B0Z\"\n[effect.parameters]\nB0Z_urad = 8.001\n"
                     "[[effect]]\nid = \"component:EAY\"\n[effect.parameters]\nP1_urad = -14.78\nP2_urad = "
                     "10.01\nP3_urad = -28.73\nP4_urad = 10.1\n"
                     "[[effect]]\nid = \"component:EXY\"\n[effect.parameters]\nP1_um = -3.751\nP2_um = "
                     "7.481\nP3_um = 4.957\nP4_um = 1.832\n"
                     "[[effect]]\nid = \"component:EXX\"\n[effect.parameters]\nP1_um = -5.109\nP2_um = "
                     "2.755\nP3_um = 1.841\nP4_um = -2.745\n"
                     "[[effect]]\nid = \"component:EXC\"\n[effect.parameters]\ncos1_um = -3.11\nsin1_um = "
                     "6.355\ncos2_um = -2.004\nsin2_um = 2.217\n"
                     "[[effect]]\nid = \"component:EBY\"\n[effect.parameters]\nP1_urad = 27.81\nP2_urad = "
                     "-29.71\nP3_urad = 35.73\nP4_urad = 20.26\n"
                     "[[effect]]\nid = \"component:EAB\"\n[effect.parameters]\ncos1_urad = -12.95\nsin1_urad "
                     "= -19.03\ncos2_urad = -24.4\nsin2_urad = 18.71\n",
                     6);
  const auto steps = improve(machine, data, test::model_for(machine, data, all_of({})));
  EXPECT_GT(steps.size(), 1U);
  for (const ImproveStep& step : steps) EXPECT_LT(largest(step.model), 5.0) << step.model.name;
}

// It was said that no further measurement is needed.
TEST(Confounded, TheNextMeasurementIsAnotherBallOrAnotherTool) {
  const Machine machine = b_c_machine();
  const Dataset data = test::measured(machine, one_ball("[110, 30, 40]"), kBallTruth, 3);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kMany), {.conventions = false});
  ASSERT_TRUE(d.next) << d.paragraph;
  EXPECT_NE(d.next->runs.front().id.find("R-test"), std::string::npos) << d.next->why;
  EXPECT_NE(what_next(d).find("null directions"), std::string::npos) << what_next(d);
  // And when it was made, less is open.
  Diagnostics diagnostics;
  auto plan = parse_plan(one_ball("[110, 30, 40]"), "plan", machine, diagnostics);
  ASSERT_TRUE(plan);
  for (const PlanRun& run : d.next->runs) plan->runs.push_back(run);
  auto more = expand(plan->runs, machine);
  ASSERT_TRUE(more);
  simulate(*more, *plan, machine, test::model_for(machine, *more, kBallTruth), 4);
  const Fit before = fit(machine, data, test::model_for(machine, data, kMany));
  const Fit after = fit(machine, *more, test::model_for(machine, *more, kMany));
  EXPECT_LT(after.null_directions.size(), before.null_directions.size());
}

}  // namespace
}  // namespace trunnion::diagnosis
