#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/data/zeroed_groups.hpp"
#include "diagnosis/verdict/needless.hpp"
#include "support/cases.hpp"

// A data set for every verdict, and for every kind of data that a shop hands in.
namespace trunnion::diagnosis {
namespace {

const std::string kEmpty = "[model]\nname = \"base\"\n";
const std::string kLocationC =
    "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 3\nY0C_um = -2\nA0C_urad = 10\n";

struct BallPlan {
  std::string u_common = "0.3", frame = "machine", n = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", more, simulation;
  std::string a = "[-20, 0, 30, 60, 90]", c = "[0, 50, 100, 170, 240, 310]";
  std::size_t balls = 3;
  std::string text() const {
    const std::array<std::string, 3> place = {"[80, 0, 60]", "[0, 90, 120]", "[-70, -40, 40]"};
    std::string out;
    for (std::size_t k = 0; k < balls; ++k) {
      out += "[[run]]\nid = \"ball_" + std::to_string(k + 1) + "\"\nminutes = 20\n";
      out += "quantity = \"displacement\"\nn = " + n + "\nframe = \"" + frame + "\"\nu_random = 0.8\n";
      if (!u_common.empty()) out += "u_common = " + u_common + "\n";
      out += more + "grid = { A_deg = " + a + ", C_deg = " + c + " }\nball_mm = " + place[k] + "\n";
    }
    return simulation.empty() ? out : out + "[simulation]\n" + simulation;
  }
};

std::string sweep(const std::string& id, const std::string& axis, const std::string& n,
                  const std::string& more = "", int points = 31) {
  return "[[run]]\nid = \"" + id + "\"\nminutes = 15\nquantity = \"displacement\"\nn = " + n +
         "\nu_random = 0.8\nu_common = 0.3\nboth_directions = true\n" + more + "sweep = { axis = \"" + axis +
         "\", from_mm = -240, to_mm = 240, points = " + std::to_string(points) + " }\n";
}

Diagnosis said_of(const std::string& plan, const std::string& truth, std::uint64_t seed = 1,
                  const std::string& base = kEmpty) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const Dataset data = test::measured(machine, plan, "[model]\nname = \"truth\"\n" + truth, seed);
  return diagnose(machine, data, test::model_for(machine, data, base));
}

std::string summary(const Diagnosis& d) {
  std::string out(text_of(d.verdict));
  for (const auto& set : d.sets) {
    out += " [";
    for (const auto& id : set) out.append(id).append(" ");
    out += "]";
  }
  return out + "\n" + d.paragraph;
}

bool some_set_holds(const Diagnosis& d, const std::string& id) {
  return std::any_of(d.sets.begin(), d.sets.end(),
                     [&](const auto& set) { return std::find(set.begin(), set.end(), id) != set.end(); });
}

TEST(Verdict, NothingToFindStatesItsDetectionLimits) {
  const Diagnosis d = said_of(BallPlan{}.text(), "");
  EXPECT_EQ(d.verdict, Verdict::nothing_to_find) << summary(d);
  EXPECT_TRUE(d.effects.empty());
  EXPECT_TRUE(std::any_of(d.ranking.begin(), d.ranking.end(),
                          [](const RankedEffect& r) { return r.detectable_um && *r.detectable_um > 0.0; }));
  EXPECT_NE(d.paragraph.find("no proof"), std::string::npos);
}

TEST(Verdict, Named) {
  const Diagnosis d = said_of(BallPlan{}.text(), kLocationC);
  EXPECT_EQ(d.verdict, Verdict::named) << summary(d);
  EXPECT_EQ(d.effects, std::vector<std::string>{"location:C"});
}

TEST(Verdict, NamedTogether) {
  const Diagnosis d =
      said_of(BallPlan{}.text() + sweep("laser", "X", "[[1, 0, 0]]"),
              kLocationC + "[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 3\n");
  EXPECT_EQ(d.verdict, Verdict::named) << summary(d);
  auto effects = d.effects;
  std::sort(effects.begin(), effects.end());
  EXPECT_EQ(effects, (std::vector<std::string>{"backlash:X", "location:C"}));
}

// Something that depends on A and C together, which no effect of the library does.
const std::string kForeign =
    "[[effect]]\nid = \"user:foreign\"\njoint = \"C\"\ncomponent = \"EZC\"\n"
    "expression = \"k * sin(2 * A) * cos(2 * C)\"\n[effect.parameters]\nk_um = ";

TEST(LongVerdict, NotInLibrary) {
  const Diagnosis d = said_of(BallPlan{}.text(), kForeign + "2.5\n");
  EXPECT_EQ(d.verdict, Verdict::not_in_library) << summary(d);
  EXPECT_TRUE(d.effects.empty());
  ASSERT_FALSE(d.depends_on.empty());
}

TEST(LongVerdict, NamedButIncomplete) {
  const Diagnosis d = said_of(BallPlan{}.text(), kLocationC + kForeign + "2.2\n");
  EXPECT_EQ(d.verdict, Verdict::named_but_incomplete) << summary(d);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects.front(), "location:C");
  EXPECT_FALSE(d.leftover.empty());
}

// The screw's pitch is 10 mm in the machine file; 7.3 mm is none of its parts.
TEST(Verdict, AnUnknownPeriodIsIncomplete) {
  Machine machine = test::thermal_machine("trunnion_offset");
  machine.axes[0].screw_pitch_mm = 10.0;
  const std::string truth =
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"periodic:X\"\n[effect.parameters]\nsin_um = 2\ncos_um = "
      "1\n"
      "p_mm = 7.3\n";
  const std::string plan =
      "[[run]]\nid = \"fine\"\nminutes = 15\nquantity = \"displacement\"\nn = [[1, 0, 0]]\nu_random = 0.8\n"
      "both_directions = true\nsweep = { axis = \"X\", from_mm = -50, to_mm = 50, points = 101 }\n";
  const Dataset data = test::measured(machine, plan, truth, 1);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kEmpty));
  EXPECT_EQ(d.verdict, Verdict::named_but_incomplete) << summary(d);
  EXPECT_EQ(d.effects, std::vector<std::string>{"periodic:X"});
}

// At one feed in both senses a following error is a lost motion: -v tau against -b/2 sign(v).
TEST(Verdict, AmbiguousProposesTheRunThatTells) {
  const Diagnosis d = said_of(sweep("fly", "X", "[[1, 0, 0]]", "feed_mm_min = 3000\n"),
                              "[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 3\n");
  EXPECT_EQ(d.verdict, Verdict::ambiguous) << summary(d);
  EXPECT_TRUE(some_set_holds(d, "backlash:X"));
  EXPECT_TRUE(some_set_holds(d, "servo_lag:X"));
  ASSERT_TRUE(d.next);
  EXPECT_GT(d.next->wrong_before, 0.4);
  EXPECT_LT(d.next->wrong_after, 0.05);
}

// With one length of the tool a tilted spindle is a tool that stands beside its axis. The twin was lost where
// the search began with a straightness of Y and ended with the squareness that suffices: `tool_offset` and
// `squareness:C0Y` were named.
TEST(LongVerdict, TwinsBesideASmallerEffectAreAmbiguous) {
  const auto diagonal = [](const std::string& id, const std::string& n, int x_mm) {
    return "[[run]]\nid = \"" + id + "\"\nminutes = 15\nquantity = \"displacement\"\nn = [[" + n +
           ", 0.57735, 0.57735]]\nu_random = 0.8\nu_common = 0.3\nboth_directions = true\nline = { from = { "
           "X_mm = " +
           std::to_string(x_mm) + ", Y_mm = -200 }, to = { X_mm = " + std::to_string(-x_mm) +
           ", Y_mm = 200, Z_mm = 300 }, points = 21 }\n";
  };
  const auto ball = [](const std::string& id, const std::string& place, const std::string& a) {
    return "[[run]]\nid = \"" + id +
           "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = "
           "0.8\nu_common = 0.3\ngrid = { A_deg = " +
           a + ", C_deg = [0, 60, 120, 180, 240, 300] }\nball_mm = " + place + "\n";
  };
  const std::string plan = test::sweep_run("x", "X", -250, 250, 26, "[[1, 0, 0]]", "displacement", {}) +
                           test::sweep_run("y", "Y", -250, 250, 26, "[[0, 1, 0]]", "displacement", {}) +
                           test::sweep_run("z", "Z", 0, 300, 21, "[[0, 0, 1]]", "displacement", {}) +
                           ball("one", "[80, 0, 60]", "[0, 20, 40, 60, 80]") +
                           ball("two", "[0, 90, 120]", "[-20, 10, 30, 50, 70]") +
                           diagonal("left", "0.57735", -200) + diagonal("right", "-0.57735", 200);
  for (int seed = 1; seed <= test::cases(3); ++seed) {
    const Diagnosis d = said_of(plan,
                                "[[effect]]\nid = \"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = 24\n"
                                "[[effect]]\nid = \"spindle_tilt\"\n[effect.parameters]\nA0S_urad = -42\n"
                                "B0S_urad = -25\n",
                                static_cast<std::uint64_t>(seed));
    EXPECT_EQ(d.verdict, Verdict::ambiguous) << summary(d);
    for (const char* twin : {"spindle_tilt", "tool_offset"})
      EXPECT_TRUE(std::any_of(d.sets.begin(), d.sets.end(),
                              [&](auto set) {
                                std::sort(set.begin(), set.end());
                                std::vector<std::string> wanted = {twin, "squareness:C0Y"};
                                std::sort(wanted.begin(), wanted.end());
                                return set == wanted;
                              }))
          << twin << summary(d);
  }
}

// An overhang that grows with Z is what two squarenesses of Z are where all readings have one length of the
// tool. `overhang:Z` was named, or it and a tilted spindle or a tool beside its axis: a search that adds one
// effect at a time does not come to the two.
TEST(LongVerdict, TwoSquarenessesAndAnOverhangAreAmbiguousWithOneTool) {
  const std::string common =
      "quantity = \"displacement\"\nu_random = 0.8\nu_common = 0.3\ntool_z_mm = -300\n";
  const auto ball = [&](const std::string& id, const std::string& place, const std::string& a) {
    return "[[run]]\nid = \"" + id + "\"\nminutes = 20\n" + common +
           "n = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\ngrid = { A_deg = " + a +
           ", C_deg = [0, 60, 120, 180, 240, 300] }\nball_mm = " + place + "\n";
  };
  const std::string plan = "[[run]]\nid = \"z\"\nminutes = 10\n" + common +
                           "n = [[1, 0, 0], [0, 1, 0]]\nline = { from = { Z_mm = 0 }, to = { Z_mm = 300 }, "
                           "points = 31 }\n" +
                           ball("one", "[80, 0, 60]", "[0, 20, 40, 60, 80]") +
                           ball("two", "[0, 90, 120]", "[-20, 10, 30, 50, 70]");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Diagnosis d = said_of(plan,
                                "[[effect]]\nid = \"squareness:A0Z\"\n[effect.parameters]\nA0Z_urad = 14\n"
                                "[[effect]]\nid = \"squareness:B0Z\"\n[effect.parameters]\nB0Z_urad = -12\n",
                                seed);
    EXPECT_EQ(d.verdict, Verdict::ambiguous) << summary(d);
    EXPECT_TRUE(std::any_of(d.sets.begin(), d.sets.end(), [](const auto& set) {
      return std::set<std::string>(set.begin(), set.end()) ==
             std::set<std::string>{"squareness:A0Z", "squareness:B0Z"};
    })) << summary(d);
  }
}

// An angle interferometer shows 0 where it begins. Its offset, minus the error there, was held by the
// variance that all groups seem to have beside a model without the error: false effects stood beside the true
// one.
TEST(LongVerdict, AnInstrumentThatWasZeroedMakesNoEffect) {
  const std::string angles = "[[run]]\nid = \"zeroed_";
  const auto angle = [&](const std::string& axis, const std::string& to, const std::string& n) {
    return angles + axis +
           "\"\nminutes = 10\nquantity = \"rotation\"\nu_random = 0.5\nu_common = 0\nn = " + n +
           "\nline = { from = { " + axis + "_mm = -200 }, to = { " + axis + "_mm = " + to +
           " }, points = 26 }\n";
  };
  const std::string plan = test::plan_text({}) + angle("X", "200", "[[0, 1, 0], [0, 0, 1]]") +
                           angle("Y", "200", "[[1, 0, 0], [0, 0, 1]]");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Machine machine = test::shipped_machine("trunnion_offset");
    Dataset data =
        test::measured(machine, plan,
                       "[model]\nname = \"truth\"\n[[effect]]\nid = \"component:ECX\"\n"
                       "[effect.parameters]\nP1_urad = 14\nP2_urad = 15\nP3_urad = 8\nP4_urad = -5\n",
                       seed);
    std::map<std::size_t, double> first;
    for (Reading& r : data.readings) {
      if (r.quantity != Quantity::rotation) continue;
      r.u_common.reset();
      r.value -= first.emplace(r.group, r.value).first->second;
    }
    mark_zeroed(data);
    EXPECT_TRUE(std::all_of(data.readings.begin(), data.readings.end(),
                            [](const Reading& r) { return r.zeroed == (r.quantity == Quantity::rotation); }));
    const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"none\"\n"));
    EXPECT_EQ(d.verdict, Verdict::named) << summary(d);
    EXPECT_EQ(d.effects, std::vector<std::string>{"component:ECX"}) << summary(d);
  }
}

// Beside the formula that is the truth an effect that imitates a part of it does nothing, and a true one
// stays.
TEST(Verdict, AFormulaMakesItsImitatorsNeedless) {
  const std::string step =
      "[[effect]]\nid = \"user:step\"\njoint = \"X\"\ncomponent = \"EZX\"\n"
      "expression = \"k * (C > 1.83) * (A > 0.65)\"\n[effect.parameters]\nk_um = ";
  const std::string true_one = "[[effect]]\nid = \"component:EYC\"\n[effect.parameters]\n";
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Dataset data = test::measured(
      machine, test::plan_text({}),
      "[model]\nname = \"truth\"\n" + true_one + "cos1_um = 7\nsin2_um = 2\n" + step + "7.7\n", 3);
  const auto model = [&](const std::string& effects) {
    return test::model_for(machine, data, "[model]\nname = \"m\"\n" + effects);
  };
  const Observations o(machine, data);
  const auto named =
      model(true_one + "[[effect]]\nid = \"component:EZA\"\n[[effect]]\nid = \"unbalance:AC\"\n");
  const auto needed = needed_beside(o, model(""), named.effects, model(step + "1\n").effects, {});
  ASSERT_EQ(needed.size(), 1U);
  EXPECT_EQ(needed.front().id(), "component:EYC");
}

TEST(Verdict, WhatIsAmbiguousIsNotSaidToBeDecided) {
  Diagnosis d;
  d.verdict = Verdict::ambiguous;
  EXPECT_EQ(what_next(d).find("No further measurement"), std::string::npos);
  d.verdict = Verdict::named;
  EXPECT_NE(what_next(d).find("No further measurement"), std::string::npos);
}

// C stands beside its place in every explanation; what X does at one feed is open. C is put into the model,
// neither of the two others is.
TEST(LongVerdict, ImproveAddsWhatAllExplanationsHave) {
  const std::string truth =
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 60\nY0C_um "
      "= "
      "-40\nA0C_urad = 0\n[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 3\n";
  const Machine machine = test::thermal_machine("trunnion_offset");
  BallPlan balls;  // which do not see X
  balls.n = "[[0, 1, 0], [0, 0, 1]]";
  const Dataset data = test::measured(
      machine, balls.text() + sweep("fly", "X", "[[1, 0, 0]]", "feed_mm_min = 3000\n"), truth, 1);
  const auto steps = improve(machine, data, test::model_for(machine, data, kEmpty));
  ASSERT_EQ(steps.size(), 2u) << summary(steps.front().diagnosis);
  EXPECT_EQ(steps[0].diagnosis.verdict, Verdict::ambiguous) << summary(steps[0].diagnosis);
  EXPECT_NE(steps[0].diagnosis.paragraph.find("each has location:C; do not compensate for the others"),
            std::string::npos)
      << steps[0].diagnosis.paragraph;
  EXPECT_EQ(steps[1].error.effects, std::vector<std::string>{"location:C"});
  EXPECT_EQ(steps[1].diagnosis.verdict, Verdict::ambiguous) << summary(steps[1].diagnosis);
}

// Nothing is in both explanations: nothing is added.
TEST(Verdict, ImproveAddsNoneOfTwoThatCannotBeToldApart) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const Dataset data = test::measured(
      machine, sweep("fly", "X", "[[1, 0, 0]]", "feed_mm_min = 3000\n"),
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 3\n", 1);
  const auto steps = improve(machine, data, test::model_for(machine, data, kEmpty));
  ASSERT_EQ(steps.size(), 1u);
  EXPECT_EQ(steps[0].diagnosis.verdict, Verdict::ambiguous) << summary(steps[0].diagnosis);
}

TEST(Verdict, NotTestableAtOnePose) {
  const std::string plan =
      "[[run]]\nid = \"rest\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, "
      "1]]\n"
      "u_random = 0.8\nrepeat = 20\nposes = [[0, 0, 100, 0, 0]]\n";
  const Diagnosis d = said_of(plan, kLocationC);
  EXPECT_EQ(d.verdict, Verdict::not_testable) << summary(d);
  ASSERT_TRUE(d.next);
  EXPECT_FALSE(d.next->runs.empty());
}

TEST(Verdict, NotTestableWithTooFewRows) {
  const std::string plan =
      "[[run]]\nid = \"short\"\nminutes = 2\nquantity = \"displacement\"\nn = [[1, 0, 0]]\nu_random = 0.8\n"
      "poses = [[0, 0, 100, 0, 0], [50, 0, 100, 0, 0], [100, 0, 100, 0, 0], [150, 0, 100, 0, 0]]\n";
  EXPECT_EQ(said_of(plan, kLocationC).verdict, Verdict::not_testable);
}

TEST(Verdict, DataProblemWhenTheUncertaintyIsTooSmallOrTooLarge) {
  for (const char* factor : {"noise_factor = 1.5\n", "noise_factor = 0.5\n"}) {
    BallPlan plan;
    plan.simulation = factor;
    const Diagnosis d = said_of(plan.text(), "");
    EXPECT_EQ(d.verdict, Verdict::data_problem) << factor << summary(d);
    EXPECT_NEAR(d.scatter.factor, std::stod(std::string(factor).substr(15)), 0.15);
  }
}

// An effect is named all the same when the uncertainty is wrong, and the paragraph says that it is.
TEST(LongVerdict, AWrongUncertaintyHidesNoEffect) {
  for (const char* factor : {"noise_factor = 1.3\n", "noise_factor = 0.5\n"}) {
    BallPlan plan;
    plan.simulation = factor;
    const Diagnosis d = said_of(plan.text(), kLocationC);
    ASSERT_FALSE(d.effects.empty()) << factor << summary(d);
    EXPECT_EQ(d.effects.front(), "location:C") << factor << summary(d);
    EXPECT_NE(d.paragraph.find("times the stated uncertainty"), std::string::npos);
  }
}

TEST(Data, PartFrameDirections) {
  BallPlan plan;
  plan.frame = "part";
  EXPECT_EQ(said_of(plan.text(), "").verdict, Verdict::nothing_to_find);
  const Diagnosis d = said_of(plan.text(), kLocationC);
  EXPECT_EQ(d.verdict, Verdict::named) << summary(d);
  EXPECT_EQ(d.effects, std::vector<std::string>{"location:C"});
}

TEST(LongData, CommonUncertaintyLeftOpen) {
  // `u_common_known = false` leaves the column empty; the readings share 1.5 um a run all the same.
  Machine machine = test::thermal_machine("trunnion_offset");
  for (const bool effect : {false, true}) {
    BallPlan plan;
    plan.u_common = "1.5";
    Dataset data = test::measured(machine, plan.text(),
                                  "[model]\nname = \"truth\"\n" + (effect ? kLocationC : std::string()), 2);
    for (Reading& r : data.readings) r.u_common.reset();
    const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kEmpty));
    EXPECT_EQ(d.verdict, effect ? Verdict::named : Verdict::nothing_to_find) << summary(d);
    ASSERT_TRUE(d.base.common.displacement_mm);
  }
}

TEST(LongData, Outliers) {
  BallPlan plan;
  plan.simulation = "outlier_fraction = 0.04\n";
  for (int seed = 1; seed <= test::cases(3); ++seed) {
    const Diagnosis nothing = said_of(plan.text(), "", static_cast<std::uint64_t>(seed));
    EXPECT_EQ(nothing.verdict, Verdict::nothing_to_find) << summary(nothing);
    const Diagnosis d = said_of(plan.text(), kLocationC, static_cast<std::uint64_t>(seed));
    EXPECT_EQ(d.verdict, Verdict::named) << summary(d);
    EXPECT_EQ(d.effects, std::vector<std::string>{"location:C"});
    EXPECT_GT(d.outliers, 3U);
  }
}

// Rows without a value carry the spindle speed between the readings: without them the lag would be wrong.
TEST(Data, RowsThatOnlyRecordTheState) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const std::string plan =
      "[[run]]\nid = \"warm\"\nminutes = 180\nquantity = \"displacement\"\nn = [[0, 1, 0], [0, 0, 1]]\n"
      "u_random = 0.8\nspindle_rpm = [[0, 9000], [60, 0], [90, 6000], [120, 0]]\nrepeat = 180\nposes = [[0, "
      "0, "
      "100, 0, 0]]\n";
  const std::string truth =
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = "
      "2\n"
      "Y_um_per_krpm = 0.6\ntau_s = 1500\n";
  Dataset data = test::measured(machine, plan, truth, 4);
  // Every sixth reading stays; the states of all the others do too.
  std::vector<Reading> kept;
  for (const Reading& r : data.readings)
    if (r.row % 6 == 0) kept.push_back(r);
  ASSERT_LT(kept.size() * 3, data.readings.size());
  data.readings = std::move(kept);
  const std::string text = measurements_text(data, machine);
  Diagnostics diagnostics;
  const std::vector<NamedText> files = {{"warm.csv", text}};
  const auto read = parse_measurements(files, machine, diagnostics);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_GT(read->rows.size(), read->readings.size());
  const Diagnosis d = diagnose(machine, *read, test::model_for(machine, *read, kEmpty));
  ASSERT_FALSE(d.effects.empty()) << summary(d);
  EXPECT_EQ(d.effects.front(), "spindle_growth") << summary(d);
  const auto& tau = d.ranking.front().parameters.back();
  ASSERT_EQ(tau.key, "tau_s");
  ASSERT_TRUE(tau.sigma);
  EXPECT_NEAR(tau.value, 1500.0, 4.0 * *tau.sigma);
}

TEST(Data, OfOneAxisOnly) {
  const std::string plan = sweep("one", "X", "[[1, 0, 0]]") + sweep("two", "X", "[[1, 0, 0]]");
  EXPECT_EQ(said_of(plan, "").verdict, Verdict::nothing_to_find);
  const Diagnosis d = said_of(
      plan, "[[effect]]\nid = \"component:EXX\"\n[effect.parameters]\nP2_um = 4\nP3_um = 3\nP4_um = 2\n");
  ASSERT_FALSE(d.effects.empty()) << summary(d);
  EXPECT_TRUE(some_set_holds(d, "component:EXX")) << summary(d);
  EXPECT_FALSE(some_set_holds(d, "crosstalk:XZ")) << summary(d);  // Z never moved
}

}  // namespace
}  // namespace trunnion::diagnosis
