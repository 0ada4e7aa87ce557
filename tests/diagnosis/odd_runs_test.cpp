#include <algorithm>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "support/cases.hpp"

// One run of many that was measured, or written down, otherwise than its columns say: a wrong sign, another
// unit, a wrong scale. None of it is physics.
namespace trunnion::diagnosis {
namespace {

const std::string kTruthOfOddRuns =
    "[model]\nname = \"m\"\n"
    "[[effect]]\nid = \"location:A\"\n[effect.parameters]\nY0A_um = 14\nZ0A_um = -9\nB0A_urad = 40\nC0A_urad "
    "= -32\n"
    "[[effect]]\nid = \"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = 40\n"
    "[[effect]]\nid = \"component:EBX\"\n[effect.parameters]\nP1_urad = 20\nP2_urad = -15\n";
const std::string kNothingKnown = "[model]\nname = \"none\"\n";
const std::string kAllKnown =
    "[model]\nname = \"all\"\n[[effect]]\nid = \"location:A\"\n[[effect]]\nid = \"squareness:C0Y\"\n"
    "[[effect]]\nid = \"component:EBX\"\n";

struct Shop {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;

  explicit Shop(std::uint64_t seed) {
    const std::string second_line = test::sweep_run("laser_x2", "X", -250, 250, 21, "[1, 0, 0]",
                                                    "displacement", {}, "at = { Y_mm = 100, Z_mm = 90 }\n");
    data = test::measured(machine, test::plan_text({}) + second_line, kTruthOfOddRuns, seed);
  }
  void scale(const std::string& run, double factor) {
    for (Reading& r : data.readings)
      if (data.context.runs[data.run_of(r)].id == run) r.value *= factor;
  }
  Diagnosis said(const std::string& known) const {
    return diagnose(machine, data, test::model_for(machine, data, known));
  }
};

// Before: `named_but_incomplete`, tilts of the set-ups with 0.97.
TEST(LongOneRun, ItsSignBesideAnEmptyModel) {
  Shop shop(1);
  shop.scale("angle_A", -1.0);
  const Diagnosis d = shop.said(kNothingKnown);
  ASSERT_EQ(d.verdict, Verdict::bookkeeping) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().convention.kind, ConventionKind::reading_sense) << d.paragraph;
  EXPECT_EQ(d.bookkeeping.front().run, "angle_A") << d.paragraph;
}

// Before: no such mistake was looked for, and effects were named.
TEST(LongOneRun, ArcsecondsForMicroradians) {
  constexpr double kArcsecond_urad = 4.84813681109536;
  for (const std::string& known : {kNothingKnown, kAllKnown}) {
    Shop shop(2);
    shop.scale("angle_X", 1.0 / kArcsecond_urad);
    const Diagnosis d = shop.said(known);
    ASSERT_EQ(d.verdict, Verdict::bookkeeping) << known << d.paragraph;
    EXPECT_EQ(d.bookkeeping.front().run, "angle_X") << d.paragraph;
    EXPECT_NEAR(d.bookkeeping.front().convention.factor, kArcsecond_urad, 1e-6) << d.paragraph;
    EXPECT_NE(d.paragraph.find("arcsec"), std::string::npos) << d.paragraph;
  }
}

// Two lines along X, one of them 60 um/m too long: a cross-talk was named.
TEST(LongOneRun, AWrongScaleIsNoCrossTalk) {
  Shop shop(3);
  for (Reading& r : shop.data.readings)
    if (shop.data.context.runs[shop.data.run_of(r)].id == "laser_x2")
      r.value += 6e-5 * shop.data.track.state(r.row).q[0];
  const Diagnosis d = shop.said(kNothingKnown);
  EXPECT_NE(d.verdict, Verdict::named) << d.paragraph;
  for (const std::string& id : d.effects)
    EXPECT_NE(kTruthOfOddRuns.find("\"" + id + "\""), std::string::npos) << id << ": " << d.paragraph;
  const Diagnosis known = shop.said(kAllKnown);
  const std::vector<std::string>& odd = known.rows.odd_runs;
  EXPECT_NE(std::find(odd.begin(), odd.end(), "laser_x2"), odd.end()) << known.paragraph;
  const auto steps =
      improve(shop.machine, shop.data, test::model_for(shop.machine, shop.data, kNothingKnown));
  for (const ModelEffect& effect : steps.back().model.effects)
    EXPECT_NE(kTruthOfOddRuns.find("\"" + effect.id() + "\""), std::string::npos) << effect.id();
}

// Two short waves of a worm, which no run but the fine one could show. Before: the fine one was blamed.
TEST(LongOneRun, AFineRunIsNotBlamedForShortWaves) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string plan =
      test::plan_text({}) + test::sweep_run("fine_c", "C", 0, 180, 61, "[0, 0, 1]", "rotation", {});
  const std::string truth =
      "[model]\nname = \"m\"\n[[effect]]\nid = \"user:worm\"\njoint = \"C\"\ncomponent = \"ECC\"\n"
      "expression = \"a * cos(72 * C) + b * sin(43 * C)\"\n[effect.parameters]\na_urad = 12\nb_urad = 9\n";
  const Dataset data = test::measured(machine, plan, truth, 3);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kNothingKnown));
  const std::vector<std::string>& odd = d.rows.odd_runs;
  EXPECT_EQ(std::find(odd.begin(), odd.end(), "fine_c"), odd.end()) << d.paragraph;
  EXPECT_EQ(d.paragraph.find("do not go with the others"), std::string::npos) << d.paragraph;
}

TEST(LongOneRun, HonestRunsAreNotAccused) {
  for (int seed = 1; seed <= test::cases(2); ++seed) {
    const Diagnosis d = Shop(static_cast<std::uint64_t>(seed)).said(kNothingKnown);
    EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
    EXPECT_TRUE(d.bookkeeping.empty() && d.rows.odd_runs.empty()) << d.paragraph;
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
