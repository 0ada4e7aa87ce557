#include "trunnion/effects/table.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <unsupported/Eigen/Splines>

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

using testing::HasSubstr;
using Function = std::function<double(double, double)>;

Grid sampled(std::vector<double> u, std::vector<double> v, const Function& f) {
  Grid g{std::move(u), std::move(v), {}};
  for (const double x : g.u) {
    if (g.v.empty()) g.values.push_back(f(x, 0.0));
    for (const double y : g.v) g.values.push_back(f(x, y));
  }
  return g;
}
std::shared_ptr<const Interpolant> made(const Grid& g, const InterpolationOptions& o) {
  const auto out = make_interpolant(g, o);
  EXPECT_TRUE(out) << (out ? "" : out.error().message);
  return out.value_or(nullptr);
}
const std::vector<double> kU = {-300, -220, -180, -50, 0, 90, 140, 260, 300};
const std::vector<double> kV = {-200, -120, -30, 40, 100, 210};

TEST(Interpolant, AllModelsPassThroughTheNodes) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 0.01);
  const Grid two = sampled(kU, kV, [&](double, double) { return normal(random); });
  const Grid one = sampled(kU, {}, [&](double, double) { return normal(random); });
  std::vector<double> weights(two.values.size());
  for (double& w : weights) w = std::uniform_real_distribution<double>(0.3, 3.0)(random);
  for (const auto& o :
       {InterpolationOptions{.method = Interpolation::bilinear},
        InterpolationOptions{.method = Interpolation::nurbs},
        InterpolationOptions{.method = Interpolation::nurbs, .degree = {2, 5}, .weights = weights},
        InterpolationOptions{.method = Interpolation::spline}}) {
    const auto f = made(two, o);
    for (std::size_t i = 0; i < kU.size(); ++i) {
      for (std::size_t j = 0; j < kV.size(); ++j) EXPECT_NEAR(f->value(kU[i], kV[j]), two.at(i, j), 1e-14);
    }
  }
  for (const auto method : {Interpolation::linear, Interpolation::nurbs, Interpolation::spline}) {
    const auto f = made(one, {.method = method});
    for (std::size_t i = 0; i < kU.size(); ++i) EXPECT_NEAR(f->value(kU[i], 12.0), one.at(i), 1e-14);
  }
}

TEST(Interpolant, EndsAreHeldOutside) {
  const Grid g = sampled(kU, kV, [](double x, double y) { return std::sin(x / 90.0) + y * 1e-3; });
  for (const auto method : {Interpolation::bilinear, Interpolation::nurbs, Interpolation::spline}) {
    const auto f = made(g, {.method = method});
    EXPECT_NEAR(f->value(900, 17), f->value(300, 17), 1e-15);
    EXPECT_NEAR(f->value(-900, -900), g.at(0, 0), 1e-14);
  }
}

TEST(Interpolant, BilinearIsExactOnItsOwnKind) {
  const Function f = [](double x, double y) { return 2.0 + 3e-3 * x - 1e-3 * y + 2e-5 * x * y; };
  const auto b = made(sampled(kU, kV, f), {.method = Interpolation::bilinear});
  for (double x = -300; x <= 300; x += 37) {
    for (double y = -200; y <= 210; y += 29) EXPECT_NEAR(b->value(x, y), f(x, y), 1e-12);
  }
}

TEST(Interpolant, NurbsReproducePolynomialsOfTheirDegree) {
  for (const int p : {1, 2, 3, 4, 5}) {
    const Function f = [p](double x, double y) {
      return std::pow(x / 300.0, p) - 0.5 * std::pow(y / 200.0, p) * (x / 300.0) + 0.1;
    };
    const auto s = made(sampled(kU, kV, f), {.method = Interpolation::nurbs, .degree = {p, p}});
    for (double x = -300; x <= 300; x += 23) {
      for (double y = -200; y <= 210; y += 31) EXPECT_NEAR(s->value(x, y), f(x, y), 1e-12) << p;
    }
  }
}

// Definition of the B-spline basis by recursion (Cox, de Boor), slow and plain: the second implementation.
double naive_basis(std::size_t i, int p, double u, const std::vector<double>& knots) {
  if (p == 0) {
    const bool last = u >= knots.back() && knots[i + 1] >= knots.back() && knots[i] < knots[i + 1];
    return (knots[i] <= u && u < knots[i + 1]) || last ? 1.0 : 0.0;
  }
  const auto P = static_cast<std::size_t>(p);
  double out = 0.0;
  if (knots[i + P] > knots[i])
    out += (u - knots[i]) / (knots[i + P] - knots[i]) * naive_basis(i, p - 1, u, knots);
  if (knots[i + P + 1] > knots[i + 1]) {
    out += (knots[i + P + 1] - u) / (knots[i + P + 1] - knots[i + 1]) * naive_basis(i + 1, p - 1, u, knots);
  }
  return out;
}
std::vector<double> averaged_knots(const std::vector<double>& nodes, int p) {
  std::vector<double> t;
  for (const double x : nodes) t.push_back((x - nodes.front()) / (nodes.back() - nodes.front()));
  std::vector<double> out(static_cast<std::size_t>(p) + 1, 0.0);
  for (std::size_t j = 1; j + static_cast<std::size_t>(p) < t.size(); ++j) {
    double sum = 0.0;
    for (std::size_t i = j; i < j + static_cast<std::size_t>(p); ++i) sum += t[i];
    out.push_back(sum / p);
  }
  out.insert(out.end(), static_cast<std::size_t>(p) + 1, 1.0);
  return out;
}

// Eigen's splines share no code with ours: knots by averaging, the basis by Cox and de Boor.
TEST(Interpolant, CurvesOfOneArgumentAreEigensSplines) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0.0, 0.01);
  using Curve = Eigen::Spline<double, 1>;
  for (const int degree : {1, 2, 3, 4, 5}) {
    const Grid g = sampled(kU, {}, [&](double, double) { return normal(random); });
    const auto ours = made(g, {.method = Interpolation::nurbs, .degree = {degree, degree}});
    const auto n = static_cast<Eigen::Index>(kU.size());
    Eigen::RowVectorXd points(n);
    Eigen::RowVectorXd places(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      points[i] = g.values[static_cast<std::size_t>(i)];
      places[i] = (kU[static_cast<std::size_t>(i)] - kU.front()) / (kU.back() - kU.front());
    }
    const Curve theirs = Eigen::SplineFitting<Curve>::Interpolate(points, degree, places);
    for (int k = 0; k <= 1000; ++k) {
      const double t = k / 1000.0;
      EXPECT_NEAR(ours->value(kU.front() + t * (kU.back() - kU.front()), 0.0), theirs(t)(0), 1e-14)
          << "degree " << degree << " at " << t;
    }
  }
}

TEST(Interpolant, NurbsEqualTheirDefinition) {
  // One dense system for all control values of the rational surface, basis by recursion.
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal(0.0, 0.01);
  const Grid g = sampled(kU, kV, [&](double, double) { return normal(random); });
  InterpolationOptions o{.method = Interpolation::nurbs, .degree = {3, 2}};
  for (std::size_t i = 0; i < g.values.size(); ++i)
    o.weights.push_back(std::uniform_real_distribution<double>(0.5, 2.0)(random));
  const auto surface = made(g, o);
  const auto U = averaged_knots(g.u, 3), V = averaged_knots(g.v, 2);
  const auto place = [](const std::vector<double>& n, double x) {
    return (x - n.front()) / (n.back() - n.front());
  };
  const auto rational_row = [&](double x, double y) {
    Eigen::RowVectorXd row(static_cast<Eigen::Index>(g.values.size()));
    for (std::size_t k = 0; k < g.u.size(); ++k) {
      for (std::size_t l = 0; l < g.v.size(); ++l) {
        row(static_cast<Eigen::Index>(k * g.v.size() + l)) = naive_basis(k, 3, place(g.u, x), U) *
                                                             naive_basis(l, 2, place(g.v, y), V) *
                                                             o.weights[k * g.v.size() + l];
      }
    }
    return Eigen::RowVectorXd(row / row.sum());
  };
  const auto n = static_cast<Eigen::Index>(g.values.size());
  Eigen::MatrixXd A(n, n);
  for (std::size_t i = 0; i < g.u.size(); ++i) {
    for (std::size_t j = 0; j < g.v.size(); ++j)
      A.row(static_cast<Eigen::Index>(i * g.v.size() + j)) = rational_row(g.u[i], g.v[j]);
  }
  const Eigen::VectorXd control = A.fullPivLu().solve(Eigen::Map<const Eigen::VectorXd>(g.values.data(), n));
  for (double x = -300; x <= 300; x += 41) {
    for (double y = -200; y <= 210; y += 37)
      EXPECT_NEAR(surface->value(x, y), rational_row(x, y).dot(control), 1e-12);
  }
}

TEST(Interpolant, SplineIsNaturalAndSmooth) {
  // f'' = 0 at both ends, f'' continuous inside (finite differences across a node).
  const Grid g = sampled(kU, {}, [](double x, double) { return std::sin(x / 70.0); });
  const auto s = made(g, {.method = Interpolation::spline});
  const double h = 0.01;
  const auto second = [&](double x) {
    return (s->value(x + h, 0) - 2.0 * s->value(x, 0) + s->value(x - h, 0)) / (h * h);
  };
  EXPECT_NEAR(second(-300 + h), 0.0, 1e-6);
  EXPECT_NEAR(second(300 - h), 0.0, 1e-6);
  for (const double node : {-220.0, -50.0, 90.0})
    EXPECT_NEAR(second(node - 2 * h), second(node + 2 * h), 1e-6);
  // Among interpolants the natural spline has the least integral of f''^2: less than the NURBS through the
  // same nodes.
  const auto n = made(g, {.method = Interpolation::nurbs});
  const auto roughness = [&](const Interpolant& f) {
    double sum = 0.0;
    for (double x = -299.5; x < 299.6; x += 0.5) {
      const double d = (f.value(x + 0.25, 0) - 2.0 * f.value(x, 0) + f.value(x - 0.25, 0)) / 0.0625;
      sum += d * d;
    }
    return sum;
  };
  EXPECT_LT(roughness(*s), roughness(*n));
}

TEST(Interpolant, SmoothingGoesFromTheNodesToTheLeastSquaresLine) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  const Grid g = sampled(kU, {}, [&](double x, double) { return 0.01 * x + normal(random); });
  Eigen::MatrixXd A(static_cast<Eigen::Index>(kU.size()), 2);
  for (std::size_t i = 0; i < kU.size(); ++i) A.row(static_cast<Eigen::Index>(i)) << 1.0, kU[i];
  const Eigen::Vector2d line =
      A.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(g.values.data(), A.rows()));
  const auto stiff = made(g, {.method = Interpolation::spline, .smoothing = 1e9});
  for (const double x : {-250.0, 10.0, 222.0}) EXPECT_NEAR(stiff->value(x, 0), line(0) + line(1) * x, 1e-5);
  // In between: the minimiser, checked against small changes of the smoothed values (sum of squares + lambda
  // * integral g''^2).
  const double lambda = 2.0, spacing = 600.0 / 8.0;
  const auto cost = [&](const std::vector<double>& values) {
    const auto f = made({kU, {}, values}, {.method = Interpolation::spline});
    double sum = 0.0;
    for (std::size_t i = 0; i < kU.size(); ++i) sum += std::pow(values[i] - g.values[i], 2);
    const double h = 0.05;
    for (double x = -300 + 3 * h; x < 300 - 2 * h; x += 4 * h) {
      const double d = (f->value(x + h, 0) - 2.0 * f->value(x, 0) + f->value(x - h, 0)) / (h * h);
      sum += lambda * std::pow(spacing, 3) * d * d * 4 * h;
    }
    return sum;
  };
  const auto smooth = made(g, {.method = Interpolation::spline, .smoothing = lambda});
  std::vector<double> best;
  for (const double x : kU) best.push_back(smooth->value(x, 0));
  const double least = cost(best);
  for (std::size_t i = 0; i < kU.size(); ++i) {
    for (const double step : {-0.05, 0.05}) {
      auto other = best;
      other[i] += step;
      EXPECT_GT(cost(other), least);
    }
  }
}

// Motions of all lengths, beyond the grid too: the value never leaves its straight course by more.
TEST(Interpolant, BendBoundsTheCourse) {
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal(0.0, 0.01);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const Grid two = sampled(kU, kV, [&](double, double) { return normal(random); });
  const Grid one = sampled(kU, {}, [&](double, double) { return normal(random); });
  int bounded = 0;
  for (const auto& f :
       {made(one, {.method = Interpolation::linear}), made(one, {.method = Interpolation::spline}),
        made(two, {.method = Interpolation::bilinear})}) {
    for (int i = 0; i < 2000; ++i) {
      const double size = std::pow(10.0, uniform(-1.0, 2.5));
      const double u0 = uniform(-350.0, 350.0);
      const double v0 = uniform(-250.0, 250.0);
      const double u1 = u0 + size * uniform(-1.0, 1.0);
      const double v1 = v0 + size * uniform(-1.0, 1.0);
      const auto bend = f->bend(u0, v0, u1, v1);
      if (!bend) continue;
      ++bounded;
      for (int k = 0; k <= 64; ++k) {
        const double t = k / 64.0;
        const double off = std::abs(f->value(u0 + t * (u1 - u0), v0 + t * (v1 - v0)) -
                                    ((1.0 - t) * f->value(u0, v0) + t * f->value(u1, v1)));
        EXPECT_LE(off, *bend + 1e-15);
      }
    }
  }
  EXPECT_GT(bounded, 5000);
  // Nothing is claimed where nothing is proved.
  EXPECT_FALSE(made(one, {.method = Interpolation::nurbs})->bend(0.0, 0.0, 10.0, 0.0));
  EXPECT_FALSE(made(two, {.method = Interpolation::spline})->bend(0.0, 0.0, 10.0, 0.0));
}

TEST(Interpolant, RefusesWhatItCannotDo) {
  const Grid g = sampled(kU, kV, [](double, double) { return 0.0; });
  EXPECT_THAT(make_interpolant(g, {.method = Interpolation::linear}).error().message,
              HasSubstr("use bilinear"));
  EXPECT_THAT(make_interpolant({{0}, {}, {1}}, {}).error().message, HasSubstr("2 nodes or more"));
  EXPECT_THAT(make_interpolant({{0, 2, 1}, {}, {1, 2, 3}}, {}).error().message,
              HasSubstr("2 comes before 1"));
  EXPECT_THAT(make_interpolant({{0, 1}, {}, {1, 2, 3}}, {}).error().message,
              HasSubstr("2 x 1 nodes has 3 values"));
  EXPECT_THAT(make_interpolant(g, {.method = Interpolation::nurbs, .weights = {1.0}}).error().message,
              HasSubstr("1 weights for 54 nodes"));
}

class TableFile : public testing::Test {
 protected:
  std::string error_of(const std::string& text) {
    Diagnostics d;
    EXPECT_FALSE(parse_error_table(text, "t.csv", machine_, d));
    return d.first_error().text();
  }
  Machine machine_ = test::effect_machine("trunnion_offset");
};

TEST_F(TableFile, TakesColumnsInAnyMixAndRowsInAnyOrder) {
  Diagnostics d;
  const auto t =
      parse_error_table("# note\nEAC_urad,C_deg,EZC_um,A_deg\n1,0,10,30\n2,90,20,30\n3,0,30,60\n4,90,40,60\n",
                        "t.csv", machine_, d);
  ASSERT_TRUE(t);
  EXPECT_EQ(t->arguments, (std::vector<std::string>{"C", "A"}));
  const Grid g = t->grid("EZC");
  EXPECT_NEAR(g.u[1], kPi / 2, 1e-15);
  EXPECT_NEAR(g.at(1, 0), 0.020, 1e-15);
  EXPECT_NEAR(t->grid("EAC").at(0, 1), 3e-6, 1e-18);
  const auto back = parse_error_table(error_table_text(*t, machine_), "t.csv", machine_, d);
  ASSERT_TRUE(back);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(back->components[1].values[i], t->components[1].values[i], 1e-18);
  EXPECT_EQ(error_table_text(*back, machine_), error_table_text(*t, machine_));
}

TEST_F(TableFile, SaysWhereItIsWrong) {
  EXPECT_EQ(error_of("X_mm,EXX_um\n0,1\n0,2\n"),
            "t.csv:3:1: error: node X = 0 stands twice; first in line 2");
  EXPECT_THAT(error_of("X_mm,Y_mm,EXX_um\n0,0,1\n0,1,1\n1,0,1\n"),
              HasSubstr("t.csv:1:1: error: the grid of 2 x 2 nodes lacks 1; the first is X = 1, Y = 1"));
  EXPECT_THAT(error_of("X_deg,EXX_um\n0,1\n1,2\n"),
              HasSubstr("t.csv:1:1: error: argument column 1 must be 'X_mm'"));
  EXPECT_THAT(error_of("X_mm,EXX_urad\n0,1\n1,2\n"),
              HasSubstr("t.csv:1:2: error: component column 2 must end in _um"));
  EXPECT_THAT(error_of("X_mm,EXX\n0,1\n1,2\n"), HasSubstr("must end in _um"));
  EXPECT_THAT(error_of("X_mm,foo\n0,1\n1,2\n"), HasSubstr("t.csv:1:2: error: column 2 is neither"));
  EXPECT_THAT(error_of("X_mm,EXX_um\n0,one\n1,2\n"), HasSubstr("t.csv:2:2: error: 'one'"));
  EXPECT_THAT(error_of("EXX_um\n1\n2\n"), HasSubstr("one or two argument columns"));
}

}  // namespace
}  // namespace trunnion
