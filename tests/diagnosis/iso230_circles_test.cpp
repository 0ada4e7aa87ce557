#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_2.hpp"
#include "trunnion/diagnosis/iso230_4.hpp"
#include "trunnion/diagnosis/iso230_7.hpp"

namespace trunnion::iso230 {
namespace {

std::vector<RadialPoint> sampled(int count, const std::function<double(double)>& r) {
  std::vector<RadialPoint> out;
  for (int i = 0; i < count; ++i) {
    const double t = kTwoPi * i / count;
    out.push_back({t, r(t)});
  }
  return out;
}

TEST(CircleFit, EveryCentreTakesOutAnEccentricity) {
  const auto points = sampled(360, [](double t) { return 0.02 + 0.005 * std::cos(t) - 0.003 * std::sin(t); });
  for (const Centre centre : {Centre::least_squares, Centre::minimum_zone, Centre::maximum_inscribed,
                              Centre::minimum_circumscribed}) {
    const CircleFit fit = fit_circle(points, centre);
    EXPECT_NEAR(fit.x, 0.005, 1e-12) << text_of(centre);
    EXPECT_NEAR(fit.y, -0.003, 1e-12) << text_of(centre);
    EXPECT_NEAR(fit.radius, 0.02, 1e-12) << text_of(centre);
    EXPECT_NEAR(fit.width, 0.0, 1e-12) << text_of(centre);
  }
  EXPECT_NEAR(fit_circle(points, Centre::polar_chart).width, 2.0 * std::hypot(0.005, 0.003), 1e-6);
}

// One bump of height h over a quarter turn apart from a perfect circle: the circles that touch from inside
// keep the centre.
TEST(CircleFit, InscribedAndCircumscribedDifferWhereTheyMust) {
  const auto points = sampled(4, [](double t) { return t < 0.1 ? 0.004 : 0.0; });
  // Four points at 0, 90, 180, 270 degrees: r = h, 0, 0, 0.
  // MCC: the outer circle through 0, and 90 or 270, or 180 degrees: R = h / 2 at x = h / 2 holds all: r - x
  // cos - R = 0, -h/2, 0, -h/2.
  const CircleFit outer = fit_circle(points, Centre::minimum_circumscribed);
  EXPECT_NEAR(outer.x, 0.002, 1e-12);
  EXPECT_NEAR(outer.radius, 0.002, 1e-12);
  // MIC: inner circle R = 0 through 90 and 270 degrees (y = 0).
  EXPECT_NEAR(fit_circle(points, Centre::maximum_inscribed).radius, 0.0, 1e-12);
  // MZC: a cos 2t pattern of amplitude h / 4: width h / 2; no less is possible (Chebyshev alternation at all
  // four points).
  EXPECT_NEAR(fit_circle(points, Centre::minimum_zone).width, 0.002, 1e-12);
}

TEST(CircleFit, NoOtherCentreHasANarrowerZone) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<RadialPoint> points;
    const double arc = trial % 4 == 3 ? 2.5 : kTwoPi;  // arcs too
    points.reserve(100);
    for (int i = 0; i < 100; ++i) points.push_back({arc * i / 100.0, noise(random)});
    const CircleFit zone = fit_circle(points, Centre::minimum_zone);
    for (int k = 0; k < 300; ++k) {
      const double x = zone.x + 0.3 * noise(random), y = zone.y + 0.3 * noise(random);
      double low = 1e9, high = -1e9;
      for (const RadialPoint& p : points) {
        const double r = p.radial_mm - x * std::cos(p.angle_rad) - y * std::sin(p.angle_rad);
        low = std::min(low, r);
        high = std::max(high, r);
      }
      ASSERT_GE(high - low, zone.width - 1e-9);
    }
  }
}

Readings circle(double radius, double centre_x, const std::function<Vec3(const Vec3&, int)>& deviation,
                int points = 180) {
  Readings out{.file = "circle.csv", .rows = {}};
  for (const int sense : {1, -1})
    for (int i = 0; i < points; ++i) {
      const double t = sense * kTwoPi * i / points;
      Reading r;
      r.run = sense > 0 ? "ccw" : "cw";
      r.n = Vec3(std::cos(t), std::sin(t), 0.0);
      r.position[0] = centre_x + radius * r.n.x();
      r.position[1] = radius * r.n.y();
      r.position[2] = 12.0;
      r.deviation = r.n.dot(deviation(Vec3(r.position[0], r.position[1], 12.0), sense));
      out.rows.push_back(r);
    }
  return out;
}

TEST(Iso2304, ScaleAndSquarenessShowAsTheyShould) {
  // X 30 um/m long, Y 10 um/m short; the angle between +X and +Y opened by 40 urad: a point at y moves by
  // -40e-6 y in X.
  const auto readings = circle(100.0, 0.0, [](const Vec3& p, int) {
    return Vec3(30e-6 * p.x() - 40e-6 * p.y(), -10e-6 * p.y(), 0.0);
  });
  const auto paths = circular_paths(readings);
  ASSERT_TRUE(paths.has_value()) << paths.error().text();
  ASSERT_EQ(paths->size(), 2u);
  const auto tests = evaluate_circles(*paths);
  ASSERT_EQ(tests->size(), 1u);
  const CircularTest& test = tests->front();
  EXPECT_EQ(test.plane, "XY");
  EXPECT_NEAR(test.radius_mm, 100.0, 1e-9);
  EXPECT_NEAR(test.scale_mismatch, 40e-6 * 100.0, 1e-12);
  EXPECT_NEAR(test.opening_rad, 40e-6, 1e-14);
  EXPECT_NEAR(*test.D, 0.5 * (30e-6 - 10e-6) * 100.0, 1e-12);  // mean scale
  const double amplitude = 0.5 * std::hypot(40e-6 * 100.0, 40e-6 * 100.0);
  EXPECT_NEAR(test.counter_clockwise->G, 2.0 * amplitude, 1e-6);  // an ellipse: both circles touch twice
  EXPECT_NEAR(*test.G_b, 2.0 * amplitude, 1e-6);
  EXPECT_NEAR(test.clockwise->F_max, *test.D + amplitude, 1e-6);
}

TEST(Iso2304, BacklashOpensTheTwoWays) {
  // 8 um lost motion of X: the carriage lags by 4 um behind its own sense, which changes at 0 and 180
  // degrees.
  const auto readings = circle(50.0, 20.0, [](const Vec3& p, int sense) {
    const double vx = -sense * p.y();
    return Vec3(vx > 1e-9 ? -0.004 : vx < -1e-9 ? 0.004 : 0.0, 0.0, 0.0);
  });
  const auto tests = evaluate_circles(*circular_paths(readings));
  const CircularTest& test = tests->front();
  EXPECT_GT(*test.G_b, 1.8 * 0.004);
  EXPECT_NEAR(test.clockwise->G, test.counter_clockwise->G, 1e-9);
}

// Each cause alone, given as what it does to X and Y, is named with its size and has the whole share;
// together each keeps its size, and their shares are what is left after the part of noise.
TEST(Iso2304, CausesAreToldApartWithTheirSizes) {
  using Kind = CircleCause::Kind;
  const double radius = 50.0;
  struct Case {
    Kind kind;
    double size_mm;
    std::function<Vec3(const Vec3&, int)> deviation;
  };
  const auto step = [](double v, double size) { return v > 1e-9 ? size : v < -1e-9 ? -size : 0.0; };
  // p is from the table's zero, the circle about X = 20.
  const std::vector<Case> cases = {
      {Kind::scale_mismatch, 40e-6 * radius,
       [](const Vec3& p, int) { return Vec3(30e-6 * p.x(), -10e-6 * p.y(), 0.0); }},
      {Kind::squareness, 40e-6 * radius, [](const Vec3& p, int) { return Vec3(-40e-6 * p.y(), 0.0, 0.0); }},
      {Kind::lost_motion_first, 0.008,
       [&](const Vec3& p, int sense) { return Vec3(-step(-sense * p.y(), 0.004), 0.0, 0.0); }},
      {Kind::lost_motion_second, -0.006,
       [&](const Vec3& p, int sense) { return Vec3(0.0, step(sense * (p.x() - 20.0), 0.003), 0.0); }},
      // Y lags: it is where it was a time before, by 0.1 mrad of the circle.
      {Kind::servo_mismatch, -0.5 * 1e-4 * radius,
       [](const Vec3& p, int sense) { return Vec3(0.0, -1e-4 * sense * (p.x() - 20.0), 0.0); }},
      {Kind::radius, 0.003,
       [&](const Vec3& p, int sense) {
         return Vec3(0.0015 * sense * (p - Vec3(20.0, 0.0, p.z())) / radius);
       }},
  };
  const auto causes_of = [&](const std::function<Vec3(const Vec3&, int)>& deviation) {
    const auto paths = circular_paths(circle(radius, 20.0, deviation)).value();
    std::vector<const CircularPath*> all;
    all.reserve(paths.size());
    for (const auto& path : paths) all.push_back(&path);
    return circle_causes(all);
  };
  for (const Case& one : cases) {
    const auto causes = causes_of(one.deviation);
    ASSERT_EQ(causes.size(), cases.size());
    for (const CircleCause& cause : causes) {
      const bool own = cause.kind == one.kind;
      EXPECT_NEAR(cause.size_mm, own ? one.size_mm : 0.0, 1e-9) << static_cast<int>(one.kind);
      EXPECT_NEAR(cause.share, own ? 1.0 : 0.0, 1e-9) << static_cast<int>(one.kind);
    }
  }
  const auto together = causes_of([&](const Vec3& p, int sense) {
    Vec3 sum = Vec3::Zero();
    for (const Case& one : cases) sum += one.deviation(p, sense);
    return sum;
  });
  double shares = 0.0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    EXPECT_EQ(together[k].kind, cases[k].kind);
    EXPECT_NEAR(together[k].size_mm, cases[k].size_mm, 1e-9);
    shares += together[k].share;
  }
  EXPECT_NEAR(shares, 1.0, 1e-9);
  // A quarter of a circle tells none of them apart.
  Readings quarter = circle(radius, 20.0, cases[0].deviation);
  std::erase_if(quarter.rows, [](const Reading& r) { return r.position[0] < 20.0 || r.position[1] < 0.0; });
  const auto arcs = circular_paths(quarter).value();
  EXPECT_TRUE(circle_causes({&arcs.front()}).empty());
}

TEST(Iso2304, SplitsARunThatTurnsRound) {
  Readings readings = circle(50.0, 0.0, [](const Vec3&, int) { return Vec3::Zero(); });
  for (Reading& r : readings.rows) r.run = "1";
  const auto paths = circular_paths(readings);
  ASSERT_EQ(paths->size(), 2u);
  EXPECT_TRUE((*paths)[0].counter_clockwise);
  EXPECT_FALSE((*paths)[1].counter_clockwise);
}

TEST(Iso2304, RefusesALine) {
  Readings readings{.file = "l.csv", .rows = {}};
  for (int i = 0; i < 20; ++i) {
    Reading r;
    r.run = "1";
    r.position[0] = i;
    r.n = Vec3::UnitX();
    readings.rows.push_back(r);
  }
  EXPECT_FALSE(circular_paths(readings).has_value());
}

TEST(Iso2306, FaceDiagonalsGiveSquarenessAndTheMachineValue) {
  Readings readings{.file = "d.csv", .rows = {}};
  const double opening = 25e-6;
  for (const double sign : {1.0, -1.0})
    for (const int way : {1, -1})
      for (int run = 0; run < 2; ++run)
        for (int k = 0; k <= 10; ++k) {
          const int i = way > 0 ? k : 10 - k;
          const Vec3 p(30.0 * i, sign * 40.0 * i, 0.0);
          Reading r;
          r.run = std::to_string(run);
          r.n = Vec3(0.6, sign * 0.8, 0.0);
          r.position[0] = p.x();
          r.position[1] = p.y();
          r.direction[0] = way;
          r.deviation = r.n.dot(Vec3(20e-6 * p.x() - opening * p.y(), 20e-6 * p.y(), 0.0)) + 0.001 * way +
                        (run - 0.5) * 0.0002;
          readings.rows.push_back(r);
        }
  const auto lines = diagonal_lines(readings);
  ASSERT_TRUE(lines.has_value()) << lines.error().text();
  ASSERT_EQ(lines->size(), 2u);
  const auto result = evaluate_diagonals(*lines);
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->squareness.size(), 1u);
  EXPECT_EQ(result->squareness[0].plane, "XY");
  EXPECT_NEAR(result->squareness[0].opening_rad, opening, 1e-12);
  EXPECT_NEAR(*result->B, 0.002, 1e-12);
  // The diagonal that the opening lengthens: (20e-6 + 0.48 * 25e-6) * 500 mm, and the reversal on top.
  EXPECT_NEAR(*result->E, (20e-6 + 0.48 * opening) * 500.0 + 0.002, 1e-12);
  EXPECT_NEAR(*result->R, 4.0 * std::sqrt(2.0) * 1e-4 + 0.002, 1e-12);
}

Readings spindle_like(const std::function<Vec3(double, int)>& motion, bool part = false) {
  Readings out{.file = "c.csv", .rows = {}};
  for (int turn = 0; turn < 4; ++turn)
    for (int i = 0; i < 72; ++i)
      for (const Vec3& n : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
        Reading r;
        r.run = "1";
        r.part_frame = part;
        r.position[5] = kTwoPi * (turn + i / 72.0);
        r.n = n;
        r.deviation = n.dot(motion(kTwoPi * i / 72.0, turn));
        out.rows.push_back(r);
      }
  return out;
}

TEST(Iso2307, SeparatesSynchronousAsynchronousAndEccentricity) {
  // Radial: eccentricity 50 um, three lobes of 2 um in the rotating direction, and 0.5 um steps from turn to
  // turn. Axial: 1 um once per turn.
  const auto readings = spindle_like([](double t, int turn) {
    const double r = 0.002 * std::cos(3 * t) + 0.0005 * turn;
    return Vec3(0.05 * std::cos(t) + r * std::cos(t), 0.05 * std::sin(t) + r * std::sin(t),
                0.001 * std::sin(t));
  });
  const auto motions = error_motions(readings);
  ASSERT_TRUE(motions.has_value()) << motions.error().text();
  bool rotating = false, axial = false;
  for (const ErrorMotion& motion : *motions) {
    const auto values = evaluate_error_motion(motion);
    ASSERT_TRUE(values.has_value());
    EXPECT_EQ(values->turns, 4u);
    if (motion.direction == "rotating") {
      rotating = true;
      EXPECT_NEAR(values->synchronous, 0.004, 1e-9);
      EXPECT_NEAR(values->asynchronous, 0.0015, 1e-12);
      EXPECT_NEAR(values->total, 0.0055, 1e-9);
    }
    if (motion.kind == ErrorMotionKind::axial) {
      axial = true;
      EXPECT_NEAR(values->synchronous, 0.002, 1e-9);  // its fundamental is real
      EXPECT_NEAR(*values->residual_synchronous, 0.0, 1e-12);
      EXPECT_NEAR(values->fundamental, 0.001, 1e-12);
    }
  }
  EXPECT_TRUE(rotating && axial);
}

TEST(Iso2307, AFixedDirectionLosesItsEccentricityToo) {
  const auto readings = spindle_like([](double t, int) {
    return Vec3(0.05 * std::cos(t) + 0.001 * std::cos(2 * t), 0.05 * std::sin(t), 0.0);
  });
  const auto motions = error_motions(readings);
  ASSERT_TRUE(motions.has_value());
  for (const ErrorMotion& motion : *motions)
    if (motion.direction == "X") {
      EXPECT_NEAR(evaluate_error_motion(motion)->synchronous, 0.002, 1e-9);
      EXPECT_NEAR(evaluate_error_motion(motion)->fundamental, 0.05, 1e-12);
    }
}

}  // namespace
}  // namespace trunnion::iso230
