#include <algorithm>

#include "trunnion/diagnosis/fit.hpp"

#include "diagnosis/campaigns.hpp"

// Which readings a fit leaves out: those that stand out alone, not those that a missing effect makes.
namespace trunnion::diagnosis {
namespace {

const std::string kNothing = "[model]\nname = \"base\"\n";

// A dent in the guideway, 15 um deep, that a few readings of each pass see.
const std::string kDent =
    "[model]\nname = \"truth\"\n[[effect]]\nid = \"user:dent\"\njoint = \"X\"\ncomponent = \"EXX\"\n"
    "expression = \"k * exp(-((X - 60) / 12)^2)\"\n[effect.parameters]\nk_um = 15\n";

Dataset lasers(const std::string& truth, std::uint64_t seed) {
  test::Campaign campaign;
  campaign.angles = campaign.table = false;
  return test::measured(test::thermal_machine("trunnion_offset"), test::plan_text(campaign), truth, seed);
}

Fit fitted(const Dataset& data) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  return fit(machine, data, test::model_for(machine, data, kNothing));
}

std::ptrdiff_t left_out(const Fit& f) {
  return std::count(f.outlier.begin(), f.outlier.end(), true);
}

TEST(Outliers, AreNotWhatAMissingEffectMakes) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Dataset data = lasers(kDent, seed);
    std::ptrdiff_t dented = 0;
    for (const Reading& r : data.readings) {
      const double x = data.track.state(r.row).q[0];
      if (std::abs(x - 60.0) < 12.0 && r.n.x() > 0.5) ++dented;
    }
    ASSERT_GE(dented, 4);
    EXPECT_EQ(left_out(fitted(data)), 0) << "seed " << seed;
  }
}

// Wild readings beside the dent: they go, the dent stays.
TEST(Outliers, AloneAreLeftOutBesideAMissingEffect) {
  Dataset data = lasers(kDent, 4);
  std::vector<std::size_t> wild;
  for (std::size_t i = 20; i < data.readings.size(); i += 61) {
    const Reading& r = data.readings[i];
    if (std::abs(data.track.state(r.row).q[0] - 60.0) < 50.0) continue;
    data.readings[i].value += (wild.size() % 2 == 0 ? 1.0 : -1.0) * 30e-3;
    wild.push_back(i);
  }
  ASSERT_GE(wild.size(), 4U);
  const Fit f = fitted(data);
  for (const std::size_t i : wild) EXPECT_TRUE(f.outlier[i]) << "reading " << i;
  EXPECT_LE(left_out(f), static_cast<std::ptrdiff_t>(wild.size()) + 1);
}

TEST(Outliers, AloneAreLeftOut) {
  Dataset data = lasers(kNothing, 5);
  for (std::size_t i = 10; i < data.readings.size(); i += 40)
    data.readings[i].value += (i % 80 == 10 ? 1.0 : -1.0) * 12e-3;
  const Fit f = fitted(data);
  for (std::size_t i = 10; i < data.readings.size(); i += 40) EXPECT_TRUE(f.outlier[i]) << "reading " << i;
}

// A step within one run: many readings, to one side. One at its edge may have a neighbour in pose that was
// read before it.
TEST(Outliers, AreNotWhatAStepMakes) {
  const Dataset data = lasers(
      "[model]\nname = \"truth\"\n[[effect]]\nid = \"step\"\nrun = \"straight_y\"\n"
      "[effect.parameters]\nX_um = 9\nt_s = 700\n",
      6);
  EXPECT_LE(left_out(fitted(data)), 1);
}

// Five of forty readings at one pose, one after the other, and as many wild ones among all: each of the five
// has one of them beside it, and the wild ones have none.
TEST(Outliers, AreNotAFewReadingsInARow) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  test::Campaign campaign;
  campaign.angles = campaign.table = false;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Dataset data = test::measured(
        machine,
        test::plan_text(campaign) +
            "[[run]]\nid = \"day\"\nminutes = 120\nquantity = \"displacement\"\nn = [0, 0, 1]\n"
            "u_random = 0.8\nu_common = 0.3\nrepeat = 40\nposes = [[0, 0, 100, 0, 0]]\n",
        kNothing, seed);
    std::vector<std::size_t> row, wild;
    std::size_t of_day = 0;
    for (std::size_t i = 0; i < data.readings.size(); ++i) {
      const Reading& r = data.readings[i];
      if (data.context.runs[data.track.state(r.row).run].id == "day") {
        if (++of_day > 8 && of_day <= 13) row.push_back(i);
      } else if (i % 61 == 20 && wild.size() < 5) {
        wild.push_back(i);
      }
    }
    ASSERT_EQ(row.size(), 5U);
    ASSERT_EQ(wild.size(), 5U);
    for (const std::size_t i : row) data.readings[i].value -= 7e-3;
    for (const std::size_t i : wild) data.readings[i].value += (i % 2 == 0 ? 1.0 : -1.0) * 12e-3;
    const Fit f = fitted(data);
    for (const std::size_t i : row) EXPECT_FALSE(f.outlier[i]) << "reading " << i << ", seed " << seed;
    for (const std::size_t i : wild) EXPECT_TRUE(f.outlier[i]) << "reading " << i << ", seed " << seed;
  }
}

// Among the smooth functions is a level of each run. Where a run is read in three directions its set-up takes
// that up, and rounding is left: scaled up to the length of the others it was a column of the first reading
// alone, which then was never wild.
TEST(Outliers, AreLeftOutWhereARunBegins) {
  for (const char* run : {"straight_x", "straight_y", "straight_z"}) {
    const Dataset good = lasers(kNothing, 7);
    std::size_t first = 0;
    while (good.context.runs[good.run_of(good.readings[first])].id != run) ++first;
    for (std::size_t i = first; i < first + 3; ++i) {
      Dataset data = good;
      data.readings[i].value += 10e-3;
      const Fit f = fitted(data);
      EXPECT_TRUE(f.outlier[i]) << "reading " << i - first << " of " << run;
      EXPECT_LE(left_out(f), 2);
    }
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
