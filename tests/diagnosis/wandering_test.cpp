#include <algorithm>
#include <random>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"

// An instrument that wanders while it is read: no error of the machine, and hides none.
namespace trunnion::diagnosis {
namespace {

struct Readings {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data;

  Readings(std::uint64_t seed, const std::string& truth = "") {
    test::Campaign plan;
    plan.angles = false;
    data = test::measured(machine, test::plan_text(plan), "[model]\nname = \"truth\"\n" + truth, seed);
  }
  // First-order autoregressive along the rows of each run: of this size (over u_random) and correlation.
  void wander(std::uint64_t seed, double size, double correlation) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    std::size_t run = data.context.runs.size();
    double now = 0.0;
    for (Reading& r : data.readings) {
      const bool begins = data.run_of(r) != run;
      run = data.run_of(r);
      now = begins ? normal(engine)
                   : correlation * now + std::sqrt(1.0 - correlation * correlation) * normal(engine);
      r.value += size * r.u_random * now;
    }
  }
  Diagnosis said() const { return test::said_beside_locations(machine, data); }
};

TEST(LongWanderingReadings, AreNoErrorOfTheMachine) {
  for (const double correlation : {0.9, 0.97})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Readings readings(seed);
      readings.wander(100 + seed, 1.5, correlation);
      const Diagnosis d = readings.said();
      EXPECT_TRUE(d.verdict == Verdict::data_problem || d.verdict == Verdict::nothing_to_find ||
                  d.confidence <= 0.7)
          << correlation << " " << seed << ": " << text_of(d.verdict) << " " << d.confidence << " "
          << d.paragraph;
      EXPECT_TRUE(d.additions.empty() || d.verdict != Verdict::data_problem) << d.paragraph;
    }
}

TEST(LongWanderingReadings, HideNoEffect) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    Readings readings(seed, "[[effect]]\nid = \"backlash:Y\"\n[effect.parameters]\nb_um = 8\n");
    readings.wander(200 + seed, 1.5, 0.9);
    const Diagnosis d = readings.said();
    EXPECT_NE(std::find(d.effects.begin(), d.effects.end(), "backlash:Y"), d.effects.end())
        << seed << ": " << text_of(d.verdict) << " " << d.paragraph;
  }
}

// What settles with time is an error that the library has.
TEST(LongWanderingReadings, AreNotSaidOfADrift) {
  const Readings readings(
      4,
      "[[effect]]\nid = \"time_drift\"\n[effect.parameters]\nX_um_per_h = 20\nY_um_per_h = "
      "-12\nZ_um_per_h = 25\n");
  const Diagnosis d = readings.said();
  EXPECT_NE(d.verdict, Verdict::data_problem) << d.paragraph;
  EXPECT_EQ(d.paragraph.find("an instrument that wanders"), std::string::npos) << d.paragraph;
}

}  // namespace
}  // namespace trunnion::diagnosis
