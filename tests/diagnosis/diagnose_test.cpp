#include "trunnion/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <set>

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/fit_core.hpp"
#include "support/cases.hpp"

namespace trunnion::diagnosis {
namespace {

using test::Campaign;

const std::string kDiagnoseBase = "[model]\nname = \"base\"\n[[effect]]\nid = \"location:A\"\n";
const std::string kDiagnoseTruth =
    "[model]\nname = \"truth\"\n[[effect]]\nid = \"location:A\"\n[effect.parameters]\nY0A_um = 8\nZ0A_um = "
    "-5\nB0A_urad = 20\nC0A_urad = -15\n";

std::string effect(const std::string& id, const std::string& parameters, const std::string& keys = "") {
  return "[[effect]]\nid = \"" + id + "\"\n" + keys + "[effect.parameters]\n" + parameters;
}

struct Case {
  std::string id, toml;
  Campaign campaign;
  bool location_known = true;  // base and truth hold a location:A
};

Campaign thermal() {
  Campaign c;
  c.angles = false;
  c.thermal = true;
  return c;
}
Campaign feeds() {
  Campaign c;
  c.angles = false;
  c.feeds = true;
  return c;
}

// One effect of every kind; what counts of its parameters is their ratio (`hidden_truth`).
const std::vector<Case>& hidden() {
  static const std::vector<Case> cases = {
      {"location:C", effect("location:C", "X0C_um = 3\nY0C_um = -2\nA0C_urad = 10\nB0C_urad = -8\n"), {}},
      {"squareness:C0Y", effect("squareness:C0Y", "C0Y_urad = 9\n"), {}},
      {"squareness:B0Z", effect("squareness:B0Z", "B0Z_urad = -10\n"), {}},
      {"squareness:A0Z", effect("squareness:A0Z", "A0Z_urad = 10\n"), {}},
      {"component:EYX", effect("component:EYX", "P2_um = 1.5\nP3_um = -1.2\n"), {}},
      {"component:EXX", effect("component:EXX", "P1_um = 1.5\nP2_um = -1\nP4_um = 0.8\n"), {}},
      {"component:EBX", effect("component:EBX", "P1_urad = 2.5\nP2_urad = -2\n"), {}},
      {"component:EZC", effect("component:EZC", "cos1_um = 1.2\nsin2_um = 1\n"), {}},
      {"component:ECC", effect("component:ECC", "cos1_urad = 5\nsin1_urad = -4\n"), {}},
      {"periodic:X", effect("periodic:X", "sin_um = 1.2\ncos_um = 0.8\np_mm = 5\n"), {}},
      {"worm:C", effect("worm:C", "sin_urad = 3\ncos_urad = 2\nn = 36\n"), {}},
      {"backlash:Y", effect("backlash:Y", "b_um = 2.5\n"), {}},
      {"backlash:C", effect("backlash:C", "b_urad = 6\n"), {}},
      {"crosstalk:XY", effect("crosstalk:XY", "P11_um = 40\nP12_um = 20\n", "component = \"EZX\"\n"), {}},
      {"sag:A", effect("sag:A", "A_sin_urad = 10\nY_sin_um = 3\nZ_cos_um = -3\n"), {}},
      {"overhang:Z", effect("overhang:Z", "A_urad_per_m = 25\nB_urad_per_m = -20\n"), {}},
      {"spindle_growth", effect("spindle_growth", "Z_um_per_krpm = 1\nY_um_per_krpm = 0.4\ntau_s = 1800\n"),
       thermal()},
      {"screw_heating:X", effect("screw_heating:X", "alpha_um_per_m_K = 2.5\noffset_um_per_K = 0.2\n"),
       thermal()},
      {"thermal_location:C",
       effect("thermal_location:C", "X_um_per_K = 1\nY_um_per_K = -0.7\ntau_s = 2400\n",
              "sensor = \"frame\"\n"),
       thermal()},
      {"ambient_drift",
       effect("ambient_drift", "X_um_per_K = 1\nY_um_per_K = -0.8\nZ_um_per_K = 1.2\ntau_s = 3000\n"),
       thermal()},
      {"time_drift", effect("time_drift", "X_um_per_h = 2\nY_um_per_h = -1.5\nZ_um_per_h = 2\n"), thermal()},
      {"servo_lag:X", effect("servo_lag:X", "tau_ms = 0.04\n"), feeds()},
      {"spindle_tilt", effect("spindle_tilt", "A0S_urad = 60\nB0S_urad = 50\n"), {}},
      // Beside a free Z0A it is the same motion (AToolLengthIsNoneBesideALocationError).
      {"tool_length", effect("tool_length", "Z0S_um = 3\n"), {}, false},
      {"zero_offset:A", effect("zero_offset:A", "A0A_urad = 20\n"), {}},
      {"tool_offset", effect("tool_offset", "X0S_um = 3\nY0S_um = -2\n"), {}, false},
      {"weight:AC",
       effect("weight:AC", "A_sin_cos_urad = 10\nA_sin_sin_urad = -8\nY_sin_sin_um = 3\nZ_sin_cos_um = 3\n"),
       {}},
      {"unbalance:AC",
       effect("unbalance:AC", "sin_cos_um = 3\nsin_sin_um = -2\n", "component = \"EYC\"\n"),
       {}},
      // Of one ball a tilt is the same as a translation (ATiltOfOneBallIsItsPosition); rotations show it.
      {"setup_tilt",
       effect("setup_tilt", "A_angle_X_urad = 3\nB_angle_Z_urad = -2\nC_angle_Y_urad = 3\n"),
       {}},
      {"step", effect("step", "X_um = 2.5\nY_um = -2\nZ_um = 2\nt_s = 500\n", "run = \"ball_2\"\n"), {}},
  };
  return cases;
}

const std::string& base_of(const Case& c) {
  static const std::string nothing = "[model]\nname = \"base\"\n";
  return c.location_known ? kDiagnoseBase : nothing;
}
std::string truth_without(const Case& c) {
  return c.location_known ? kDiagnoseTruth : "[model]\nname = \"truth\"\n";
}

// The truth with the case's effect scaled to the noncentrality `lambda`: the squared length, in standard
// deviations of the readings, of what base and set-ups cannot imitate of it.
Model hidden_truth(const Case& c, const Machine& machine, const Dataset& clean, double lambda) {
  const Observations o(machine, clean);
  const FitCore base = fit_core(o, test::model_for(machine, clean, base_of(c)), {.robust = false});
  const Model without = test::model_for(machine, clean, truth_without(c));
  Model with = test::model_for(machine, clean, truth_without(c) + c.toml);
  const VectorXd change = o.predicted(with) - o.predicted(without);
  const double seen = base.projected(change).squaredNorm();
  if (seen < 1e-9) throw std::runtime_error(c.id + " cannot be seen in this campaign");
  ModelEffect& effect = with.effects.back();
  for (std::size_t k = 0; k < effect.effect->info().linear_count(); ++k)
    effect.parameters[k].value *= std::sqrt(lambda / seen);
  return with;
}

// The share (in length) of the case's signal that a rival imitates in this campaign.
double imitated(const Case& c, const std::string& rival) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  Diagnostics diagnostics;
  const auto plan = parse_plan(test::plan_text(c.campaign), "plan", machine, diagnostics);
  const Dataset clean = expand(plan.value().runs, machine).value();
  const Observations o(machine, clean);
  const VectorXd change = o.predicted(test::model_for(machine, clean, truth_without(c) + c.toml)) -
                          o.predicted(test::model_for(machine, clean, truth_without(c)));
  const auto left_by = [&](const std::string& model) {
    return fit_core(o, test::model_for(machine, clean, model), {.robust = false})
        .projected(change)
        .squaredNorm();
  };
  return std::sqrt(1.0 - left_by(base_of(c) + effect(rival, "")) / left_by(base_of(c)));
}

Diagnosis diagnosed(const Case& c, double lambda, std::uint64_t seed) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  Diagnostics diagnostics;
  const auto plan = parse_plan(test::plan_text(c.campaign), "plan", machine, diagnostics);
  Dataset data = expand(plan.value().runs, machine).value();
  simulate(data, *plan, machine, hidden_truth(c, machine, data, lambda), seed);
  return diagnose(machine, data, test::model_for(machine, data, base_of(c)));
}

Diagnosis diagnosed(const std::string& truth, const Campaign& campaign, std::uint64_t seed,
                    const std::string& base = kDiagnoseBase,
                    const std::string& machine_name = "trunnion_offset") {
  const Machine machine = test::thermal_machine(machine_name);
  const Dataset data = test::measured(machine, test::plan_text(campaign), truth, seed);
  return diagnose(machine, data, test::model_for(machine, data, base));
}

std::string said(const Diagnosis& d) {
  std::string out(text_of(d.verdict));
  for (const auto& set : d.sets) {
    out += " [";
    for (const auto& id : set) out += (out.back() == '[' ? "" : " ") + id;
    out += "]";
  }
  return out;
}

bool holds(const Diagnosis& d, const std::string& id) {
  return std::any_of(d.sets.begin(), d.sets.end(),
                     [&](const auto& set) { return std::find(set.begin(), set.end(), id) != set.end(); });
}

std::size_t repeats(std::size_t fallback) {
  const char* text = std::getenv("TRUNNION_DIAGNOSIS_SEEDS");
  return text ? static_cast<std::size_t>(std::strtoul(text, nullptr, 10)) : fallback;
}

class Hidden : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(LongDiagnosis, Hidden, testing::Range<std::size_t>(0, 30));

// 98 % at lambda = 100 with rivals below 0.85 is the goal of the benchmark; here every effect once or, by
// TRUNNION_DIAGNOSIS_SEEDS, more often. A nearer rival may come first by the noise: then the verdict says
// that the two cannot be told apart.
TEST_P(Hidden, IsNamedFirst) {
  constexpr double kNearTwin = 0.85;
  const Case& c = hidden().at(GetParam());
  const std::size_t count = repeats(1);
  std::size_t first = 0, in_set = 0;
  for (std::size_t seed = 1; seed <= count; ++seed) {
    const Diagnosis d = diagnosed(c, 100.0, seed);
    const bool right =
        !d.effects.empty() && (d.effects[0] == c.id || (d.verdict == Verdict::ambiguous && holds(d, c.id) &&
                                                        imitated(c, d.effects[0]) > kNearTwin));
    first += right;
    in_set += holds(d, c.id);
    std::cout << (right ? "  ok    " : "  WRONG ") << c.id << " seed " << seed << ": " << said(d) << " conf "
              << d.confidence << " dof " << d.dof << "\n";
  }
  EXPECT_EQ(in_set, count) << c.id;
  EXPECT_GE(50 * first, 49 * count) << c.id;
}

class Null : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(LongDiagnosis, Null,
                         testing::Values("", "noise_factor = 1.2\n", "noise_factor = 0.83\n",
                                         "autocorrelation = 0.5\n", "outlier_fraction = 0.04\n",
                                         "resolution_um = 1\n"));

TEST_P(Null, NamesNothing) {
  const std::size_t count = repeats(3);
  std::map<std::string, std::size_t> verdicts;
  std::size_t alarms = 0;
  for (std::size_t seed = 1; seed <= count; ++seed) {
    Campaign c;
    c.simulation = GetParam();
    c.angles = seed % 2 == 0;
    c.u_common_um = seed % 3 == 0 ? 0.8 : 0.3;
    const Diagnosis d = diagnosed(kDiagnoseTruth, c, 100 + seed);
    ++verdicts[said(d)];
    alarms += d.verdict != Verdict::nothing_to_find && d.verdict != Verdict::data_problem;
  }
  for (const auto& [text, n] : verdicts)
    std::cout << "  " << GetParam() << "  " << n << " x " << text << "\n";
  EXPECT_LE(100 * alarms, count);
}

// A ball on the table only: small enough for every run of the unit tests.
Campaign table_only() {
  Campaign c;
  c.lasers = false;
  c.angles = false;
  return c;
}

TEST(LongDiagnose, NamesALocationErrorAndRecoversItsParameters) {
  const Diagnosis d = diagnosed(kDiagnoseTruth + hidden()[0].toml, table_only(), 7);
  EXPECT_EQ(d.verdict, Verdict::named) << said(d);
  ASSERT_EQ(d.effects, std::vector<std::string>{"location:C"});
  for (const auto& [key, truth] :
       {std::pair{"X0C_um", 3.0}, {"Y0C_um", -2.0}, {"A0C_urad", 10.0}, {"B0C_urad", -8.0}}) {
    const auto& all = d.ranking.at(0).parameters;
    const auto p =
        std::find_if(all.begin(), all.end(), [&](const RankedParameter& q) { return q.key == key; });
    ASSERT_NE(p, all.end()) << key;
    if (p->sigma) {
      EXPECT_NEAR(p->value, truth, 4.0 * *p->sigma) << key;
    }
  }
}

const RankedEffect& ranked(const Diagnosis& d, const std::string& id) {
  const auto it =
      std::find_if(d.ranking.begin(), d.ranking.end(), [&](const RankedEffect& r) { return r.id == id; });
  if (it == d.ranking.end()) throw std::runtime_error(id + " is not ranked");
  return *it;
}

// On an A-C trunnion a ball beside the spindle's axis (X0S) and an axis C that sits beside its place (X0C)
// are the same motion, at every pose: one parameter of location:C does what the smaller effect does.
TEST(LongDiagnose, OneParameterOfALargerEffectIsARival) {
  const std::string nothing = "[model]\nname = \"nothing known\"\n";
  for (const std::string& truth :
       {effect("location:C", "X0C_um = 12\n"), effect("tool_offset", "X0S_um = -12\n")}) {
    const Diagnosis d = diagnosed("[model]\nname = \"truth\"\n" + truth, table_only(), 5, nothing);
    EXPECT_EQ(d.verdict, Verdict::ambiguous) << said(d);
    EXPECT_TRUE(holds(d, "location:C") && holds(d, "tool_offset")) << said(d);
  }
}

// A head or a table that C carries and A tilts leans out over C: sin A cos C, sin A sin C of C's joint.
TEST(LongDiagnose, AWeightThatCSwingsRound) {
  Machine machine = test::thermal_machine("trunnion_offset");
  std::swap(machine.part_chain.front(), machine.part_chain.back());
  const std::string nothing = "[model]\nname = \"nothing known\"\n";
  const std::string weight = effect("weight:AC",
                                    "A_sin_cos_urad = 20\nB_sin_sin_urad = 20\nX_sin_sin_um = 3\n"
                                    "Y_sin_cos_um = -3\n");
  for (int seed = 1; seed <= test::cases(3); ++seed) {
    const auto number = static_cast<std::uint64_t>(seed);
    const auto said_of = [&](const std::string& truth) {
      const Dataset data = test::measured(machine, test::plan_text(table_only()), truth, number);
      return diagnose(machine, data, test::model_for(machine, data, nothing));
    };
    const Diagnosis d = said_of("[model]\nname = \"truth\"\n" + weight);
    EXPECT_EQ(d.verdict, Verdict::named) << said(d);
    EXPECT_EQ(d.effects, std::vector<std::string>{"weight:AC"}) << said(d);
    EXPECT_EQ(said_of("[model]\nname = \"truth\"\n").verdict, Verdict::nothing_to_find);
  }
}

// A longer tool and a trunnion that sits higher (Z0A) move the tool against the part alike, at every pose.
// Of which none stands out: with sets of three a cross-talk stood in for two of them.
TEST(LongDiagnose, FourEffectsAtOnce) {
  const std::string truth =
      kDiagnoseTruth + effect("squareness:C0Y", "C0Y_urad = 30\n") + effect("backlash:Y", "b_um = 4\n") +
      effect("component:EXX", "P1_um = -2\nP2_um = 5\n") + effect("component:EZC", "cos1_um = 3\n");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Diagnosis d = diagnosed(truth, Campaign{}, seed);
    EXPECT_TRUE(d.verdict == Verdict::named || d.verdict == Verdict::ambiguous) << seed << said(d);
    // Others that these runs do not tell from one of them may stand beside it.
    const std::set<std::string> all = {"squareness:C0Y", "backlash:Y", "component:EXX", "component:EZC"};
    EXPECT_TRUE(std::any_of(d.sets.begin(), d.sets.end(), [&](const auto& set) {
      return std::set<std::string>(set.begin(), set.end()) == all;
    })) << said(d);
  }
}

TEST(Diagnose, AToolLengthIsNoneBesideALocationError) {
  const Diagnosis d = diagnosed(kDiagnoseTruth + effect("tool_length", "Z0S_um = 20\n"), table_only(), 3);
  EXPECT_EQ(d.verdict, Verdict::nothing_to_find) << said(d);
  EXPECT_FALSE(ranked(d, "tool_length").excited);
}

// Of one ball, that is one point of the part, a tilt of the part is a translation: the free set-up.
TEST(Diagnose, ATiltOfOneBallIsItsPosition) {
  const Diagnosis d = diagnosed(
      kDiagnoseTruth + effect("setup_tilt", "A_ball_1_urad = 90\nB_ball_2_urad = -80\n"), table_only(), 3);
  EXPECT_EQ(d.verdict, Verdict::nothing_to_find) << said(d);
  EXPECT_FALSE(ranked(d, "setup_tilt").excited);
}

// A short run with large effects: a few smooth functions cannot follow them, so that they look like scatter
// that is large and correlated in time. Their explanation is likelier than such scatter.
TEST(LongDiagnose, LargeEffectsOfAShortRunAreNoScatter) {
  const std::string plan =
      "[[run]]\nid = \"ball\"\nminutes = 10\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, "
      "1]]\n"
      "frame = \"machine\"\ntool_z_mm = -150\nu_random = 0.5\nu_common = 0\n"
      "grid = { A_deg = [0, 45, 90], C_deg = [0, 60, 120, 180, 240, 300] }\nball_mm = [40, 20, 30]\n";
  const Machine machine = test::thermal_machine("trunnion_offset");
  const std::string nothing = "[model]\nname = \"nothing known\"\n";
  for (const auto& [id, parameters] : {std::pair{"location:C", "X0C_um = 12\nY0C_um = -7\n"},
                                       {"component:EZC", "cos1_um = 30\nsin2_um = 25\n"},
                                       {"sag:A", "A_sin_urad = 150\nY_sin_um = 40\nZ_cos_um = -40\n"}}) {
    const std::string truth = "[model]\nname = \"truth\"\n" + effect(id, parameters);
    for (int seed = 1; seed <= test::cases(3); ++seed) {
      const Dataset data = test::measured(machine, plan, truth, static_cast<std::uint64_t>(seed));
      const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, nothing));
      EXPECT_TRUE(holds(d, id)) << id << ": " << said(d);
      EXPECT_LT(d.scatter.factor, 1.5) << id;  // 54 readings: 1.2 is 3 standard deviations
    }
  }
}

TEST(Diagnose, FindsNothingWhereNothingIs) {
  const Diagnosis d = diagnosed(kDiagnoseTruth, table_only(), 8);
  EXPECT_EQ(d.verdict, Verdict::nothing_to_find) << said(d);
  EXPECT_TRUE(d.effects.empty());
}

TEST(Diagnose, AWrongUncertaintyIsADataProblem) {
  Campaign c = table_only();
  c.simulation = "noise_factor = 1.5\n";
  EXPECT_EQ(diagnosed(kDiagnoseTruth, c, 9).verdict, Verdict::data_problem);
}

TEST(LongDiagnose, TheSameRunTwiceIsADataProblem) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data = test::measured(machine, test::plan_text(table_only()), kDiagnoseTruth, 1);
  const std::string text = measurements_text(data, machine);
  const std::vector<NamedText> files = {{"a.csv", text}, {"b.csv", text}};
  Diagnostics diagnostics;
  const auto both = parse_measurements(files, machine, diagnostics);
  ASSERT_TRUE(both);
  EXPECT_EQ(diagnose(machine, *both, test::model_for(machine, *both, kDiagnoseBase)).verdict,
            Verdict::data_problem);
}

// Some rows of a run once more at the end of the file.
TEST(Diagnose, RowsThatStandAgainAtTheEndAreADataProblem) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const Dataset data = test::measured(machine, test::plan_text(table_only()), kDiagnoseTruth, 1);
  std::vector<MachineState> states;
  std::vector<RowOrigin> rows = data.rows;
  std::vector<Reading> readings = data.readings;
  for (std::size_t i = 0; i < data.track.size(); ++i) states.push_back(data.track.state(i));
  const std::size_t again = readings.size() / 20;
  for (std::size_t i = 0; i < again; ++i) {
    readings.push_back(data.readings[10 + i]);
    states.push_back(data.track.state(readings.back().row));
    rows.push_back(data.rows[readings.back().row]);
    readings.back().row = states.size() - 1;
  }
  Dataset twice = make_dataset(data.context, states, rows, readings);
  twice.files = data.files;
  const Diagnosis d = diagnose(machine, twice, test::model_for(machine, twice, kDiagnoseBase));
  EXPECT_EQ(d.verdict, Verdict::data_problem) << said(d);
  EXPECT_NE(d.paragraph.find("stand twice"), std::string::npos) << said(d);
}

}  // namespace
}  // namespace trunnion::diagnosis
