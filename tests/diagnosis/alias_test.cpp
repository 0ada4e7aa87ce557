#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/fit/fit_core.hpp"

// What positions at equal steps cannot tell from a smoother wave.
namespace trunnion::diagnosis {
namespace {

const std::string kNoEffects = "[model]\nname = \"none\"\n";

Dataset lasers(const Machine& machine, int points, std::uint64_t seed, const std::string& more = "") {
  std::string plan;
  for (const char* id : {"one", "two"})
    plan += test::sweep_run(id, "X", -200, 200, points, "[1, 0, 0]", "displacement", {});
  return test::measured(machine, plan + more, kNoEffects, seed);
}

std::vector<double> searched_periods(const Machine& machine, const Dataset& data) {
  const Observations o(machine, data);
  std::vector<double> out;
  for (const EffectFamily& family : effect_library(machine, data.context))
    if (family.id() == "periodic:X")
      for (const auto& shape : shape_grid(o, *family.variants.front())) {
        const auto& known = family.info().parameters.back().candidates;
        if (std::find(known.begin(), known.end(), shape.front()) == known.end()) out.push_back(shape.front());
      }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Aliases, OfPeriodsThatLookAlikeOnlyTheSmoothestIsSearched) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const auto at_5_mm = searched_periods(machine, lasers(machine, 81, 1));
  ASSERT_FALSE(at_5_mm.empty());
  EXPECT_GT(at_5_mm.front(), 9.99);
  EXPECT_GT(at_5_mm.back(), 40.0);
  EXPECT_GT(searched_periods(machine, lasers(machine, 201, 1)).front(), 3.99);
  // Ball runs elsewhere on X, which make the positions of all runs together look fine.
  const std::string ball =
      "[[run]]\nid = \"ball\"\nminutes = 20\nquantity = \"displacement\"\nn = [1, 0, 0]\nu_random = 5\n"
      "u_common = 0.3\ntool_z_mm = -150\ngrid = { A_deg = [0, 20], C_deg = [0, 50, 100, 170, 240, 310] }\n"
      "ball_mm = [80, 0, 60]\n";
  EXPECT_GT(searched_periods(machine, lasers(machine, 81, 1, ball)).front(), 9.99);
  // Steps that are no multiples of one another hide nothing.
  const std::string fine = test::sweep_run("fine", "X", -20, 20, 93, "[1, 0, 0]", "displacement", {});
  EXPECT_LT(searched_periods(machine, lasers(machine, 81, 1, fine)).front(), 2.0);
}

// A kink of the guide, read every 5 mm: `component:EXX + periodic:X` with a period of 5.14 mm was named,
// which is 184 mm as these positions see it.
TEST(Aliases, AKinkOnAGridIsNoPeriod) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data = lasers(machine, 81, 1);
  for (Reading& r : data.readings) r.value += 8e-5 * std::abs(data.track.state(r.row).q[0] - 30.0);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kNoEffects));
  for (const auto& set : d.sets) EXPECT_EQ(std::find(set.begin(), set.end(), "periodic:X"), set.end());
  EXPECT_FALSE(d.verdict == Verdict::named) << d.paragraph;
}

// A laser at steps of 20 mm, and a ball at many places of X: a wave that these see as a smooth error.
class PeriodOnAGrid : public testing::Test {
 protected:
  Dataset measured(int points, const std::string& truth = kNoEffects) const {
    const std::string ball =
        "[[run]]\nid = \"ball\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, "
        "0, 1]]\n"
        "u_random = 0.8\nu_common = 0.3\ntool_z_mm = -150\ngrid = { A_deg = [-20, 0, 30, 60], C_deg = [0, "
        "50, 100, "
        "170, 240, 310] }\nball_mm = [80, 0, 60]\n";
    const std::string laser =
        test::sweep_run("laser", "X", -250, 250, points, "[1, 0, 0]", "displacement", {});
    return test::measured(machine_, laser + ball, truth, 1);
  }
  const Machine machine_ = test::shipped_machine("trunnion_offset");
  const std::string known_ = kNoEffects + "[[effect]]\nid = \"component:EXX\"\n";
};

// 8 um tanh(X / 40 mm): "p = 2.53 +/- 0.0007 mm" was said and added, which made what lies between worse.
TEST_F(PeriodOnAGrid, IsOpenWhereASmoothErrorIsSeenThroughIt) {
  Dataset data = measured(26);
  const Observations o(machine_, data);
  for (Eigen::Index i = 0; i < o.size(); ++i)
    data.readings[static_cast<std::size_t>(i)].value +=
        o.response(0)(i, 0) * 8e-3 * std::tanh(o.state(i).q[0] / 40.0);
  const auto steps = improve(machine_, data, test::model_for(machine_, data, known_));
  for (const ImproveStep& step : steps)
    for (const ModelEffect& effect : step.model.effects)
      EXPECT_NE(effect.id(), "periodic:X") << step.diagnosis.paragraph;
  EXPECT_NE(steps.back().diagnosis.verdict, Verdict::named) << steps.back().diagnosis.paragraph;
}

TEST_F(PeriodOnAGrid, SaysWhichOthersDoTheSame) {
  const std::string truth =
      kNoEffects + "[[effect]]\nid = \"periodic:X\"\n[effect.parameters]\nsin_um = 3\np_mm = 27.3\n";
  const std::string laser = test::sweep_run("laser", "X", -250, 250, 51, "[1, 0, 0]", "displacement", {});
  const Dataset data = test::measured(machine_, laser, truth, 1);  // every 10 mm
  const Diagnosis d = diagnose(machine_, data, test::model_for(machine_, data, kNoEffects));
  ASSERT_EQ(d.effects, std::vector<std::string>{"periodic:X"}) << d.paragraph;
  EXPECT_EQ(d.verdict, Verdict::named_but_incomplete) << d.paragraph;
  const RankedParameter& p = d.ranking.front().parameters.back();
  EXPECT_FALSE(p.sigma);
  for (const double k : {1.0, 2.0, 3.0})
    for (const double sense : {1.0, -1.0}) {
      const double alias = 1.0 / (k / 10.0 + sense / 27.3);
      const auto same = [&](double other) { return std::abs(1.0 / other - 1.0 / alias) < 1e-3; };
      EXPECT_TRUE(same(p.value) || std::any_of(p.also.begin(), p.also.end(), same))
          << alias << ' ' << d.paragraph;
    }
  EXPECT_NE(d.paragraph.find("Which period it has is not known"), std::string::npos) << d.paragraph;
  ASSERT_TRUE(d.next);
  EXPECT_LT(d.next->wrong_after, 0.01) << d.next->why;
  EXPECT_EQ(improve(machine_, data, test::model_for(machine_, data, kNoEffects)).size(), 1u);
  // A second laser at fine steps decides it.
  const std::string fine = test::sweep_run("fine", "X", -26, 26, 105, "[1, 0, 0]", "displacement", {});
  const Dataset both = test::measured(machine_, laser + fine, truth, 1);
  const Diagnosis sure = diagnose(machine_, both, test::model_for(machine_, both, kNoEffects));
  EXPECT_FALSE(sure.number_is_open()) << sure.paragraph;
  EXPECT_NEAR(sure.ranking.front().parameters.back().value, 27.3, 0.2);
}

class WormOnAGrid : public testing::Test {
 protected:
  static std::string worm(double n) {
    return "[model]\nname = \"truth\"\n[[effect]]\nid = \"worm:A\"\n[effect.parameters]\nsin_urad = 14\n"
           "cos_urad = -9\nn = " +
           std::to_string(static_cast<int>(n)) + "\n";
  }
  // Every 10 deg, and a finer run.
  static std::string index(int points, double to_deg) {
    return test::sweep_run("index", "A", -30, to_deg, points, "[[1, 0, 0]]", "rotation", {});
  }
  static const RankedParameter& number(const Diagnosis& d) { return d.ranking.front().parameters.back(); }

  Machine machine_ = test::thermal_machine("trunnion_offset");
};

// 60 teeth, read every 10 deg, are 12, 24, 48 and others: `named` with n = 12 was said.
TEST_F(WormOnAGrid, IsOpenInItsNumber) {
  const Dataset data = test::measured(machine_, index(15, 110), worm(60), 1);
  const auto steps = improve(machine_, data, test::model_for(machine_, data, kNoEffects));
  EXPECT_EQ(steps.size(), 1u);  // a wrong number makes what lies between worse
  const Diagnosis& d = steps.front().diagnosis;
  EXPECT_EQ(d.verdict, Verdict::named_but_incomplete) << d.paragraph;
  ASSERT_EQ(d.effects, std::vector<std::string>{"worm:A"}) << d.paragraph;
  const auto& also = number(d).also;
  EXPECT_NE(std::find(also.begin(), also.end(), 60.0), also.end()) << d.paragraph;
  EXPECT_NE(d.paragraph.find("Which n it has is not known"), std::string::npos) << d.paragraph;
  ASSERT_TRUE(d.next);
  EXPECT_EQ(d.next->runs.front().path.index(), 1u);  // a sweep
  EXPECT_LT(d.next->wrong_after, 0.05) << d.next->why;
}

TEST_F(WormOnAGrid, IsKnownWherePositionsAreFineEnough) {
  const Dataset data = test::measured(machine_, index(141, 110), worm(60), 1);
  const Diagnosis d = diagnose(machine_, data, test::model_for(machine_, data, kNoEffects));
  EXPECT_EQ(d.verdict, Verdict::named) << d.paragraph;
  EXPECT_EQ(number(d).value, 60.0);
  EXPECT_TRUE(number(d).also.empty());
}

// A reading that is high at every other target has a period of two steps, and half of its phase is not to be
// seen: an amplitude of 30 +- 1 636 169 um was said.
TEST(Aliases, AWaveOfTwoStepsHasAnAmplitude) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data = lasers(machine, 201, 1);
  for (Reading& r : data.readings) r.value += 3e-3 * std::cos(0.5 * kPi * data.track.state(r.row).q[0]);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kNoEffects));
  ASSERT_EQ(d.effects, std::vector<std::string>{"periodic:X"}) << d.paragraph;
  const ModelEffect& wave = d.additions.front();
  EXPECT_NEAR(wave.parameters[2].value, 4.0, 0.02);
  EXPECT_NEAR(std::hypot(wave.parameters[0].value, wave.parameters[1].value), 3e-3, 3e-4);
  EXPECT_LT(*wave.parameters[0].sigma, 5e-3);
}

// At every 60 degrees sin 4C is -sin 2C: what is named may be another wave, and between the places it is
// worse.
TEST(LongAliases, WavesOfARotaryAxisAtFewPlacesAreSaid) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const auto paragraph = [&](const std::string& c) {
    std::string plan;
    for (const auto& [id, ball] : {std::pair{"one", "[80, 0, 60]"}, std::pair{"two", "[0, 90, 120]"}})
      plan += std::string("[[run]]\nid = \"") + id +
              "\"\nminutes = 20\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
              "u_random = 0.8\nu_common = 0.3\ntool_z_mm = -150\ngrid = { A_deg = [-20, 0, 25, 50, 80], "
              "C_deg = " +
              c + " }\nball_mm = " + ball + "\n";
    const Dataset data = test::measured(
        machine, plan,
        "[model]\nname = \"t\"\n[[effect]]\nid = \"component:ECC\"\n[effect.parameters]\nsin2_urad = 60\n",
        1);
    const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, kNoEffects), {.plan = false});
    EXPECT_EQ(d.effects, std::vector<std::string>{"component:ECC"}) << d.paragraph;
    return d.paragraph;
  };
  EXPECT_NE(paragraph("[0, 60, 120, 180, 240, 300]")
                .find("C stood at steps of 60 deg only, at which an error of 4 or 5 waves a turn looks like "
                      "component:ECC: read C between them, too"),
            std::string::npos);
  EXPECT_EQ(paragraph("[0, 50, 100, 170, 240, 310]").find("stood at steps"), std::string::npos);
}

}  // namespace
}  // namespace trunnion::diagnosis
