#include <algorithm>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/observations.hpp"

// A tool whose length or run-out is wrong, and the room's temperature, which differs between the runs: only
// what varies within the runs tells them apart.
namespace trunnion::diagnosis {
namespace {

const std::string kLocations =
    "[model]\nname = \"known\"\n[[effect]]\nid = \"location:A\"\n[[effect]]\nid = \"location:C\"\n";

std::string ball(const std::string& id, const std::string& place, double tool_z, const std::string& ambient) {
  return "[[run]]\nid = \"" + id +
         "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nu_random = "
         "0.6\nu_common = 0.3\ntool_z_mm = " +
         std::to_string(tool_z) + "\nT_ambient_degC = " + ambient +
         "\ngrid = { A_deg = [-20, 0, 25, 50, 80], C_deg = [0, 50, 100, 170, 240, 310] }\nball_mm = " +
         place + "\n";
}

struct TwoTools {
  Machine machine = test::shipped_machine("trunnion_offset");
  Dataset data;

  TwoTools(const std::string& first, const std::string& second, const std::string& truth) {
    data = test::measured(machine,
                          ball("b1", "[80, 0, 60]", -150, first) + ball("b2", "[0, 90, 120]", -220, second),
                          "[model]\nname = \"truth\"\n" + truth, 3);
  }
  // The second tool's point is `off` (mm) from where its file says: from what the readings are of.
  void displace(const Vec3& off) {
    const Observations o(machine, data);
    const MatrixXd& spindle = o.response(o.link_count() - 2);
    for (std::size_t i = 0; i < data.readings.size(); ++i)
      if (data.rows[data.readings[i].row].tool_mm.z() < -200.0)
        data.readings[i].value += spindle.row(static_cast<Eigen::Index>(i)).head<3>() * off;
  }
  Model known() const { return test::model_for(machine, data, kLocations); }
};

bool says_thermal(const Diagnosis& d) {
  return d.verdict == Verdict::named &&
         std::any_of(d.additions.begin(), d.additions.end(), [](const ModelEffect& effect) {
           return effect.effect->info().kind == EffectClass::thermal;
         });
}

// Each run at temperatures of its own, which hardly move in it.
const std::string kCool = "[[0, 19.7], [20, 19.75]]", kWarm = "[[0, 20.4], [20, 20.35]]";

// Before: `named: ambient_drift` or `thermal_location:A`.
TEST(LongToolConstants, OneToolThatIsWrongIsNoThermalEffect) {
  for (const Vec3& off : {Vec3(3e-3, 2e-3, 6e-3)}) {
    TwoTools shop(kCool, kWarm, "");
    shop.displace(off);
    const Diagnosis d = diagnose(shop.machine, shop.data, shop.known());
    EXPECT_FALSE(says_thermal(d)) << off.transpose() << ' ' << d.paragraph;
    EXPECT_NE(d.verdict, Verdict::nothing_to_find) << off.transpose();
    const auto steps = improve(shop.machine, shop.data, shop.known());
    for (const ModelEffect& effect : steps.back().model.effects)
      EXPECT_NE(effect.effect->info().kind, EffectClass::thermal) << effect.id() << ' ' << off.transpose();
  }
}

TEST(LongToolConstants, ADriftWithinTheRunsIsNamed) {
  const TwoTools shop(
      "[[0, 18], [10, 22], [20, 19]]", "[[0, 23], [10, 19], [20, 21]]",
      "[[effect]]\nid = \"ambient_drift\"\n[effect.parameters]\nX_um_per_K = 2\nY_um_per_K = -1\n"
      "Z_um_per_K = 3\ntau_s = 600\n");
  const Diagnosis d = diagnose(shop.machine, shop.data, shop.known());
  EXPECT_TRUE(says_thermal(d)) << text_of(d.verdict) << ' ' << d.paragraph;
}

}  // namespace
}  // namespace trunnion::diagnosis
