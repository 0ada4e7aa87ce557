#include <algorithm>
#include <numeric>

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/condensed.hpp"
#include "diagnosis/fit/observations.hpp"
#include "support/cases.hpp"

// Very many readings: what is taken together, and that nothing is lost or made up by it.
namespace trunnion::diagnosis {
namespace {

const std::string kTruth =
    "[model]\nname = \"m\"\n[[effect]]\nid = \"component:EYX\"\n[effect.parameters]\nP2_um = 4\nP3_um = -3\n";

struct Many {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data;
  explicit Many(int points) {
    const std::string all = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    std::string plan = test::sweep_run("x", "X", -240, 240, points, all, "displacement", {});
    plan += test::sweep_run("y", "Y", -240, 240, points, all, "displacement", {});
    plan += test::sweep_run("angle_x", "X", -240, 240, points / 10, all, "rotation", {});
    data = test::measured(machine, plan, kTruth, 3);
  }
};

TEST(ManyReadings, EveryReadingIsInOneBinOfItsRunQuantityDirectionAndSense) {
  const Many m(900);
  const Observations o(m.machine, m.data);
  const Bins bins = bins_of(o);
  std::vector<int> seen(m.data.readings.size(), 0);
  for (const Eigen::Index i : bins.far) ++seen[static_cast<std::size_t>(i)];
  for (const auto& bin : bins.members) {
    ASSERT_FALSE(bin.empty());
    for (const Eigen::Index i : bin) {
      ++seen[static_cast<std::size_t>(i)];
      EXPECT_EQ(o.reading(i).group, o.reading(bin.front()).group);
      EXPECT_EQ(o.state(i).run, o.state(bin.front()).run);
      EXPECT_EQ(o.state(i).direction, o.state(bin.front()).direction);
    }
  }
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
  EXPECT_NEAR(static_cast<double>(bins.members.size()), static_cast<double>(kMostSingly), 0.02 * kMostSingly);
}

// The mean of what the readings of a bin show, against sums made here.
TEST(ManyReadings, MeansAreThoseOfTheReadings) {
  const Many m(900);
  const auto whole = std::make_shared<const Observations>(m.machine, m.data);
  const Bins bins = bins_of(*whole);
  const Observations o(whole, bins);
  ASSERT_EQ(o.size(), static_cast<Eigen::Index>(bins.members.size()));
  const Model model = test::model_for(m.machine, m.data, kTruth);
  const VectorXd said = o.predicted(model), each = whole->predicted(model);
  const MatrixXd slopes = o.columns(model.effects.front()),
                 each_slope = whole->columns(model.effects.front());
  for (Eigen::Index b = 0; b < o.size(); ++b) {
    const auto& bin = bins.members[static_cast<std::size_t>(b)];
    double value = 0.0, model_value = 0.0, slope = 0.0, variance = 0.0;
    for (const Eigen::Index i : bin) {
      value += whole->values()[i];
      model_value += each[i];
      slope += each_slope(i, 1);
      variance += std::pow(whole->reading(i).u_random, 2);
    }
    const auto n = static_cast<double>(bin.size());
    EXPECT_NEAR(o.values()[b], value / n, 1e-15);
    EXPECT_NEAR(said[b], model_value / n, 1e-15);
    EXPECT_NEAR(slopes(b, 1), slope / n, 1e-12);
    EXPECT_NEAR(o.reading(b).u_random, std::sqrt(variance) / n, 1e-15);
    EXPECT_EQ(o.reading(b).u_common, whole->reading(bin.front()).u_common);
  }
}

TEST(ManyReadings, ASingleReadingFarOffIsInNoBin) {
  Many m(1800);
  m.data.readings[777].value += 0.05;
  const Bins bins = bins_of(Observations(m.machine, m.data));
  ASSERT_EQ(bins.far.size(), 1u);
  EXPECT_EQ(bins.far.front(), 777);
}

TEST(LongManyReadings, TheEffectIsNamedAsByFewerReadings) {
  for (const int points : {60, 2000}) {
    const Many m(points);
    const Diagnosis d =
        diagnose(m.machine, m.data, test::model_for(m.machine, m.data, "[model]\nname = \"m\"\n"));
    EXPECT_EQ(d.verdict, Verdict::named) << points << "\n" << d.paragraph;
    EXPECT_EQ(d.effects, std::vector<std::string>{"component:EYX"}) << points;
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
