#include <algorithm>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/observations.hpp"

// A ball that was taken out, an axis that was homed anew or a laser of another scale in one run: constants of
// that run, which its temperature, a little other than that of the other runs, labels as well.
namespace trunnion::diagnosis {
namespace {

struct Runs {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;

  explicit Runs(std::uint64_t seed,
                const std::vector<std::string>& temperatures = {"20.54", "19.83", "20.21"},
                const std::string& truth = "") {
    std::string plan;
    const std::vector<std::string> places = {"[80, 0, 60]", "[0, 90, 120]", "[-70, -40, 40]"};
    for (std::size_t k = 0; k < places.size(); ++k)
      plan +=
          "[[run]]\nid = \"ball" + std::to_string(k + 1) +
          "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
          "u_random = 0.8\nu_common = 0.3\nT_ambient_degC = [[0, " +
          temperatures[k] + "], [20, " + temperatures[k] +
          "5]]\ngrid = { A_deg = [-20, 10, 40, 70, 95], C_deg = [0, 60, 130, 190, 250, 310] }\nball_mm = " +
          places[k] + "\n";
    for (const std::string axis : {"X", "Y"})
      plan += test::sweep_run("laser_" + axis, axis, -240, 240, 25, axis == "X" ? "[1, 0, 0]" : "[0, 1, 0]",
                              "displacement", {}, "T_ambient_degC = [[0, 20.1], [15, 20.15]]\n");
    data = test::measured(machine, plan, "[model]\nname = \"m\"\n" + truth, seed);
  }
  // What this link's displacement by `by` (mm) in that run adds to its readings.
  void displace(const std::string& run, std::size_t link, const Vec3& by) {
    const Observations o(machine, data);
    const MatrixXd response = o.response(link);
    for (std::size_t i = 0; i < data.readings.size(); ++i)
      if (data.context.runs[data.run_of(data.readings[i])].id == run)
        data.readings[i].value += response.row(static_cast<Eigen::Index>(i)).head<3>() * by;
  }
  Diagnosis said() const { return test::said_beside_locations(machine, data); }
};

bool is_of(const Diagnosis& d, EffectClass kind) {
  return std::any_of(d.additions.begin(), d.additions.end(),
                     [&](const ModelEffect& effect) { return effect.effect->info().kind == kind; });
}

TEST(LongMovedInRun, ABallOfOneRunIsNoThermalEffect) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Runs runs(seed);
    runs.displace("ball2", Observations(runs.machine, runs.data).link_count() - 2, Vec3(0.030, -0.020, 0.0));
    const Diagnosis d = runs.said();
    EXPECT_FALSE(d.verdict == Verdict::named && is_of(d, EffectClass::thermal)) << d.paragraph;
    EXPECT_NE(d.paragraph.find("ball2"), std::string::npos) << d.paragraph;
  }
}

// Before: `thermal_location:C` at 0.985 in each of the three.
TEST(LongMovedInRun, AnAxisHomedAnewIsNoThermalEffect) {
  using Temperatures = std::vector<std::string>;
  for (const auto& [seed, temperatures] : {std::pair{1U, Temperatures{"20.276", "19.711", "19.699"}},
                                           std::pair{7U, Temperatures{"19.794", "20.173", "20.200"}},
                                           std::pair{9U, Temperatures{"20.178", "20.141", "20.139"}}}) {
    Runs runs(seed, temperatures);
    runs.displace("ball1", *runs.machine.axis("C"), Vec3(0.020, 0.015, 0.0));
    const Diagnosis d = runs.said();
    EXPECT_FALSE(d.verdict == Verdict::named && is_of(d, EffectClass::thermal)) << seed << d.paragraph;
    EXPECT_NE(d.paragraph.find("ball1"), std::string::npos) << seed << d.paragraph;
  }
}

// A machine as sensitive as machines are, between runs that are some kelvins apart.
TEST(LongMovedInRun, AThermalEffectOfUsualSizeIsNamed) {
  const Runs runs(5, {"18.0", "23.0", "26.0"},
                  "[[effect]]\nid = \"ambient_drift\"\n[effect.parameters]\nX_um_per_K = 2\nY_um_per_K = -1\n"
                  "Z_um_per_K = 3\ntau_s = 600\n");
  const Diagnosis d = runs.said();
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.effects, std::vector<std::string>{"ambient_drift"}) << d.paragraph;
}

}  // namespace
}  // namespace trunnion::diagnosis
