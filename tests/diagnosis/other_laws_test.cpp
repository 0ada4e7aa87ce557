#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/observations.hpp"
#include "diagnosis/search/formula_terms.hpp"

// Errors that follow another law than the library's, or a recorded column in a way that it lacks: what stood
// for the rest was a step, a drift, the tilt of a set-up.
namespace trunnion::diagnosis {
namespace {

const std::string kHead =
    "minutes = 120\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = 0.8\n"
    "u_common = 0.3\n";

// A warm-up at several speeds, told in 1/min for this power of the speed: truths are proportional to it.
std::string warm_up(double power) {
  std::string speeds;
  for (const auto& [minute, rpm] :
       {std::pair{0, 3000.0}, {25, 9000.0}, {50, 6000.0}, {75, 12000.0}, {100, 0.0}})
    speeds += (speeds.empty() ? "[" : ", [") + std::to_string(minute) + ", " +
              std::to_string(10000.0 * std::pow(rpm / 10000.0, power)) + "]";
  return "[[run]]\nid = \"warm_up\"\n" + kHead + "spindle_rpm = [" + speeds +
         "]\nrepeat = 120\nposes = [[0, 0, 100, 0, 0]]\n";
}

// The readings of a spindle whose growth goes with this power of its speed.
struct Growth {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data;
  Growth(double power, std::uint64_t seed, const std::string& more = "") {
    test::Campaign plan;
    plan.angles = false;
    const std::string rest = test::plan_text(plan);
    const std::string truth =
        "[model]\nname = \"truth\"\n[[effect]]\nid = \"spindle_growth\"\n"
        "[effect.parameters]\nZ_um_per_krpm = 3\nY_um_per_krpm = -1\ntau_s = 900\n" +
        more;
    const Dataset read = test::measured(machine, rest + warm_up(power), truth, seed);
    data = test::measured(machine, rest + warm_up(1.0), "[model]\nname = \"none\"\n", seed);
    for (std::size_t i = 0; i < data.readings.size(); ++i) data.readings[i].value = read.readings[i].value;
  }
  Diagnosis said() const {
    return diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"known\"\n"));
  }
};

TEST(LongOtherLaws, AGrowthWithTheSquareOfTheSpeed) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Diagnosis d = Growth(2.0, seed).said();
    EXPECT_EQ(d.verdict, Verdict::not_in_library) << text_of(d.verdict) << " " << d.paragraph;
    EXPECT_NE(d.paragraph.find("with the square of its speed"), std::string::npos) << d.paragraph;
    EXPECT_TRUE(d.additions.empty()) << d.paragraph;
  }
}

TEST(LongOtherLaws, AGrowthThatTheLibraryHasIsNamed) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Diagnosis d = Growth(1.0, seed).said();
    EXPECT_EQ(d.verdict, Verdict::named) << text_of(d.verdict) << " " << d.paragraph;
    EXPECT_EQ(d.effects, std::vector<std::string>{"spindle_growth"}) << d.paragraph;
  }
}

// The casing follows the bearings: two time constants.
TEST(LongOtherLaws, AGrowthWithTwoTimeConstantsIsNoStep) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Growth growth(1.0, seed);
    const std::string slow =
        "[model]\nname = \"slow\"\n[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\n"
        "Z_um_per_krpm = 2\nY_um_per_krpm = -1\ntau_s = 5000\n";
    const Observations o(growth.machine, growth.data);
    const VectorXd more = o.predicted(test::model_for(growth.machine, growth.data, slow));
    for (std::size_t i = 0; i < growth.data.readings.size(); ++i)
      growth.data.readings[i].value += more[static_cast<Eigen::Index>(i)];
    const Diagnosis d = growth.said();
    const bool step = std::find(d.effects.begin(), d.effects.end(), "step") != d.effects.end();
    EXPECT_FALSE(step && d.confidence > 0.7) << text_of(d.verdict) << " " << d.paragraph;
    EXPECT_NE(d.paragraph.find("growth of the spindle"), std::string::npos) << d.paragraph;
  }
}

// Straightness along Z at four temperatures, which differ by what the frame is warmer than the room.
struct Gradient {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data;
  explicit Gradient(std::uint64_t seed) {
    std::string plan;
    for (const auto& [id, room, frame] : {std::tuple{"z_1", "20.0", "20.1"},
                                          {"z_2", "21.2", "23.4"},
                                          {"z_3", "20.6", "21.9"},
                                          {"z_4", "22.0", "25.8"}})
      plan += test::sweep_run(
          id, "Z", 0, 300, 25, "[[1, 0, 0], [0, 1, 0]]", "displacement", {},
          std::string("T_ambient_degC = [[0, ") + room + "]]\nT_frame_degC = [[0, " + frame + "]]\n");
    for (const std::string axis : {"X", "Y"})
      plan +=
          test::sweep_run("laser_" + axis, axis, -240, 240, 25, axis == "X" ? "[1, 0, 0]" : "[0, 1, 0]",
                          "displacement", {}, "T_ambient_degC = [[0, 20.3]]\nT_frame_degC = [[0, 21.0]]\n");
    data = test::measured(
        machine, plan,
        "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:bend\"\njoint = \"Z\"\ncomponent = "
        "\"EB\"\nexpression = \"k*(T_frame - T_ambient)*Z/300\"\n[effect.parameters]\nk_urad = 12\n",
        seed);
  }
};

TEST(LongOtherLaws, ATiltThatFollowsTwoSensorsIsNoSetUp) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Gradient gradient(seed);
    const Diagnosis d =
        diagnose(gradient.machine, gradient.data,
                 test::model_for(gradient.machine, gradient.data, "[model]\nname = \"known\"\n"));
    EXPECT_FALSE(d.verdict == Verdict::named && d.effects.front() == "setup_tilt") << d.paragraph;
    EXPECT_NE(d.paragraph.find("T_ambient - T_frame"), std::string::npos)
        << text_of(d.verdict) << " " << d.paragraph;
  }
}

// Each run has its temperature: a part of its range that holds whole runs is a name for them.
TEST(Formulas, PartsOfATemperatureDivideARun) {
  const Gradient gradient(1);
  const Observations o(gradient.machine, gradient.data);
  const FormulaTerms all = formula_terms(o);
  std::size_t temperatures = 0;
  for (const FormulaTerm& term : all.terms) {
    temperatures += term.variable.starts_with("T_") ? 1U : 0U;
    for (const TermGate& gate : term.gates)
      EXPECT_FALSE(all.variables[gate.variable].name.starts_with("T_")) << term.text;
  }
  EXPECT_GT(temperatures, 0U);
}

// A probe whose calibration is wrong by a fifth in one run.
TEST(LongOtherLaws, AWrongScaleOfOneRunIsNoThermalEffect) {
  const std::string known =
      "[model]\nname = \"m\"\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 36\nY0C_um = -21\nA0C_urad = "
      "35\nB0C_urad "
      "= -27\n[[effect]]\nid = \"location:A\"\n[effect.parameters]\nY0A_um = 34\nZ0A_um = -19\nB0A_urad = "
      "40\nC0A_urad = -32\n";
  for (const std::uint64_t seed : {1U, 2U}) {
    const Machine machine = test::shipped_machine("trunnion_offset");
    std::string plan;
    for (const auto& [id, ball, room] : {std::tuple{"ball_1", "[80, 0, 60]", "20.3"},
                                         {"ball_2", "[0, 90, 120]", "19.8"},
                                         {"ball_3", "[-70, -40, 40]", "20.6"}})
      plan +=
          std::string("[[run]]\nid = \"") + id + "\"\n" + kHead + "T_ambient_degC = [[0, " + room +
          "]]\ngrid = { A_deg = [-20, 10, 40, 70, 95], C_deg = [0, 60, 130, 190, 250, 310] }\nball_mm = " +
          ball + "\n";
    Dataset data = test::measured(machine, plan, known, seed);
    for (Reading& r : data.readings)
      if (data.context.runs[data.run_of(r)].id == "ball_2") r.value *= 1.25;
    const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, known));
    // With the second seed leaving the run out says it already.
    const std::string wanted = seed == 1 ? "a wrong scale of the readings of run 'ball_2' alone (1.2"
                                         : "The readings of run 'ball_2'";
    EXPECT_NE(d.paragraph.find(wanted), std::string::npos) << text_of(d.verdict) << " " << d.paragraph;
    EXPECT_TRUE(d.confidence <= 0.9 || d.additions.empty()) << text_of(d.verdict) << " " << d.paragraph;
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
