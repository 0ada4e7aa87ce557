#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"

// What whoever wrote one file of several does in all runs of it: another frame, another unit. None of it is
// physics, and no single run shows it alone.
namespace trunnion::diagnosis {
namespace {

const std::string kOfTheMachine =
    "[[effect]]\nid = \"backlash:A\"\n[effect.parameters]\nb_urad = 40\n"
    "[[effect]]\nid = \"component:EBC\"\n[effect.parameters]\ncos1_urad = 25\nsin1_urad = -20\n";

struct TwoFiles {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;

  // The first ball and the lines stand in one file, the two other balls in another, of the machine as it is
  // later.
  explicit TwoFiles(std::uint64_t seed, const std::string& later = kOfTheMachine) {
    std::string plan;
    for (const auto& [id, ball] : {std::pair{"one", "[80, 0, 60]"}, std::pair{"two", "[0, 90, 120]"},
                                   std::pair{"three", "[-60, -30, 40]"}})
      plan +=
          std::string("[[run]]\nid = \"") + id +
          "\"\nminutes = 20\nquantity = \"displacement\"\nu_random = 0.8\nu_common = 0.3\nn = [[1, 0, 0], "
          "[0, 1, 0], [0, 0, 1]]\ngrid = { A_deg = [-20, 10, 40, 70, 95, 70, 40, 10, -20], C_deg = [0, 47, "
          "95, 141, 188, 235, 283, 330] }\nball_mm = " +
          ball + "\n";
    for (const auto& [id, axis, n] :
         {std::tuple{"x", "X", "[[1, 0, 0]]"}, std::tuple{"y", "Y", "[[0, 1, 0]]"}})
      plan += test::sweep_run(id, axis, -240, 240, 21, n, "displacement", {});
    data = test::measured(machine, plan, "[model]\nname = \"m\"\n" + kOfTheMachine, seed);
    const Dataset moved = test::measured(machine, plan, "[model]\nname = \"m\"\n" + later, seed);
    data.files = {"a.csv", "b.csv"};
    for (std::size_t i = 0; i < data.readings.size(); ++i) {
      Reading& r = data.readings[i];
      data.rows[r.row].file = is_of_second(r) ? 1 : 0;
      if (is_of_second(r)) r.value = moved.readings[i].value;
    }
  }
  bool is_of_second(const Reading& r) const {
    const std::string& run = data.context.runs[data.run_of(r)].id;
    return run == "two" || run == "three";
  }
  Diagnosis said() const {
    return diagnose(
        machine, data,
        test::model_for(machine, data, "[model]\nname = \"m\"\n[[effect]]\nid = \"component:EBC\"\n"));
  }
};

void expect_of_second_file(const Diagnosis& d, ConventionKind kind) {
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().convention.kind, kind) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().file, "b.csv") << d.paragraph;
  EXPECT_NE(d.paragraph.find("b.csv"), std::string::npos) << d.paragraph;
}

TEST(LongOneFile, TheFrameOfItsDirections) {
  TwoFiles files(1);
  for (Reading& r : files.data.readings)
    if (files.is_of_second(r)) r.frame = SensitivityFrame::part;
  expect_of_second_file(files.said(), ConventionKind::frame);
}

TEST(LongOneFile, TheFrameOfASingleRun) {
  TwoFiles files(4);
  for (Reading& r : files.data.readings)
    if (files.data.context.runs[files.data.run_of(r)].id == "three") r.frame = SensitivityFrame::part;
  const Diagnosis d = files.said();
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().convention.kind, ConventionKind::frame) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().run, "three") << d.paragraph;
}

TEST(LongOneFile, MillimetresForMicrometres) {
  TwoFiles files(2);
  for (Reading& r : files.data.readings)
    if (files.is_of_second(r)) {
      r.value *= 1000.0;
      r.u_random *= 1000.0;
      if (r.u_common) *r.u_common *= 1000.0;
    }
  expect_of_second_file(files.said(), ConventionKind::unit);
}

// The values in the user's file are a fifth off those of the machine.
const std::string kKnownWithValues =
    "[model]\nname = \"m\"\n[[effect]]\nid = \"component:EBC\"\n[effect.parameters]\ncos1_urad = "
    "30\nsin1_urad "
    "= -17\n";

Diagnosis measured_with_compensation(std::uint64_t seed, const std::vector<std::string>& runs) {
  TwoFiles files(seed);
  const Model model = test::model_for(files.machine, files.data, kKnownWithValues);
  for (const std::string& run : runs) {
    Convention c;
    c.kind = ConventionKind::compensated;
    c.effects = model.effects.size();
    for (std::size_t i = 0; i < files.data.context.runs.size(); ++i)
      if (files.data.context.runs[i].id == run) c.run = i;
    // What is put back is taken out here.
    const Dataset back = put_right(files.machine, model, files.data, c).data;
    for (std::size_t i = 0; i < files.data.readings.size(); ++i)
      files.data.readings[i].value = 2.0 * files.data.readings[i].value - back.readings[i].value;
  }
  return diagnose(files.machine, files.data, model);
}

TEST(LongOneFile, MeasuredWhileTheControlCompensates) {
  const Diagnosis d = measured_with_compensation(5, {"two", "three"});
  expect_of_second_file(d, ConventionKind::compensated);
  EXPECT_NE(d.paragraph.find("compensat"), std::string::npos) << d.paragraph;
  const Diagnosis one = measured_with_compensation(6, {"three"});
  ASSERT_EQ(one.verdict, Verdict::bookkeeping) << one.paragraph;
  EXPECT_EQ(one.bookkeeping.front().convention.kind, ConventionKind::compensated) << one.paragraph;
  EXPECT_EQ(one.bookkeeping.front().run, "three") << one.paragraph;
  const Diagnosis none = measured_with_compensation(7, {});
  EXPECT_EQ(none.verdict, Verdict::named) << none.paragraph;
  EXPECT_EQ(none.effects, std::vector<std::string>{"backlash:A"}) << none.paragraph;
}

// A collision leaves other values of the known effect: they look as if much of it had been taken out.
TEST(LongOneFile, AChangeOfTheMachineIsNoCompensation) {
  for (const auto& [cosine, sine] : {std::pair{"10", "-8"}, std::pair{"4", "-12"}}) {
    const std::string later =
        "[[effect]]\nid = \"backlash:A\"\n[effect.parameters]\nb_urad = 40\n"
        "[[effect]]\nid = \"component:EBC\"\n[effect.parameters]\ncos1_urad = " +
        std::string(cosine) + "\nsin1_urad = " + sine + "\n";
    TwoFiles files(8, later);
    const Diagnosis d =
        diagnose(files.machine, files.data, test::model_for(files.machine, files.data, kKnownWithValues));
    for (const auto& b : d.bookkeeping)
      EXPECT_NE(b.convention.kind, ConventionKind::compensated) << cosine << ": " << d.paragraph;
  }
}

TEST(LongOneFile, RightFilesAreNotAccused) {
  const Diagnosis d = TwoFiles(3).said();
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"backlash:A"}) << d.paragraph;
  EXPECT_TRUE(d.bookkeeping.empty()) << d.paragraph;
}

}  // namespace
}  // namespace trunnion::diagnosis
