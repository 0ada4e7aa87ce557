#include "trunnion/effects/model.hpp"

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <thread>
#include <tuple>

#include "trunnion/effects/model_paths.hpp"
#include "trunnion/effects/state_track.hpp"

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

using testing::HasSubstr;

class ModelFile : public testing::Test {
 protected:
  ModelFile() : machine_(test::effect_machine("trunnion_offset")) {
    folder_ =
        std::filesystem::temp_directory_path() /
        ("trunnion_model_test_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  ~ModelFile() override { std::filesystem::remove_all(folder_); }

  Result<Model> read(const std::string& text) {
    diagnostics_ = {};
    return parse_model(text, (folder_ / "m.toml").string(), machine_, test::effect_context(), diagnostics_);
  }
  Model good(const std::string& text) {
    auto model = read(text);
    EXPECT_TRUE(model) << (model ? "" : model.error().text());
    return model.value_or(Model{});
  }
  // The message of the only error, with its line and column.
  std::string error_of(const std::string& text) {
    const auto model = read(text);
    EXPECT_FALSE(model);
    EXPECT_EQ(diagnostics_.error_count(), 1u);
    for (const Finding& f : diagnostics_.findings()) {
      if (f.severity == Severity::error) {
        return std::to_string(f.where.line) + ":" + std::to_string(f.where.column) + ": " + f.message;
      }
    }
    return {};
  }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  Machine machine_;
  std::filesystem::path folder_;
  Diagnostics diagnostics_;
};

TEST_F(ModelFile, ReadsTheExampleOfTheInterface) {
  const Model m = good(R"toml([model]
name = "after the collision"
parent = "previous.toml"

[[effect]]
id = "location:C"
fixed = ["A0C_urad"]
prior = true
[effect.parameters]
X0C_um = 12.0
Y0C_um = -3.0
A0C_urad = 0
B0C_urad = 0
[effect.sigma]
X0C_um = 0.4

[[effect]]
id = "user:coolant_lift"
joint = "Z"
component = "EZZ"
expression = "k * lag(s_coolant, tau)"
[effect.parameters]
k_um = 0
tau_s = 600
)toml");
  EXPECT_EQ(m.name, "after the collision");
  EXPECT_EQ(m.parent, "previous.toml");
  ASSERT_EQ(m.effects.size(), 2u);
  const ModelEffect& c = m.effects[0];
  EXPECT_DOUBLE_EQ(c.parameters[0].value, 0.012);
  EXPECT_DOUBLE_EQ(c.parameters[1].value, -0.003);
  EXPECT_DOUBLE_EQ(*c.parameters[0].sigma, 0.0004);
  EXPECT_TRUE(c.parameters[0].prior);
  EXPECT_FALSE(c.parameters[1].prior);
  EXPECT_TRUE(c.parameters[2].fixed);
  const ModelEffect& user = m.effects[1];
  EXPECT_EQ(user.effect->info().kind, EffectClass::thermal);
  ASSERT_EQ(user.effect->info().linear_count(), 1u);
  EXPECT_EQ(user.effect->info().parameters[0].key(), "k_um");
  EXPECT_EQ(user.effect->info().parameters[1].key(), "tau_s");
  EXPECT_DOUBLE_EQ(user.parameters[1].value, 600.0);
}

TEST_F(ModelFile, AcceptsEverySpellingOfASymbol) {
  for (const char* key : {"X0C_um", "XOC_um", "EX0C_um", "EXOC_um"}) {
    const Model m =
        good(std::string("[[effect]]\nid = \"location:C\"\n[effect.parameters]\n") + key + " = 7\n");
    ASSERT_EQ(m.effects.size(), 1u) << key;
    EXPECT_DOUBLE_EQ(m.effects[0].parameters[0].value, 0.007) << key;
  }
  EXPECT_EQ(good("[[effect]]\nid = \"squareness:COY\"\n[effect.parameters]\nCOY_urad = 5\n").effects[0].id(),
            "squareness:C0Y");
  EXPECT_DOUBLE_EQ(good("[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_mm = 0.007\n")
                       .effects[0]
                       .parameters[0]
                       .value,
                   0.007);
}

TEST_F(ModelFile, AnEffectMayStandWithoutAnyValue) {
  const Model m = good("[[effect]]\nid = \"spindle_growth\"\n");
  EXPECT_EQ(m.effects[0].parameters[0].value, 0.0);
  EXPECT_FALSE(m.effects[0].parameters[0].given);
  EXPECT_EQ(m.effects[0].parameters[2].value, 2000.0);
  const Model x = good("[[effect]]\nid = \"crosstalk:XY\"\n");
  EXPECT_FALSE(x.effects[0].variant_given);
}

TEST_F(ModelFile, NamesVariantsByTheirKeys) {
  const Model m = good(R"([[effect]]
id = "crosstalk:XZ"
component = "EBZ"
[effect.parameters]
P11_urad = 3
[[effect]]
id = "crosstalk:XZ"
component = "EY"
axis = "Z"
[[effect]]
id = "thermal_location:A"
sensor = "oil"
[effect.parameters]
Y_um_per_K = 2
tau_s = 900
[[effect]]
id = "step"
run = "r9"
[effect.parameters]
X_um = 4
t_s = 100
[[effect]]
id = "setup_tilt"
[effect.parameters]
A_r2_urad = 8
C_late_urad = 9
)");
  EXPECT_EQ(m.effects[0].effect->info().variant[0].second, "EBZ");
  EXPECT_EQ(m.effects[1].effect->info().variant[0].second, "EYZ");
  EXPECT_EQ(m.context.names.temperatures.back(), "oil");
  EXPECT_EQ(m.context.runs.size(), 4u);
  EXPECT_EQ(m.context.runs[2].id, "r9");
  EXPECT_EQ(m.context.runs[3].id, "late");
  EXPECT_EQ(missing_sensors(m, test::effect_context()), std::vector<std::string>{"T_oil"});
  EXPECT_DOUBLE_EQ(m.effects[4].parameters[*m.effects[4].find("C_late_urad")].value, 9e-6);
}

TEST_F(ModelFile, TheFixedPointOfAScrewFollowsFromItsLine) {
  const Model m = good(
      "[[effect]]\nid = \"screw_heating:X\"\n[effect.parameters]\nx_fixed_mm = -300\nalpha_um_per_m_K = "
      "11\n");
  EXPECT_DOUBLE_EQ(m.effects[0].parameters[0].value, 11e-6);
  EXPECT_NEAR(m.effects[0].parameters[1].value, 300.0 * 11e-6, 1e-18);
  EXPECT_NEAR(m.effects[0].effect->derived(m.effects[0].values())[0].value, -300.0, 1e-9);
}

TEST_F(ModelFile, SaysWhereAndWhatIsWrong) {
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:D\"\n"),
              HasSubstr("2:1: machine 'A-C trunnion with offset' has no effect 'location:D'; of this kind it "
                        "has location:A, location:C"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0D_um = 1\n"),
              HasSubstr("4:1: unknown parameter 'X0D_um' of 'location:C'; it has X0C_um, Y0C_um"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C = 1\n"),
              HasSubstr("4:1: key 'X0C' has no unit: write 'X0C_um'"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\nfixxed = []\n"),
              HasSubstr("3:1: unknown key 'fixxed'"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = nan\n"),
              HasSubstr("4:1: 'X0C_um' must be a finite number"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[effect.sigma]\nX0C_um = 0\n"),
              HasSubstr("4:1: 'X0C_um' in [effect.sigma] must be above 0"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\nprior = true\n"),
              HasSubstr("3:1: 'prior = true' needs"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[[effect]]\nid = \"location:C\"\n"),
              HasSubstr("4:1: effect 'location:C' stands twice; the first is in line 2"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"crosstalk:XY\"\n[effect.parameters]\nP11_um = 2\n"),
              HasSubstr("does not say which component"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"crosstalk:XY\"\ncomponent = \"EXZ\"\n"),
              HasSubstr("has no component = \"EXZ\"; choices: component = \"EXX\""));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 1\nXOC_um = 2\n"),
              HasSubstr("5:1: 'XOC_um' is given twice"));
  EXPECT_THAT(error_of("[modell]\nname = \"x\"\n"), HasSubstr("1:2: unknown key 'modell'"));
  EXPECT_THAT(error_of("[setup]\ntranslation = \"loose\"\n"), HasSubstr("2:1: 'translation' is \"loose\""));
  EXPECT_THAT(error_of("[[effect]]\nid = 5\n"), HasSubstr("2:1: 'id' must be a string"));
}

TEST_F(ModelFile, FormulasSayWhereTheyAreWrong) {
  const std::string head = "[[effect]]\nid = \"user:u\"\njoint = \"Z\"\ncomponent = \"EZZ\"\nexpression = \"";
  const std::string tail = "\"\n[effect.parameters]\nk_um = 1\n";
  EXPECT_THAT(error_of(head + "k * foo" + tail), HasSubstr("5:1: formula \"k * foo\" uses 'foo'"));
  EXPECT_THAT(error_of(head + "k * (X" + tail), HasSubstr("5:1: formula \"k * (X\", character"));
  EXPECT_THAT(error_of(head + "3 * X" + tail), HasSubstr("parameter 'k_um' stands nowhere"));
  EXPECT_THAT(error_of(head + "k * lag(X + Y, 300)" + tail), HasSubstr("lag follows a single variable"));
  EXPECT_THAT(
      error_of("[[effect]]\nid = \"user:u\"\njoint = \"Q\"\ncomponent = \"EZQ\"\nexpression = \"X\"\n"),
      HasSubstr("3:1: 'joint' is 'Q'"));
  EXPECT_THAT(
      error_of("[[effect]]\nid = \"user:u\"\njoint = \"Z\"\ncomponent = \"EZX\"\nexpression = \"X\"\n"),
      HasSubstr("4:1: 'component' is 'EZX'"));
}

TEST_F(ModelFile, FormulasFindTheirLinearParameters) {
  const auto linear_of = [&](const std::string& expression, const std::string& parameters) {
    const Model m = good("[[effect]]\nid = \"user:u\"\njoint = \"Z\"\ncomponent = \"EZZ\"\nexpression = \"" +
                         expression + "\"\n[effect.parameters]\n" + parameters);
    std::string out;
    for (const Parameter& p : m.effects.at(0).effect->info().parameters)
      out += p.name + (p.role == ParameterRole::linear ? "+ " : "- ");
    return out;
  };
  EXPECT_EQ(linear_of("a * sin(X / p) + b * cos(X / p)", "a_um = 1\nb_um = 2\np_mm = 5\n"), "a+ b+ p- ");
  EXPECT_EQ(linear_of("k * scale * T_cradle", "k_um = 1\nscale = 1\n"), "k+ scale- ");
  EXPECT_EQ(linear_of("k * lag(rpm, tau)^2", "k_um = 1\ntau_s = 900\n"), "k+ tau- ");
  EXPECT_EQ(linear_of("a * A + b * A^2 + c", "a_um = 1\nb_um = 1\nc_um = 1\n"), "a+ b+ c+ ");
  EXPECT_EQ(linear_of("a * exp(b * T_ambient) * dir_X", "a_um = 1\nb = 0.1\n"), "a+ b- ");
}

TEST_F(ModelFile, FormulasEvaluateWhatTheySay) {
  const Model m = good(R"([[effect]]
id = "user:u"
joint = "Y"
component = "EAY"
expression = "k * (X + 2 * C) * dir_Y + 1e-6 * vel_Z + g * lag(T_cradle, 2 * tau) * s_coolant + h * t * rpm"
[effect.parameters]
k_urad = 3
tau_s = 400
g_urad_per_K = 5
h = 1e-12
)");
  test::RandomStates random(machine_, 3);
  const ModelEvaluator evaluator(m);
  ASSERT_EQ(evaluator.lags().size(), 1u);
  EXPECT_EQ(evaluator.lags()[0].tau_s, 800.0);
  EXPECT_EQ(evaluator.lags()[0].signal, (Signal{Signal::Kind::temperature, 4}));
  for (int i = 0; i < 20; ++i) {
    const MachineState& s = random.next();
    const double lagged = random.uniform(-3.0, 8.0);
    const ChainErrors e = evaluator.errors(s, std::array{lagged});
    const double want = 3e-6 * (s.q[0] + 2.0 * s.q[4]) * s.direction[1] + 1e-6 * s.velocity[2] +
                        5e-6 * lagged * s.state[0] + 1e-12 * s.time_s * s.spindle_rpm;
    EXPECT_NEAR(e.joint[1].rot_rad.x(), want, 1e-12 * std::max(1.0, std::abs(want) * 1e6));
  }
}

TEST_F(ModelFile, FormulasMayBeEvaluatedByManyThreads) {
  const Model m = good(
      "[[effect]]\nid = \"user:u\"\njoint = \"Z\"\ncomponent = \"EZZ\"\nexpression = \"k * sin(X / "
      "50)\"\n[effect.parameters]\nk_um = 3\n");
  const ModelEvaluator evaluator(m);
  std::vector<std::thread> threads;
  std::atomic<int> wrong = 0;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 5000; ++i) {
        MachineState s;
        s.q[0] = 10.0 * t + 0.01 * i;
        if (std::abs(evaluator.errors(s).joint[2].trans_mm.z() - 0.003 * std::sin(s.q[0] / 50.0)) > 1e-15)
          ++wrong;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(ModelFile, LagsFollowAProgramThroughItsTrack) {
  const Model m = good(
      "[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = 2\nY_um_per_krpm = 0\ntau_s "
      "= 1000\n");
  EXPECT_FALSE(lag_requests(m).empty());
  std::vector<MachineState> rows(2);
  rows[0].spindle_rpm = rows[1].spindle_rpm = 9000.0;
  rows[0].run = rows[1].run = 0;
  rows[1].time_s = 1000.0;
  const StateTrack track(rows);
  const ModelEvaluator evaluator(m);
  const auto lagged = track.lag(evaluator.lags()[0]);
  const double lift = evaluator.errors(track.state(1), std::array{lagged[1]}).spindle.trans_mm.z();
  EXPECT_NEAR(lift, 0.002 * 9.0 * (1.0 - std::exp(-1.0)), 1e-12);
  EXPECT_EQ(evaluator.errors(track.state(1)).spindle.trans_mm.z(), 0.0);  // no lags given: at rest
}

TEST_F(ModelFile, TablesStandBesideTheModel) {
  write("exx.csv", "# laser, 2026\nX_mm,EXX_um,EBX_urad\n-100,0,5\n100,4,5\n0,1,5\n");
  const Model m = good("[[effect]]\nid = \"component:EXX\"\ntable = \"exx.csv\"\n");
  MachineState s;
  s.q[0] = 50.0;
  EXPECT_NEAR(chain_errors(m, s).joint[0].trans_mm.x(), 0.0025, 1e-15);
  s.q[0] = 150.0;
  EXPECT_NEAR(chain_errors(m, s).joint[0].trans_mm.x(), 0.004, 1e-15);
  const RangeCheck check = ModelEvaluator(m).check_range(s);
  EXPECT_EQ(check.verdict, RangeCheck::Verdict::held);
  EXPECT_THAT(check.message, HasSubstr("ends at 100 mm of X; the machine is at 150 mm"));
  EXPECT_EQ(model_text(m), model_text(good(model_text(m))));
  const Model strict = good("[[effect]]\nid = \"component:EXX\"\ntable = \"exx.csv\"\noutside = \"error\"\n");
  EXPECT_EQ(ModelEvaluator(strict).check_range(s).verdict, RangeCheck::Verdict::refused);
  EXPECT_THAT(error_of("[[effect]]\nid = \"component:EYX\"\ntable = \"exx.csv\"\n"),
              HasSubstr("has no column EYX; it has EXX, EBX"));
  EXPECT_THAT(error_of("[[effect]]\nid = \"component:EXX\"\ntable = \"none.csv\"\n"), HasSubstr("3:1: "));
  EXPECT_THAT(error_of("[[effect]]\nid = \"location:C\"\ntable = \"exx.csv\"\n"),
              HasSubstr("a table belongs to a component error"));
  EXPECT_THAT(
      error_of("[[effect]]\nid = \"component:EXX\"\ntable = \"exx.csv\"\ninterpolation = \"bilinear\"\n"),
      HasSubstr("bilinear interpolation takes two arguments"));
}

// The evaluator's own way with straight tables: against the effects themselves, at random positions, ends and
// nodes among them.
TEST_F(ModelFile, TablesAreReadAsTheirEffectsReadThem) {
  write("x.csv", "X_mm,EXX_um,EBX_urad,EZX_um\n-100,0,5,1\n-20,3,-4,2\n100,4,5,0\n0,1,5,-7\n");
  write("c.csv", "C_deg,EXC_um\n0,0\n90,1\n180,2\n270,3\n");
  std::string text = "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 12\n";
  for (const char* component : {"EXX", "EBX", "EZX"})
    text += std::string("[[effect]]\nid = \"component:") + component + "\"\ntable = \"x.csv\"\n";
  text += "[[effect]]\nid = \"component:EXC\"\ntable = \"c.csv\"\n";
  const Model m = good(text);
  const ModelEvaluator evaluator(m);
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> x(-130.0, 130.0);
  std::uniform_real_distribution<double> c(-7.0, 7.0);
  for (int i = 0; i < 20000; ++i) {
    MachineState s;
    s.q[0] =
        i % 10 == 0 ? std::array{-100.0, -20.0, 0.0, 100.0}[static_cast<std::size_t>(i / 10 % 4)] : x(random);
    s.q[4] = c(random);
    Twist expected;
    bool held = false;
    for (std::size_t k = 1; k <= 3; ++k) {
      expected += m.effects[k].effect->fixed_part(s, {}, {});
      held = held || m.effects[k].effect->check_range(s).verdict != RangeCheck::Verdict::inside;
    }
    const ChainErrors errors = evaluator.errors(s);
    ASSERT_LT((errors.joint[0].trans_mm - expected.trans_mm).norm(), 1e-17) << s.q[0];
    ASSERT_LT((errors.joint[0].rot_rad - expected.rot_rad).norm(), 1e-17) << s.q[0];
    ASSERT_EQ(evaluator.check_range(s).verdict != RangeCheck::Verdict::inside, held) << s.q[0];
  }
}

TEST_F(ModelFile, ATableWithALineBesideASquarenessGivesOneNote) {
  write("exy.csv", "Y_mm,EXY_um\n-100,-2\n0,0\n100,2\n");
  good(
      "[[effect]]\nid = \"component:EXY\"\ntable = \"exy.csv\"\n[[effect]]\nid = "
      "\"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = 10\n");
  ASSERT_EQ(diagnostics_.findings().size(), 1u);
  EXPECT_EQ(diagnostics_.findings()[0].severity, Severity::note);
  EXPECT_THAT(diagnostics_.findings()[0].message,
              HasSubstr("contains a line of 20.0 urad beside squareness:C0Y"));
  good("[[effect]]\nid = \"component:EXY\"\ntable = \"exy.csv\"\n");
  EXPECT_TRUE(diagnostics_.findings().empty());
}

TEST_F(ModelFile, ATwoDimensionalTableIsAFunctionOfBothAxes) {
  write("ezx.csv", "EZX_um,Y_mm,X_mm\n1,0,0\n2,0,100\n3,50,0\n5,50,100\n");
  const Model m = good("[[effect]]\nid = \"component:EZX\"\ntable = \"ezx.csv\"\n");
  MachineState s;
  s.q[0] = 25.0;
  s.q[1] = 10.0;
  EXPECT_NEAR(chain_errors(m, s).joint[0].trans_mm.z(), 1e-3 * (0.8 * 1.25 + 0.2 * 3.5), 1e-15);
  EXPECT_EQ(m.effects[0].effect->file_keys()[1].second, "bilinear");
}

TEST_F(ModelFile, ATableOverATurnHoldsForEveryTurn) {
  write("c.csv", "C_deg,EXC_um\n0,0\n90,1\n180,2\n270,3\n");
  const Model m = good("[[effect]]\nid = \"component:EXC\"\ntable = \"c.csv\"\n");
  const ModelEvaluator evaluator(m);
  const auto at = [&](double deg) {
    MachineState s;
    s.q[4] = Angle::degrees(deg).rad();
    EXPECT_EQ(evaluator.check_range(s).verdict, RangeCheck::Verdict::inside) << deg;
    return 1e3 * evaluator.errors(s).joint[4].trans_mm.x();
  };
  for (const double turn : {-720.0, 0.0, 360.0, 3600.0}) {
    EXPECT_NEAR(at(turn + 45.0), 0.5, 1e-9);
    EXPECT_NEAR(at(turn + 180.0), 2.0, 1e-9);
    EXPECT_NEAR(at(turn + 315.0), 1.5, 1e-9);  // closes from 3 at 270 deg to 0 at 360 deg
  }
}

TEST_F(ModelFile, ATableOverAPartOfATurnHoldsItsNearerEnd) {
  write("a.csv", "A_deg,EZA_um\n-30,1\n0,2\n60,5\n");
  const Model m = good("[[effect]]\nid = \"component:EZA\"\ntable = \"a.csv\"\n");
  const ModelEvaluator evaluator(m);
  for (const auto& [deg, um, held] : {std::tuple{-40.0, 1.0, true}, {30.0, 3.5, false}, {100.0, 5.0, true}}) {
    MachineState s;
    s.q[3] = Angle::degrees(deg).rad();
    EXPECT_EQ(evaluator.check_range(s).verdict == RangeCheck::Verdict::held, held) << deg;
    EXPECT_NEAR(1e3 * evaluator.errors(s).joint[3].trans_mm.z(), um, 1e-9) << deg;
  }
}

TEST_F(ModelFile, TablesAreFoundFromWhereTheModelIsWritten) {
  write("exx.csv", "X_mm,EXX_um\n-100,0\n100,4\n");
  const Model m = good("[[effect]]\nid = \"component:EXX\"\ntable = \"exx.csv\"\n");
  std::filesystem::create_directories(folder_ / "deep" / "er");
  const std::string target = (folder_ / "deep" / "er" / "new.toml").string();
  const std::string text = model_text(written_to(m, target));
  EXPECT_THAT(text, HasSubstr("../../exx.csv"));
  EXPECT_TRUE(parse_model(text, target, machine_, {}, diagnostics_));
  EXPECT_EQ(model_text(written_to(m, (folder_ / "other.toml").string())), model_text(m));
}

TEST_F(ModelFile, KeepsEvidence) {
  const std::string text =
      "[model]\nname = \"m\"\n\n[[effect]]\nid = \"backlash:X\"\n\n[effect.parameters]\nb_um = "
      "3.5\n\n[effect.evidence]\np_value = 1e-09\nwhy = \"both directions\"\n";
  const Model m = good(text);
  EXPECT_EQ(m.effects[0].evidence.size(), 2u);
  EXPECT_EQ(model_text(m), model_text(good(model_text(m))));
  EXPECT_THAT(model_text(m), HasSubstr("both directions"));
}

TEST_F(ModelFile, SwitchesTurnClassesOff) {
  const Model m = good("[[effect]]\nid = \"location:C\"\n[[effect]]\nid = \"spindle_growth\"\n");
  const Model geometric = filtered(m, [](const EffectInfo& i) { return i.kind != EffectClass::thermal; });
  ASSERT_EQ(geometric.effects.size(), 1u);
  EXPECT_EQ(geometric.effects[0].id(), "location:C");
}

TEST(CanonicalSymbol, KnowsTheSpellings) {
  EXPECT_EQ(canonical_symbol("XOC"), "X0C");
  EXPECT_EQ(canonical_symbol("EX0C"), "X0C");
  EXPECT_EQ(canonical_symbol("EAOS"), "A0S");
  EXPECT_EQ(canonical_symbol("EXX"), "EXX");
  EXPECT_EQ(canonical_symbol("tau"), "tau");
}

}  // namespace
}  // namespace trunnion
