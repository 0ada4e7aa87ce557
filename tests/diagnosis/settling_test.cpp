#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/observations.hpp"

// A drift that settles in each run, and an axis that goes one way with time.
namespace trunnion::diagnosis {
namespace {

std::string slow_ball(const std::string& id, const std::string& place, double tool_z) {
  return "[[run]]\nid = \"" + id +
         "\"\nminutes = 12\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = "
         "0.6\nu_common = 0.3\ntool_z_mm = " +
         std::to_string(tool_z) +
         "\ngrid = { A_deg = [-20, 0, 20, 40, 60, 80], C_deg = [0, 45, 90, 135, 180, 225, 270, 315] }\n"
         "ball_mm = " +
         place + "\n";
}

struct SlowBalls {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;

  SlowBalls(const std::string& truth, std::uint64_t seed) {
    data =
        test::measured(machine, slow_ball("b1", "[80, 0, 60]", -150) + slow_ball("b2", "[0, 90, 120]", -220),
                       "[model]\nname = \"truth\"\n" + truth, seed);
  }
  Diagnosis said() const {
    return diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"none\"\n"));
  }
};

// Before: `named: time_drift + component:EZA` with 0.985.
TEST(Settling, IsNoSteadyDriftBesideAnAxisThatGoesWithTime) {
  for (const std::uint64_t seed : {1U, 2U}) {
    SlowBalls shop("", seed);
    const Observations o(shop.machine, shop.data);
    const MatrixXd& spindle = o.response(o.link_count() - 2);
    for (Eigen::Index i = 0; i < o.size(); ++i)
      shop.data.readings[static_cast<std::size_t>(i)].value +=
          spindle(i, 2) * 8e-3 * (1.0 - std::exp(-o.state(i).time_s / 400.0));
    const Diagnosis d = shop.said();
    EXPECT_NE(d.verdict, Verdict::named) << d.paragraph;
    EXPECT_NE(d.verdict, Verdict::nothing_to_find) << d.paragraph;
    EXPECT_EQ(std::count(d.effects.begin(), d.effects.end(), "component:EZA"), 0) << d.paragraph;
  }
}

TEST(Settling, ASteadyDriftBesideAnErrorOfAIsNamed) {
  const SlowBalls shop(
      "[[effect]]\nid = \"time_drift\"\n[effect.parameters]\nZ_um_per_h = 40\n"
      "[[effect]]\nid = \"component:EYA\"\n[effect.parameters]\ncos1_um = 5\nsin2_um = -4\n",
      1);
  const Diagnosis d = shop.said();
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(d.paragraph.find("settles in each run"), std::string::npos) << d.paragraph;
}

}  // namespace
}  // namespace trunnion::diagnosis
