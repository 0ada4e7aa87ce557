#include <algorithm>
#include <random>

#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "support/cases.hpp"

// Readings that scatter more in one run, or far out, than their stated uncertainty says: weighed by it, no
// causes.
namespace trunnion::diagnosis {
namespace {

const std::string kNothing = "[model]\nname = \"base\"\n";
const std::string kSquareness = "[[effect]]\nid = \"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = 15\n";

template <class Factor>
Dataset scattered(Dataset data, std::uint64_t seed, const Factor& factor) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  for (Reading& r : data.readings) {
    const double f = factor(data, r);
    r.value += std::sqrt(f * f - 1.0) * r.u_random * normal(engine);
  }
  return data;
}

double of_noisy_run(const Dataset& data, const Reading& r) {
  return data.context.runs[data.run_of(r)].id == "ball_2" ? 5.0 : 1.0;
}
double by_distance(const Dataset& data, const Reading& r) {
  const auto& q = data.track.state(r.row).q;
  return 1.0 + 3.0 * Vec3(q[0], q[1], q[2] - 150.0).norm() / 250.0;
}

test::Campaign plan() {
  test::Campaign out;
  out.angles = false;
  return out;
}

struct Case {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset even;
  explicit Case(const std::string& truth, std::uint64_t seed = 1)
      : even(test::measured(machine, test::plan_text(plan()), "[model]\nname = \"truth\"\n" + truth, seed)) {}
  Diagnosis said_of(const Dataset& data) const {
    return diagnose(machine, data, test::model_for(machine, data, kNothing), {.plan = false});
  }
};

void noise_of_one_run_makes_no_causes(std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const Case c("", seed);
    const Dataset data = scattered(c.even, seed, of_noisy_run);
    const Diagnosis d = c.said_of(data);
    EXPECT_TRUE(d.effects.empty()) << seed << ": " << d.paragraph;
    EXPECT_NE(d.verdict, Verdict::not_in_library) << seed << ": " << d.paragraph;
    ASSERT_TRUE(d.scatter.uneven) << seed;
    EXPECT_EQ(d.scatter.uneven->depends_on.front(), "run") << seed;
    for (std::size_t i = 0; i < data.readings.size(); ++i) {
      const double factor = d.scatter.uneven->factor[i];
      if (of_noisy_run(data, data.readings[i]) > 1.0)
        EXPECT_NEAR(factor, 5.0, 1.5) << seed;
      else
        EXPECT_LT(factor, 2.0) << seed;  // of a run of 60 readings it is known to 15 % or so
    }
  }
}

void uneven_noise_hides_no_cause(std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const Case c(kSquareness, seed);
    const Dataset noisy = scattered(c.even, seed, of_noisy_run);
    const Diagnosis d = c.said_of(noisy);
    EXPECT_EQ(d.effects, std::vector<std::string>{"squareness:C0Y"}) << seed << ": " << d.paragraph;
    EXPECT_NE(d.paragraph.find("scatter unevenly, which changes from run to run"), std::string::npos);
    ASSERT_EQ(d.additions.size(), 1U) << seed;
    const ParameterValue& size = d.additions[0].parameters[0];
    EXPECT_NEAR(size.value / 1e-6, 15.0, 4.0 * size.sigma.value_or(0.0) / 1e-6) << seed;
    const Diagnosis far = c.said_of(scattered(c.even, seed, by_distance));
    EXPECT_TRUE(std::any_of(
        far.sets.begin(), far.sets.end(),
        [](const auto& set) { return std::find(set.begin(), set.end(), "squareness:C0Y") != set.end(); }))
        << seed << ": " << far.paragraph;
    ASSERT_TRUE(far.scatter.uneven) << seed;
  }
}

void even_noise_is_not_uneven(std::uint64_t first, std::uint64_t last) {
  const std::array truths = {
      std::string(), kSquareness,
      std::string("[[effect]]\nid = \"periodic:X\"\n[effect.parameters]\nsin_um = 2\ncos_um = 1\np_mm = 5\n"),
      std::string("[[effect]]\nid = \"backlash:Y\"\n[effect.parameters]\nb_um = 2\n")};
  for (const std::string& truth : truths)
    for (std::uint64_t seed = first; seed <= last; ++seed) {
      const Case c(truth, seed);
      EXPECT_FALSE(c.said_of(c.even).scatter.uneven) << seed << ": " << truth;
    }
}

// A probe that is noisier along Z than along X and Y. Before: an effect that the library lacks, or four that
// it has.
TEST(LongUnevenScatter, OfOneDirectionMakesNoCauses) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Case c("", seed);
    const Dataset data = scattered(
        c.even, seed, [](const Dataset&, const Reading& r) { return std::abs(r.n.z()) > 0.9 ? 3.2 : 1.0; });
    const Diagnosis d = c.said_of(data);
    EXPECT_TRUE(d.effects.empty() || d.confidence <= 0.9) << seed << ": " << d.paragraph;
    EXPECT_NE(d.verdict, Verdict::not_in_library) << seed << ": " << d.paragraph;
    ASSERT_TRUE(d.scatter.uneven) << seed << d.paragraph;
    EXPECT_EQ(d.scatter.uneven->depends_on.front(), "direction") << seed;
  }
}
TEST(LongUnevenScatter, OfOneRunMakesNoCauses) {
  noise_of_one_run_makes_no_causes(1, 1);
}
TEST(LongUnevenScatter, HidesNoCause) {
  uneven_noise_hides_no_cause(2, 2);
}
TEST(LongUnevenScatter, IsNotSeenWhereThereIsNone) {
  even_noise_is_not_uneven(1, 1);
}
TEST(LongUnevenScatter, MakesNoCausesAndHidesNone) {
  noise_of_one_run_makes_no_causes(2, 4);
  uneven_noise_hides_no_cause(1, 1);
  uneven_noise_hides_no_cause(3, 3);
  even_noise_is_not_uneven(2, 3);
}

}  // namespace
}  // namespace trunnion::diagnosis
