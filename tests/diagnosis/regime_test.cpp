#include <cmath>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"

// Errors that act above a temperature or in a sector only, and effects that look like them.
namespace trunnion::diagnosis {
namespace {

// One pose again and again while the room's temperature follows `ambient`, beside runs at 20 degC.
Dataset day(const Machine& machine, const std::string& ambient, const std::string& truth) {
  test::Campaign c;
  c.angles = false;
  return test::measured(
      machine,
      test::plan_text(c) +
          "[[run]]\nid = \"day\"\nminutes = 120\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, "
          "1, 0], [0, 0, 1]]\nu_random = 0.8\nu_common = 0.3\nT_ambient_degC = " +
          ambient + "\nrepeat = 40\nposes = [[0, 0, 100, 0, 0]]\n",
      "[model]\nname = \"truth\"\n[[effect]]\n" + truth, 7);
}
Diagnosis said_of_day(const std::string& ambient, const std::string& truth) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Dataset data = day(machine, ambient, truth);
  return diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"base\"\n"));
}

const std::string kAbove22 =
    "id = \"user:warm\"\njoint = \"S\"\ncomponent = \"EXS\"\nexpression = \"k * (T_ambient > 2)\"\n"
    "[effect.parameters]\nk_um = 3\n";
const std::string kOnce = "[[0, 18], [120, 24]]", kThereAndBack = "[[0, 18], [60, 24], [120, 18]]";

// 40 readings over 6 degrees, or over 6 there and 6 back.
void expect_above_22(const Diagnosis& d) {
  ASSERT_TRUE(d.formula) << text_of(d.verdict) << ' ' << d.paragraph;
  ASSERT_EQ(d.formula->acts_in.size(), 1U) << d.formula->words;
  EXPECT_EQ(d.formula->acts_in[0].of, "T_ambient");
  ASSERT_TRUE(d.formula->acts_in[0].from) << d.formula->words;
  EXPECT_NEAR(*d.formula->acts_in[0].from, 22.0, 0.3);
  EXPECT_FALSE(d.formula->acts_in[0].to);
}

// Then "from this moment on" and "above this temperature" are the same.
TEST(LongRegime, ATemperatureThatIsPassedOnceIsNoStepForSure) {
  const Diagnosis d = said_of_day(kOnce, kAbove22);
  EXPECT_EQ(d.verdict, Verdict::ambiguous) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"step"});
  expect_above_22(d);
}

TEST(LongRegime, ATemperatureThatIsPassedTwiceIsFound) {
  const Diagnosis d = said_of_day(kThereAndBack, kAbove22);
  EXPECT_EQ(d.verdict, Verdict::not_in_library) << d.paragraph;
  EXPECT_TRUE(d.effects.empty());
  expect_above_22(d);
}

// A shift of these sizes from this moment on is named as such.
void expect_step(const std::string& ambient, const std::string& parameters) {
  const Diagnosis d =
      said_of_day(ambient, "id = \"step\"\nrun = \"day\"\n[effect.parameters]\n" + parameters);
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"step"});
}

TEST(LongRegime, AStepWhereTheTemperatureGoesBackStaysOne) {
  expect_step(kThereAndBack, "X_um = 3\nY_um = 0\nZ_um = 0\nt_s = 2500\n");
}

// One component that acts in a part does not do what a shift in three does.
TEST(LongRegime, AStepInThreeDirectionsStaysOne) {
  expect_step(kOnce, "X_um = 2.5\nY_um = -2\nZ_um = 2\nt_s = 3600\n");
}

// Two balls with two tools, the one with the shorter tool in a room above 22 degC, and a day of which the
// first reading was: all but that one look like a tilt of the spindle.
Diagnosis said_of_two_tools(const std::string& truth) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  test::Campaign c;
  c.angles = c.table = false;
  std::string plan = test::plan_text(c);
  const std::string head =
      "quantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = 0.8\nu_common = 0.3\n";
  for (const auto& [id, tool, room] : {std::tuple{"ball_1", "-150", "23"}, {"ball_2", "-230", "21"}})
    plan += std::string("[[run]]\nid = \"") + id + "\"\nminutes = 20\n" + head + "tool_z_mm = " + tool +
            "\nT_ambient_degC = [[0, " + room + "], [20, " + room +
            "]]\ngrid = { A_deg = [-20, 20, 60], C_deg = [0, 70, 140, 210, 280] }\nball_mm = [80, 0, 60]\n";
  plan += "[[run]]\nid = \"day\"\nminutes = 120\n" + head +
          "T_ambient_degC = [[0, 22.1], [120, 16]]\nrepeat = 40\nposes = [[0, 0, 100, 0, 0]]\n";
  const Dataset data = test::measured(machine, plan, "[model]\nname = \"truth\"\n[[effect]]\n" + truth, 11);
  return diagnose(machine, data,
                  test::model_for(machine, data,
                                  "[model]\nname = \"base\"\n[[effect]]\nid = \"location:A\"\n"
                                  "[[effect]]\nid = \"location:C\"\n"));
}

TEST(LongRegime, AReadingThatAPartExplainsIsNoOutlier) {
  const Diagnosis d = said_of_two_tools(
      "id = \"user:warm\"\njoint = \"S\"\ncomponent = \"EYS\"\nexpression = \"k * (T_ambient > 2)\"\n"
      "[effect.parameters]\nk_um = 8\n");
  EXPECT_NE(d.verdict, Verdict::named) << d.paragraph;
  expect_above_22(d);
}

TEST(LongRegime, ATiltedSpindleStaysOne) {
  const Diagnosis d =
      said_of_two_tools("id = \"spindle_tilt\"\n[effect.parameters]\nA0S_urad = 100\nB0S_urad = 10\n");
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"spindle_tilt"});
  EXPECT_FALSE(d.formula);
}

// Whole runs above 22 degC, which their set-ups take up, and a ball of which three poses of fifteen are not.
TEST(LongRegime, APartThatSetupsTakeUpButForAFewReadingsIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  test::Campaign c;
  const std::string all = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
  std::string plan;
  for (const auto& [axis, low, high, room] :
       {std::tuple{"X", -240, 240, "19"}, {"Y", -240, 240, "21.5"}, {"Z", 0, 300, "23"}})
    plan += test::sweep_run(std::string("straight_") + axis, axis, low, high, 17, all, "displacement", c,
                            std::string("T_ambient_degC = [[0, ") + room + "], [15, " + room + "]]\n");
  const std::string head = "quantity = \"displacement\"\nn = " + all + "\nu_random = 0.8\nu_common = 0.3\n";
  for (const auto& [id, tool, from, to] :
       {std::tuple{"ball_1", "-150", "22.6", "22.6"}, {"ball_2", "-230", "22.041", "21.99"}})
    plan += std::string("[[run]]\nid = \"") + id + "\"\nminutes = 20\n" + head + "tool_z_mm = " + tool +
            "\nT_ambient_degC = [[0, " + from + "], [20, " + to +
            "]]\ngrid = { A_deg = [-25, 0, 80], C_deg = [0, 70, 140, 210, 280] }\nball_mm = [80, 0, 60]\n";
  plan += "[[run]]\nid = \"day\"\nminutes = 120\n" + head +
          "T_ambient_degC = [[0, 19], [60, 15], [120, 21]]\nrepeat = 40\nposes = [[0, 0, 100, 0, 0]]\n";
  const Dataset data = test::measured(
      machine, plan,
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:warm\"\njoint = \"S\"\ncomponent = \"EYS\"\n"
      "expression = \"k * (T_ambient > 2)\"\n[effect.parameters]\nk_um = 8\n",
      1);
  const Diagnosis d = diagnose(machine, data,
                               test::model_for(machine, data,
                                               "[model]\nname = \"base\"\n[[effect]]\nid = \"location:A\"\n"
                                               "[[effect]]\nid = \"location:C\"\n"));
  EXPECT_NE(d.verdict, Verdict::named) << d.paragraph;
  ASSERT_TRUE(d.formula) << d.paragraph;
  ASSERT_EQ(d.formula->acts_in.size(), 1U) << d.formula->words;
  const ActingRange& part = d.formula->acts_in[0];
  EXPECT_EQ(part.of, "T_ambient") << d.formula->words;
  // Above 22, or its opposite below: set-ups take up the difference.
  const auto end = part.from && std::abs(*part.from - 22.0) < 0.1 ? part.from : part.to;
  ASSERT_TRUE(end) << d.formula->words;
  EXPECT_NEAR(*end, 22.0, 0.02);
}

// Each angle in a warmer room than the one before, the last set-up turned: three parameters for each run, of
// which one does something, where "above this temperature" needs one. Whole runs are no part of a range.
TEST(LongRegime, ATurnedSetupInTheWarmestRunStaysOne) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  test::Campaign c;
  c.angles = c.table = false;
  std::string plan = test::plan_text(c);
  int room_degC = 18;
  for (const auto& [axis, low, high] :
       {std::tuple{"X", -240, 240}, {"Z", 0, 300}, {"A", -25, 100}, {"C", 0, 350}, {"Y", -240, 240}}) {
    const std::string room = std::to_string(++room_degC);
    plan += test::sweep_run(std::string("angle_") + axis, axis, low, high, 15,
                            "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "rotation", c,
                            "T_ambient_degC = [[0, " + room + "], [15, " + room + "]]\n");
  }
  const Dataset data = test::measured(machine, plan,
                                      "[model]\nname = \"truth\"\n[[effect]]\nid = \"setup_tilt\"\n"
                                      "[effect.parameters]\nC_angle_Y_urad = 4\n",
                                      5);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"base\"\n"));
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"setup_tilt"});
  EXPECT_FALSE(d.formula);
}

// Two places of a ball, C every 15 degrees.
std::string turns() {
  std::string places, out;
  for (int k = 0; k < 24; ++k) places += (k > 0 ? ", " : "") + std::to_string(15 * k);
  for (const auto& [id, ball] : {std::pair{"ball_1", "[80, 0, 60]"}, {"ball_2", "[0, 90, 120]"}})
    out += std::string("[[run]]\nid = \"") + id +
           "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, "
           "1]]\nu_random = 0.8\nu_common = 0.3\ngrid = { A_deg = [0, 35, 80], C_deg = [" +
           places + "] }\nball_mm = " + ball + "\n";
  return out;
}
std::string worn(const std::string& component, int size_um) {
  return "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:worn\"\njoint = \"C\"\ncomponent = \"" +
         component +
         "\"\nexpression = \"k * (C*180/_pi > 179) * (C*180/_pi < 281)\"\n[effect.parameters]\nk_um = " +
         std::to_string(size_um) + "\n";
}
Diagnosis said_of_turns(const std::string& more, const std::string& truth, std::uint64_t seed) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Dataset data = test::measured(machine, turns() + more, truth, seed);
  return diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"base\"\n"));
}

class WornSector : public testing::TestWithParam<std::pair<const char*, int>> {};

// A step up and one down again, a part of a part, one term twice, or one with the sense that the axis has
// there: all of them are one sector.
TEST_P(WornSector, IsSaidOnce) {
  const auto& [component, size_um] = GetParam();
  const Diagnosis d = said_of_turns("", worn(component, size_um), 3);
  ASSERT_TRUE(d.formula) << text_of(d.verdict) << ' ' << d.paragraph;
  EXPECT_NE(d.verdict, Verdict::named);
  EXPECT_EQ(d.formula->terms, 1U) << d.formula->words;
  EXPECT_EQ(d.formula->words.find("dir_"), std::string::npos) << d.formula->words;
  ASSERT_EQ(d.formula->acts_in.size(), 1U) << d.formula->words;
  const ActingRange& sector = d.formula->acts_in[0];
  EXPECT_EQ(sector.of, "C");
  ASSERT_TRUE(sector.from && sector.to) << d.formula->words;
  EXPECT_NEAR(*sector.from, 172.5, 15.0);  // between the last reading without and the first with, or one more
  EXPECT_NEAR(*sector.to, 277.5, 15.0);
}

INSTANTIATE_TEST_SUITE_P(Components, WornSector,
                         testing::Values(std::pair{"EXC", 2}, std::pair{"EYC", 2}, std::pair{"EZC", 2},
                                         std::pair{"EYC", 3}));

// Several terms in one sector: it is said once.
TEST(LongRegime, TermsOfOnePartActInIt) {
  const Diagnosis d = said_of_turns(
      "",
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:worn\"\njoint = \"C\"\ncomponent = \"EYC\"\n"
      "expression = \"k * (C*180/_pi > 119) * (C*180/_pi < 281) * (1 + sin(A))\"\n"
      "[effect.parameters]\nk_um = 5\n",
      3);
  ASSERT_TRUE(d.formula) << text_of(d.verdict) << ' ' << d.paragraph;
  ASSERT_GT(d.formula->terms, 1U) << "one term does not show it: " << d.formula->words;
  ASSERT_EQ(d.formula->acts_in.size(), 1U) << d.formula->words;
  ASSERT_TRUE(d.formula->acts_in[0].from && d.formula->acts_in[0].to) << d.formula->words;
  EXPECT_NEAR(*d.formula->acts_in[0].from, 112.5, 15.0);
  EXPECT_NEAR(*d.formula->acts_in[0].to, 277.5, 15.1);  // by one reading: the end is as four digits write it
}

// A few readings that stand far out and lie near each other are no part of the travel.
TEST(LongRegime, OutliersAreNoPart) {
  const Diagnosis d =
      said_of_turns("[simulation]\noutlier_fraction = 0.03\n",
                    "[model]\nname = \"truth\"\n[[effect]]\nid = \"location:A\"\n"
                    "[effect.parameters]\nY0A_um = 1.2\nZ0A_um = -1\nB0A_urad = 5\nC0A_urad = -4\n",
                    12);
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"location:A"});
}

}  // namespace
}  // namespace trunnion::diagnosis
