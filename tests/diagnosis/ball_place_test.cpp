#include "diagnosis/verdict/ball_place.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/effects/deviation.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/verdict/ball_offsets.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"

// What the positions of a run with turning rotary axes prove of the files, whatever the readings are.
namespace trunnion::diagnosis {
namespace {

std::string ball_run(const std::string& id, const std::string& place) {
  return "[[run]]\nid = \"" + id +
         "\"\nminutes = 12\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = "
         "0.6\nu_common = 0.3\ntool_z_mm = -150\n"
         "grid = { A_deg = [-20, 0, 20, 40, 60, 80], C_deg = [0, 45, 90, 135, 180, 225, 270, 315] }\n"
         "ball_mm = " +
         place + "\n";
}

struct Balls {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;
  Model model;

  explicit Balls(const std::string& truth) {
    data = test::measured(machine, ball_run("b1", "[80, 0, 60]") + ball_run("b2", "[0, 90, 120]"),
                          "[model]\nname = \"truth\"\n" + truth, 5);
    model = test::model_for(machine, data, "[model]\nname = \"none\"\n");
  }
  // The same files with a mistake in them.
  Diagnosis with(const Convention& mistake) const {
    const PutRight wrong = put_right(machine, model, data, mistake);
    return diagnose(wrong.machine, wrong.data, wrong.model);
  }
};

Convention unit(std::vector<AxisId> axes, double factor) {
  Convention c;
  c.kind = ConventionKind::unit;
  c.axes = std::move(axes);
  c.factor = factor;
  return c;
}

// Closed form: a ball stands still to the digits of its positions, and in inches it does not.
TEST(BallPlace, StandsStillWherePositionsAreRight) {
  const Balls shop("");
  const auto still = turning_runs(shop.machine, shop.data);
  ASSERT_EQ(still.size(), 2U);
  for (const TurningRun& run : still) {
    EXPECT_LT(run.wanders_mm, 1e-6);
    EXPECT_TRUE(run.follows);
    EXPECT_EQ(run.rows.size(), 48U);
  }
  const PutRight inches = put_right(shop.machine, shop.model, shop.data, unit({0, 1, 2}, 1.0 / 25.4));
  for (const TurningRun& run : turning_runs(inches.machine, inches.data)) EXPECT_GT(run.wanders_mm, 50.0);
}

// Before: inches were `named: component:EXA` with 0.985.
TEST(LongBallPlace, ProvesPositionsInAnotherUnitOrSense) {
  const Balls shop(
      "[[effect]]\nid = \"component:EZC\"\n[effect.parameters]\ncos2_um = 4\n[[effect]]\nid = "
      "\"location:C\"\n[effect.parameters]\nX0C_um = 9\n");
  Convention sense;
  sense.axes = {*shop.machine.axis("C")};
  sense.in_file = true;
  for (const auto& [mistake, kind] : {std::pair{unit({0, 1, 2}, 1.0 / 25.4), ConventionKind::unit},
                                      {unit({0}, 1e3), ConventionKind::unit},
                                      {unit(shop.machine.rotary_axes(), kRadPerDegree), ConventionKind::unit},
                                      {sense, ConventionKind::axis_sense}}) {
    const Diagnosis d = shop.with(mistake);
    ASSERT_EQ(d.verdict, Verdict::bookkeeping) << mistake.factor << d.paragraph;
    EXPECT_EQ(d.bookkeeping.front().convention.kind, kind) << d.paragraph;
    EXPECT_NE(d.paragraph.find("it stands still"), std::string::npos) << d.paragraph;
  }
}

// Rotary axes that were turned the other way on purpose, beside the path of the ball: the readings fit as
// they are, and would not with a sense "put right". Before: bookkeeping with 0.97, in spite of chi-square.
TEST(LongBallPlace, APointThatMovesOnPurposeIsNoMistake) {
  const std::string truth =
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 40\nY0C_um = -25\nA0C_urad = "
      "90\nB0C_urad = "
      "-60\n";
  const Balls shop(truth);
  const Model true_errors = test::model_for(shop.machine, shop.data, "[model]\nname = \"truth\"\n" + truth);
  Convention sense;
  sense.axes = {*shop.machine.axis("C")};
  sense.in_file = true;
  PutRight moved = put_right(shop.machine, shop.model, shop.data, sense);
  const VectorXd now = Observations(moved.machine, moved.data).predicted(true_errors);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise;
  const Vec3 setup_P(0.021, -0.034, 0.012);  // mm, as balls are set up
  for (std::size_t i = 0; i < moved.data.readings.size(); ++i) {
    Reading& r = moved.data.readings[i];
    const DeviationMap map(moved.machine, moved.data.track.state(r.row).q, moved.data.rows[r.row].tool_mm);
    r.value = now[static_cast<Eigen::Index>(i)] + r.n.dot(map.setup_translation_M(setup_P).displacement_mm) +
              r.u_random * noise(random);
  }
  const Model known = test::model_for(shop.machine, moved.data,
                                      "[model]\nname = \"known\"\n[[effect]]\nid = \"location:C\"\n");
  const Diagnosis d = diagnose(moved.machine, moved.data, known);
  EXPECT_EQ(d.verdict, Verdict::nothing_to_find) << d.paragraph;
}

TEST(BallPlace, RefutesWhatWouldLeadTheBallAbout) {
  const Balls shop("");
  for (const Convention& c : conventions(shop.machine, shop.data, shop.model)) {
    if (!moves_the_ball(c)) continue;
    const PutRight right = put_right(shop.machine, shop.model, shop.data, c);
    for (const TurningRun& run : turning_runs(right.machine, right.data))
      EXPECT_LT(run.wanders_mm, kBallWanders_mm);
  }
}

Convention shifted(std::vector<AxisId> axes, std::vector<double> by) {
  Convention c;
  c.kind = ConventionKind::position_offset;
  c.axes = std::move(axes);
  c.by_position = std::move(by);
  return c;
}

// Positions of a program zero were one effect or another; what has to be added is what was taken away.
TEST(LongBallPlace, TellsPositionsThatCountFromAnotherZero) {
  const Balls shop(
      "[[effect]]\nid = \"component:EZC\"\n[effect.parameters]\ncos2_um = 4\n[[effect]]\nid = "
      "\"location:C\"\n[effect.parameters]\nX0C_um = 9\n");
  const AxisId x = *shop.machine.axis("X"), y = *shop.machine.axis("Y"), a = *shop.machine.axis("A");
  for (const Convention& mistake :
       {shifted({x, y}, {-130.5, 42.25}), shifted({y}, {3.0}), shifted({a}, {5.0 * kRadPerDegree}),
        shifted({a}, {-90.0 * kRadPerDegree}), shifted({a}, {180.0 * kRadPerDegree})}) {
    const Diagnosis d = shop.with(mistake);
    ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
    const Convention& said = d.bookkeeping.front().convention;
    ASSERT_EQ(said.kind, ConventionKind::position_offset) << d.paragraph;
    ASSERT_EQ(said.axes, mistake.axes) << d.paragraph;
    for (std::size_t k = 0; k < said.axes.size(); ++k)
      EXPECT_NEAR(std::remainder(said.by_position[k] + mistake.by_position[k],
                                 kTwoPi * (said.axes[k] == a ? 1 : 1e9)),
                  0.0, 1e-4)
          << d.paragraph;
    EXPECT_TRUE(d.additions.empty());
  }
}

TEST(BallPlace, TellsTheLeverOfATool) {
  const Balls shop("[[effect]]\nid = \"squareness:A0Z\"\n[effect.parameters]\nA0Z_urad = 40\n");
  Convention longer;
  longer.kind = ConventionKind::tool_length;
  longer.by_mm = {0, 0, -12};
  const Diagnosis d = shop.with(longer);
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().convention.kind, ConventionKind::tool_length) << d.paragraph;
  EXPECT_NEAR(d.bookkeeping.front().convention.by_mm.z(), 12.0, 1e-4);
}

// The other run is right, and stays so.
TEST(BallPlace, TellsTheRunThatCountsFromAnotherZero) {
  const Balls shop("[[effect]]\nid = \"component:EZC\"\n[effect.parameters]\ncos2_um = 4\n");
  Convention mistake = shifted({*shop.machine.axis("X")}, {25.0});
  mistake.run = 1;
  const Diagnosis d = shop.with(mistake);
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().run, "b2") << d.paragraph;
  EXPECT_NEAR(d.bookkeeping.front().convention.by_position.front(), -25.0, 1e-4);
  EXPECT_EQ(d.bookkeeping.size(), 1U);
}

// Where nothing but the place of a ball speaks for it, the readings are as right with it as without it.
TEST(BallPlace, IsLessSureWhereTheReadingsSayNothing) {
  const Balls shop("");
  Convention mistake = shifted({*shop.machine.axis("X")}, {25.0});
  mistake.run = 1;
  const Diagnosis d = shop.with(mistake);
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_LE(d.confidence, 0.85) << d.paragraph;
  EXPECT_NE(d.paragraph.find("a point that was led about on the part on purpose"), std::string::npos)
      << d.paragraph;
}

// Columns of one run alone, while the other run stands still.
TEST(BallPlace, TellsTheColumnsOfOneRun) {
  const Balls shop("[[effect]]\nid = \"component:EZC\"\n[effect.parameters]\ncos2_um = 4\n");
  Convention exchanged;
  exchanged.kind = ConventionKind::swapped_columns;
  exchanged.axes = {*shop.machine.axis("X"), *shop.machine.axis("Y")};
  exchanged.in_file = true;
  exchanged.run = 0;
  const Diagnosis d = shop.with(exchanged);
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().convention.kind, ConventionKind::swapped_columns) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().run, "b1");
  EXPECT_NE(d.paragraph.find("X_mm and Y_mm of run 'b1'"), std::string::npos) << d.paragraph;
}

// Rows in another order than the readings: nothing puts that right, and the text says what it is built on.
TEST(BallPlace, SaysThatABallWandersWhereNothingHoldsIt) {
  Balls shop("");
  EXPECT_EQ(wandering_text(shop.machine, shop.data), "");
  std::vector<MachineState> states;
  for (std::size_t i = 0; i < shop.data.track.size(); ++i) states.push_back(shop.data.track.state(i));
  for (std::size_t i = 0; i + 7 < states.size(); i += 8)
    if (states[i].run == 1)
      std::swap(states[i].q[*shop.machine.axis("X")], states[i + 7].q[*shop.machine.axis("X")]);
  Dataset shuffled = make_dataset(shop.data.context, states, shop.data.rows, shop.data.readings);
  shuffled.files = shop.data.files;
  const std::string text = wandering_text(shop.machine, shuffled);
  EXPECT_NE(text.find("In 'b2'"), std::string::npos) << text;
  EXPECT_NE(text.find("in 'b1' it stands still"), std::string::npos) << text;
  EXPECT_TRUE(offsets_that_hold_the_ball(shop.machine, shuffled).empty());
  const Diagnosis d = diagnose(shop.machine, shuffled, shop.model);
  EXPECT_NE(d.paragraph.find(text), std::string::npos) << d.paragraph;
  EXPECT_LE(d.confidence, 0.7);
}

// A dial gauge that stands still over the turning table follows no ball: it would stand on the axis with any
// positions that are near to zero.
TEST(BallPlace, ATableMeasuredFromAFixedPlaceProvesNothing) {
  Machine machine = test::shipped_machine("trunnion_offset");
  const Dataset data = test::measured(
      machine,
      "[[run]]\nid = \"face\"\nminutes = 5\nquantity = \"displacement\"\nn = [0, 0, 1]\nu_random = 0.6\n"
      "u_common = 0.3\ntool_z_mm = -150\ngrid = { X_mm = [60], C_deg = [0, 30, 60, 90, 120, 150, 180, 210, "
      "240, "
      "270, 300, 330] }\n",
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"component:EZC\"\n[effect.parameters]\ncos2_um = 9\n", 5);
  const Model model = test::model_for(machine, data, "[model]\nname = \"none\"\n");
  ASSERT_EQ(turning_runs(machine, data).size(), 1U);
  EXPECT_FALSE(turning_runs(machine, data).front().follows);
  EXPECT_GT(turning_runs(machine, data).front().wanders_mm, 50.0);
  for (const Convention& c : conventions(machine, data, model))
    EXPECT_FALSE(proved_by_the_ball(machine, model, data, c)) << text_of(c.kind) << c.factor;
  EXPECT_TRUE(offsets_that_hold_the_ball(machine, data).empty());
  EXPECT_NE(diagnose(machine, data, model).verdict, Verdict::bookkeeping);
}

// A tool that is longer by its lever alone leads the ball about as well; one that the readings show does not.
TEST(BallPlace, RefutesALongerLeverAndNoOffset) {
  const Balls shop("");
  Convention longer;
  longer.kind = ConventionKind::tool_length;
  longer.by_mm = {0, 0, -10};
  EXPECT_TRUE(refuted_by_the_ball(shop.machine, shop.model, shop.data, longer));
  longer.in_readings = true;
  EXPECT_FALSE(refuted_by_the_ball(shop.machine, shop.model, shop.data, longer));
}

// Readings of 15 um are no readings of 15 mm.
TEST(BallPlace, ReadingsBeyondAnyInstrumentAreInNoLargerUnit) {
  Balls shop("");
  for (Reading& r : shop.data.readings) r.value += 15e-3;
  const auto list = conventions(shop.machine, shop.data, shop.model);
  EXPECT_TRUE(std::none_of(list.begin(), list.end(), [](const Convention& c) {
    return c.kind == ConventionKind::unit && c.axes.empty() && c.factor > 100.0;
  }));
  for (Reading& r : shop.data.readings) r.value *= 1e-3;
  const auto small = conventions(shop.machine, shop.data, shop.model);
  EXPECT_TRUE(std::any_of(small.begin(), small.end(), [](const Convention& c) {
    return c.kind == ConventionKind::unit && c.axes.empty() && c.factor > 100.0;
  }));
}

}  // namespace
}  // namespace trunnion::diagnosis
