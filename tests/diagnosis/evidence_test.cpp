#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/effects/library.hpp"

#include "diagnosis/campaigns.hpp"
#include "diagnosis/search/search.hpp"

// What an effect's evidence costs, by closed forms, and what follows from it over a short travel.
namespace trunnion::diagnosis {
namespace {

Share seen_by(const VectorXd& columns, const VectorXd& along) {
  return {MatrixXd(columns.asDiagonal()), along};
}

// min over g of k ln(1 + g) + S/(1 + g) is k (1 + ln(S/k)).
TEST(Evidence, EquallySeenColumnsCostAsTheirNumberSays) {
  for (const double size : {5.0, 12.0, 40.0}) {
    const Share share = seen_by(VectorXd::Constant(3, 1e4), Eigen::Vector3d(size, -size, 0.0));
    EXPECT_NEAR(occam(share, VectorXd::Ones(3), 1.0), occam(2.0 * size * size, 3.0), 0.02) << size;
  }
}

TEST(Evidence, WhatIsHardlySeenCostsNothing) {
  const Share one = seen_by(VectorXd::Constant(1, 1e4), VectorXd::Constant(1, 30.0));
  const Share four = seen_by(Eigen::Vector4d(1e4, 10.0, 1.0, 0.1), Eigen::Vector4d(30.0, 0.0, 0.0, 0.0));
  EXPECT_NEAR(occam(four, VectorXd::Ones(4), 1.0), occam(one, VectorXd::Ones(1), 1.0), 0.01);
}

TEST(Evidence, NoiseAloneIsExplainedByAPriorOfNoWidth) {
  const Share share = seen_by(VectorXd::Constant(2, 1e3), Eigen::Vector2d(0.9, 0.5));
  EXPECT_NEAR(occam(share, VectorXd::Ones(2), 1.0), 0.81 + 0.25, 0.01);
}

// The same readings explained by a parameter of its usual size, and by one of 3000 times it: there the prior
// of the width is 4 ln w, and the least of ln(1 + g) + S/(1 + g) + 2 ln(g / (t^2 100)) is at g = S/3.
TEST(Evidence, ParametersFarFromUsualCostMore) {
  const double s = 900.0, t = 0.01;
  const auto cost = [&](double column) {
    return occam(seen_by(VectorXd::Constant(1, column), VectorXd::Constant(1, std::sqrt(s))),
                 VectorXd::Ones(1), 1.0);
  };
  EXPECT_NEAR(cost(t), std::log(s / 3.0) + 3.0 + 2.0 * std::log(s / 3.0 / (t * t * 100.0)), 0.02);
  EXPECT_NEAR(cost(1e4), std::log(s) + 1.0, 0.02);
}

TEST(Evidence, UnitsOfParametersAndNoiseDoNotMatter) {
  const Share share = seen_by(Eigen::Vector2d(50.0, 7.0), Eigen::Vector2d(20.0, -6.0));
  const Share scaled = {share.to_columns * Eigen::Vector2d(1e3, 1e-3).asDiagonal() * 2.0, share.along * 2.0};
  EXPECT_NEAR(occam(scaled, Eigen::Vector2d(1e-3, 1e3), 4.0), occam(share, VectorXd::Ones(2), 1.0), 1e-9);
}

struct ShortTravel : testing::TestWithParam<const char*> {};

// One ball over a few poses moves the linear axes by a tenth of their travel: there a straightness is a
// straight line, which a squareness, a tilt or another component is too. The truth must be among the sets.
TEST_P(ShortTravel, TheTruthIsAmongTheSets) {
  const std::string id = GetParam();
  const bool rotation = id[11] >= 'A' && id[11] <= 'C';
  const std::string unit = rotation ? "_urad" : "_um",
                    plan =
                        "[[run]]\nid = \"ball\"\nminutes = 15\nquantity = \"displacement\"\nn = [[1, 0, 0], "
                        "[0, 1, 0], [0, 0, 1]]\n"
                        "tool_z_mm = -150.0\nu_random = 0.5\nu_common = 0\nball_mm = [40, 20, 30]\n"
                        "grid = { A_deg = [0, 45, 90], C_deg = [0, 60, 120, 180, 240, 300] }\n";
  const std::string p = rotation ? "60" : "15", q = rotation ? "-45" : "-11";
  const std::string truth = "[model]\nname = \"truth\"\n[[effect]]\nid = \"" + id +
                            "\"\n[effect.parameters]\nP1" + unit + " = " + p + "\nP2" + unit + " = " + q +
                            "\nP3" + unit + " = " + q + "\nP4" + unit + " = " + p + "\n";
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Dataset data = test::measured(machine, plan, truth, 5);
  const Diagnosis d = diagnose(machine, data, test::model_for(machine, data, "[model]\nname = \"base\"\n"));
  std::string said(text_of(d.verdict));
  bool held = false;
  for (const auto& set : d.sets) {
    held = held || std::find(set.begin(), set.end(), id) != set.end();
    for (const auto& name : set) said += " " + name;
    said += " |";
  }
  EXPECT_TRUE(held) << said;
}

INSTANTIATE_TEST_SUITE_P(Components, ShortTravel,
                         testing::Values("component:EXX", "component:EYX", "component:EXY", "component:EXZ",
                                         "component:EZX", "component:ECX", "component:EYZ"),
                         [](const auto& tested) { return std::string(tested.param).substr(10); });

// EXC a hundred times as large as usual on one ball: chi-square of millions, of which single precision keeps
// six digits, beside effects that show nearly the same. EBC + EXX left -346 of 8.5e6 and were named.
struct LargeOnOneBall : testing::Test {
  Machine machine = test::shipped_machine("trunnion_offset");
  std::string base =
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:A\"\n[[effect]]\nid = \"location:C\"\n";
  Dataset data(std::uint64_t seed) const {
    return test::measured(
        machine,
        "[[run]]\nid = \"ball\"\nminutes = 15\nquantity = \"displacement\"\n"
        "n = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\ntool_z_mm = -150\nu_random = 0.6\n"
        "ball_mm = [105, -106, 60]\n"
        "grid = { A_deg = [-25, 20, 60, 105], C_deg = [0, 70, 111, 175, 230, 290] }\n",
        "[model]\nname = \"truth\"\n[[effect]]\nid = \"component:EXC\"\n[effect.parameters]\n"
        "cos1_um = 185\nsin1_um = 325\ncos2_um = 355\nsin2_um = -235\n",
        seed);
  }
};

TEST_F(LargeOnOneBall, WhatASetLeavesIsNoRounding) {
  const Dataset readings = data(1);
  const Observations o(machine, readings);
  const FitCore fitted = fit_core(o, test::model_for(machine, readings, base), {.robust = false});
  const Atoms atoms(o, fitted, effect_library(machine, readings.context));
  ASSERT_GT(fitted.chi2(), 1e6);
  const Atoms::Multiplicity multiplicity{std::vector<double>(atoms.library().size(), 1.0),
                                         static_cast<double>(atoms.library().size())};
  NoiseScale noise;
  noise.dof = fitted.dof();
  const Search search(atoms, multiplicity, noise, 0.01, 3);
  std::vector<Atom> components;
  for (const Atom& atom : atoms.all())
    if (atoms.effect(atom).info().id.starts_with("component:") && atom.rank() > 0) components.push_back(atom);
  for (std::size_t a = 0; a < components.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      // The same columns, as a least-squares problem in double precision.
      MatrixXd columns(fitted.white.size(), components[a].rank() + components[b].rank());
      columns << components[a].U().cast<double>(), components[b].U().cast<double>();
      const Eigen::JacobiSVD<MatrixXd> svd(columns, Eigen::ComputeThinU | Eigen::ComputeThinV);
      const double least = (fitted.white - columns * svd.solve(fitted.white)).squaredNorm();
      const double rss = search.evaluated({components[a], components[b]}).rss;
      EXPECT_GT(rss, least - 1.0) << atoms.effect(components[a]).info().id << " "
                                  << atoms.effect(components[b]).info().id;
    }
}

// Two components more in the model, all errors far from where the derivatives are taken: whole steps led
// away.
TEST_F(LargeOnOneBall, AFitWithMoreEffectsIsNoWorse) {
  const Dataset readings = data(1);
  const Observations o(machine, readings);
  const double without = fit_core(o, test::model_for(machine, readings, base), {.robust = false}).chi2();
  const std::vector<std::string> components = {"EXC", "EYC", "EZC", "EAC", "EBC", "ECC",
                                               "EXX", "EYY", "EZZ", "EXY", "EBX", "EZA"};
  double worst = 0.0;
  std::string where;
  for (std::size_t a = 0; a < components.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const std::string more = "[[effect]]\nid = \"component:" + components[a] +
                               "\"\n[[effect]]\nid = \"component:" + components[b] + "\"\n";
      const double with =
          fit_core(o, test::model_for(machine, readings, base + more), {.robust = false}).chi2();
      if (!(with / without <= worst)) worst = with / without, where = components[a] + " " + components[b];
    }
  EXPECT_LE(worst, 1.0 + 1e-6) << where;
}

// A guard only: with the rounding these three were named rightly, too (P-100-EXC-0004 of the benchmark was
// not).
TEST_F(LargeOnOneBall, TheTruthAloneIsNamed) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Dataset readings = data(seed);
    const Diagnosis d = diagnose(machine, readings, test::model_for(machine, readings, base));
    EXPECT_EQ(d.effects, std::vector<std::string>{"component:EXC"})
        << text_of(d.verdict) << " " << d.paragraph;
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
