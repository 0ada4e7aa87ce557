#include "trunnion/path/nonlinear.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "path/random_segments.hpp"
#include "path/table_3_2.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

Rounding four_decimals(const Machine& machine) {
  JointVector quantum;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    quantum[id] = machine.axes[id].kind == AxisKind::linear ? 1e-4 : Angle::degrees(1e-4).rad();
  }
  return Rounding::of(machine, machine.tool_vector(), quantum);
}

void put_on_words(const Machine& machine, const Rounding& rounding, std::vector<Point>& path) {
  const TableKinematics kinematics(machine, machine.tool_vector());
  for (Point& p : path) round_to_words(kinematics, rounding, p.tip_P, p.q);
}

// Largest sampled deviations of the whole path a, inserted..., b from the segment a b, by the one forward
// model.
struct Sampled {
  double tip = 0.0;
  double axis = 0.0;
};
Sampled sampled(const Machine& machine, const Point& a, const Point& b, const std::vector<Point>& inserted) {
  Sampled out;
  std::vector<JointVector> q{a.q};
  for (const Point& p : inserted) q.push_back(p.q);
  q.push_back(b.q);
  const Vec3 n = a.axis_P.cross(b.axis_P - a.axis_P);
  for (std::size_t i = 1; i < q.size(); ++i) {
    for (int k = 0; k <= 64; ++k) {
      const ToolPose pose = tool_pose(forward(machine, JointVector::interpolate(q[i - 1], q[i], k / 64.0)));
      out.tip = std::max(out.tip, distance_to_segment(pose.tip_P, a.tip_P, b.tip_P));
      if (n.norm() > 1e-9)
        out.axis = std::max(out.axis, std::asin(std::abs(n.normalized().dot(pose.axis_P - a.axis_P))));
    }
  }
  return out;
}

struct Case {
  const char* method;
  const char* predictor;
  bool one_sided;
};
NonlinearOptions options_of(const Case& c) {
  NonlinearOptions options;
  options.method = *method_from_text(c.method);
  options.predictor = *predictor_from_text(c.predictor);
  options.one_sided = c.one_sided;
  return options;
}

constexpr Case kCases[] = {{"reinsert", "harmonic", false}, {"reinsert", "quartic", false},
                           {"subtract", "harmonic", false}, {"subtract", "parabola", false},
                           {"subtract", "exact", false},    {"adaptive", "harmonic", false},
                           {"adaptive", "harmonic", true}};

TEST(Refiner, KeepsTable32WithinTheToleranceWithEveryMethod) {
  const Machine machine = test::shipped_machine("paper");
  for (const bool rounded : {false, true}) {
    const Rounding rounding = rounded ? four_decimals(machine) : Rounding{};
    auto path = test::table_3_2_path(machine);
    put_on_words(machine, rounding, path);
    for (const Case& c : kCases) {
      SCOPED_TRACE(std::string(c.method) + " " + c.predictor);
      Refiner refiner(machine, machine.tool_vector(), rounding, options_of(c));
      const Tolerance tolerance{0.001, Angle::degrees(0.05)};
      std::size_t inserted = 0;
      for (std::size_t i = 1; i < path.size(); ++i) {
        std::vector<Point> out;
        const SegmentReport report = refiner.refine(path[i - 1], path[i], tolerance, out);
        EXPECT_TRUE(report.converged);
        EXPECT_TRUE(report.certified);
        EXPECT_LE(report.tip_mm, tolerance.tip_mm * 1.05);
        EXPECT_EQ(report.inserted, out.size());
        const Sampled truth = sampled(machine, path[i - 1], path[i], out);
        EXPECT_LE(truth.tip, std::min(report.tip_mm, tolerance.tip_mm) + 1e-12);
        EXPECT_LE(truth.axis, report.axis.rad() + 1e-12);
        inserted += out.size();
      }
      EXPECT_GE(inserted, 19U);
      EXPECT_LT(inserted, 19U * 4U);
    }
  }
}

TEST(Refiner, NoneOnlyReports) {
  const Machine machine = test::shipped_machine("paper");
  const auto path = test::table_3_2_path(machine);
  NonlinearOptions options;
  options.method = Method::none;
  Refiner refiner(machine, machine.tool_vector(), {}, options);
  std::vector<Point> out;
  double largest = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const SegmentReport report = refiner.refine(path[i - 1], path[i], {0.002, Angle::degrees(0.05)}, out);
    largest = std::max(largest, report.tip_mm);
    EXPECT_EQ(report.converged, report.tip_mm <= 0.002);
  }
  EXPECT_TRUE(out.empty());
  EXPECT_GE(largest, 4.589e-3 - 1e-6);
  EXPECT_LE(largest, 4.589e-3 * 1.05);
}

bool within_rotary_limits(const Machine& machine, const JointVector& q) {
  for (const AxisId id : machine.rotary_axes()) {
    const Axis& axis = machine.axes[id];
    if (axis.has_limits() && !axis.within_limits(q[id])) return false;
  }
  return true;
}

class RefinerOf : public testing::TestWithParam<std::string> {};

TEST_P(RefinerOf, ConvergesOnRandomSegments) {
  const Machine machine = test::shipped_machine(GetParam());
  const Rounding rounding = four_decimals(machine);
  test::RandomSegments random(machine, 5);
  for (const Case& c : kCases) {
    SCOPED_TRACE(std::string(c.method) + " " + c.predictor + (c.one_sided ? " one-sided" : ""));
    Refiner refiner(machine, machine.tool_vector(), rounding, options_of(c));
    const Tolerance tolerance{0.005, Angle::degrees(0.2)};
    int unconverged = 0;
    for (int i = 0; i < 300; ++i) {
      const auto s = random.next(test::Family::chord, Angle::degrees(5.0));
      if (!within_rotary_limits(machine, s.a.q) || !within_rotary_limits(machine, s.b.q)) continue;
      Point a{s.a.q, s.a.tip_P, s.a.axis_P, {1, 1}, false};
      Point b{s.b.q, s.b.tip_P, s.b.axis_P, {2, 1}, false};
      round_to_words(random.kinematics(), rounding, a.tip_P, a.q);
      round_to_words(random.kinematics(), rounding, b.tip_P, b.q);
      std::vector<Point> out;
      const SegmentReport report = refiner.refine(a, b, tolerance, out);
      unconverged += !report.converged;
      if (!report.converged) continue;
      const Sampled truth = sampled(machine, a, b, out);
      ASSERT_LE(truth.tip, std::min(report.tip_mm, tolerance.tip_mm) + 1e-12) << i;
      ASSERT_LE(truth.axis, std::min(report.axis.rad(), tolerance.axis.rad()) + 1e-12) << i;
      for (const Point& p : out) {
        EXPECT_TRUE(p.inserted);
        EXPECT_EQ(p.where.line, 2U);
        // On the word grid.
        const JointVector words = words_of(machine, p.q, machine.tool_vector());
        for (AxisId id = 0; id < machine.axes.size(); ++id) {
          const double units = words[id] / rounding.quantum[id];
          ASSERT_NEAR(units, std::nearbyint(units), 1e-6);
        }
      }
    }
    EXPECT_EQ(unconverged, 0);
  }
}

// A segment on the word grid with a bow, and what the refiner made of it: points on whose way the tip keeps
// the tolerance.
struct Mended {
  Point a, b;
  double bow_mm = 0.0;
  std::vector<Point> out;
  SegmentReport report;
};

// Of 2000 random segments on this machine those that bow by so many tolerances.
std::vector<Mended> mended_bows(const Machine& machine, unsigned seed, const Tolerance& tolerance,
                                double least, double most) {
  const Rounding rounding = four_decimals(machine);
  test::RandomSegments random(machine, seed);
  Refiner refiner(machine, machine.tool_vector(), rounding, options_of(kCases[0]));
  std::vector<Mended> mended;
  for (int i = 0; i < 2000; ++i) {
    const auto s = random.next(test::Family::chord, Angle::degrees(3.0));
    if (!within_rotary_limits(machine, s.a.q) || !within_rotary_limits(machine, s.b.q)) continue;
    Mended m;
    m.a = {s.a.q, s.a.tip_P, s.a.axis_P, {1, 1}, false};
    m.b = {s.b.q, s.b.tip_P, s.b.axis_P, {2, 1}, false};
    round_to_words(random.kinematics(), rounding, m.a.tip_P, m.a.q);
    round_to_words(random.kinematics(), rounding, m.b.tip_P, m.b.q);
    m.bow_mm = sampled(machine, m.a, m.b, {}).tip;
    if (m.bow_mm < least * tolerance.tip_mm || m.bow_mm > most * tolerance.tip_mm) continue;
    m.report = refiner.refine(m.a, m.b, tolerance, m.out);
    EXPECT_TRUE(m.report.converged) << i;
    EXPECT_LE(sampled(machine, m.a, m.b, m.out).tip, tolerance.tip_mm) << i;
    mended.push_back(std::move(m));
  }
  return mended;
}

// A bow of less than four tolerances is a quarter of that in each half: one node half way, and never more
// than that.
TEST_P(RefinerOf, OneNodeHalfWayMendsASmallBow) {
  const Tolerance tolerance{0.005, Angle::degrees(0.2)};
  const auto small_bows = mended_bows(test::shipped_machine(GetParam()), 6, tolerance, 1.1, 3.0);
  for (const Mended& m : small_bows) {
    ASSERT_EQ(m.out.size(), 1U) << m.bow_mm;
    // Motion along the chord is no bow, but it is of the error in the middle.
    if (m.report.midpoint_mm > 3.0 * tolerance.tip_mm) continue;
    EXPECT_LT((m.out[0].tip_P - 0.5 * (m.a.tip_P + m.b.tip_P)).norm(), 1e-9) << m.report.midpoint_mm;
  }
  EXPECT_GT(small_bows.size(), 20U);
}

// Larger bows get pieces of one length, as many as the bow of the middle asks for, all on the chord.
TEST_P(RefinerOf, EvenPiecesMendABow) {
  const Tolerance tolerance{0.001, Angle::degrees(0.2)};
  const double tube_mm = tolerance.tip_mm - 0.5e-4 * std::sqrt(3.0);
  int even = 0;
  int others = 0;
  for (const Mended& m : mended_bows(test::shipped_machine(GetParam()), 7, tolerance, 4.5, 100.0)) {
    const double asked = std::ceil(std::sqrt(1.01 * m.bow_mm / tube_mm));
    const double pieces = static_cast<double>(m.out.size()) + 1.0;
    EXPECT_LE(pieces, asked + 2.0) << m.bow_mm;
    double off_mm = 0.0;
    for (std::size_t k = 0; k < m.out.size(); ++k) {
      const double t = static_cast<double>(k + 1) / pieces;
      off_mm = std::max(off_mm, (m.out[k].tip_P - (1.0 - t) * m.a.tip_P - t * m.b.tip_P).norm());
    }
    ++(off_mm < 1e-9 ? even : others);
  }
  EXPECT_GT(even, 20);
  EXPECT_LT(others, even);
}

INSTANTIATE_TEST_SUITE_P(Machines, RefinerOf, testing::ValuesIn(test::shipped_machines()));

// Issue: a half turn of C at A = 0. Nodes on the great circle flip C by 180 degrees between any two; linear
// ones converge.
TEST(Refiner, HalfTurnAtThePoleConverges) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const bool two_sided : {false, true}) {
    NonlinearOptions options;
    options.method = Method::adaptive;
    options.one_sided = !two_sided;
    Refiner refiner(machine, machine.tool_vector(), {}, options);
    const TableKinematics kinematics(machine, machine.tool_vector());
    const auto at = [&](double tilt_deg, double turn_deg, const Vec3& tip) {
      Point p;
      p.q[*machine.axis("A")] = Angle::degrees(tilt_deg).rad();
      p.q[*machine.axis("C")] = Angle::degrees(turn_deg).rad();
      kinematics.solve_linear(tip, kinematics.sines(p.q), p.q);
      const ToolPose pose = kinematics.pose(p.q);
      p.tip_P = pose.tip_P;
      p.axis_P = pose.axis_P;
      return p;
    };
    // A shallow dome through its top: 0.34 mm of path, the axis 0.05 degrees to either side of the pole.
    const Point a = at(0.05, 0.0, {-0.17, 0.0, 0.0});
    const Point b = at(0.05, 180.0, {0.17, 0.0, 0.0});
    std::vector<Point> out;
    const SegmentReport report = refiner.refine(a, b, {0.01, Angle::degrees(0.1)}, out);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(out.size(), 20U);
    EXPECT_GT(out.size(), 2U);
    EXPECT_TRUE(report.linear_nodes);
    EXPECT_TRUE(report.harmonic_fails);
    EXPECT_LE(report.axis.deg(), 0.1);
    EXPECT_LE(report.tip_mm, 0.0105);
    RecordProperty(two_sided ? "two_sided" : "on_chord", static_cast<int>(out.size()));
  }
}

// A path along a blade of `rows` points, `step_mm` apart, the axis turning as it goes.
std::vector<Point> blade(const Machine& machine, std::size_t rows, double step_mm, const Rounding& rounding) {
  std::vector<ToolPose> poses;
  for (std::size_t i = 0; i < rows; ++i) {
    const double s = step_mm * static_cast<double>(i);
    const Vec3 tip(50.0 - 0.3 * s, 5.0 - 0.7 * s + 0.002 * s * s, -38.0 + 0.6 * s);
    const Vec3 axis(0.7 + 0.004 * s, -0.1 - 0.006 * s, 0.55 - 0.003 * s);
    poses.push_back({tip, axis.normalized()});
  }
  auto path = test::nearest_path(machine, poses);
  put_on_words(machine, rounding, path);
  return path;
}

// Largest distance of the new path from the programmed polyline, and of its vertices from the new path.
double largest_distance(const Machine& machine, const std::vector<Point>& run,
                        const std::vector<Point>& out) {
  std::vector<Vec3> curve;
  for (std::size_t i = 1; i < out.size(); ++i) {
    for (int k = 0; k <= 16; ++k)
      curve.push_back(forward(machine, JointVector::interpolate(out[i - 1].q, out[i].q, k / 16.0)).p);
  }
  double worst = 0.0;
  for (const Vec3& p : curve) {
    double nearest = 1e9;
    for (std::size_t i = 1; i < run.size(); ++i) {
      nearest = std::min(nearest, distance_to_segment(p, run[i - 1].tip_P, run[i].tip_P));
    }
    worst = std::max(worst, nearest);
  }
  for (const Point& v : run) {
    double nearest = 1e9;
    for (std::size_t i = 1; i < curve.size(); ++i)
      nearest = std::min(nearest, distance_to_segment(v.tip_P, curve[i - 1], curve[i]));
    worst = std::max(worst, nearest);
  }
  return worst;
}

TEST(RefineRun, IsRefineOnEverySegmentByDefault) {
  const Machine machine = test::shipped_machine("paper");
  const auto run = blade(machine, 30, 1.0, {});
  Refiner refiner(machine, machine.tool_vector(), {}, {});
  const Tolerance tolerance{0.002, Angle::degrees(0.05)};
  std::vector<Point> whole;
  std::vector<SegmentReport> reports;
  refiner.refine_run(run, tolerance, whole, reports);
  std::vector<Point> single{run.front()};
  for (std::size_t i = 1; i < run.size(); ++i) {
    refiner.refine(run[i - 1], run[i], tolerance, single);
    single.push_back(run[i]);
  }
  ASSERT_EQ(whole.size(), single.size());
  EXPECT_EQ(reports.size(), run.size() - 1);
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_EQ(whole[i].q, single[i].q);
}

TEST(RefineRun, MovedPointsSaveInsertedOnesWithinTheTolerance) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Rounding rounding = four_decimals(machine);
  const auto run = blade(machine, 60, 2.0, rounding);
  // A tolerance that every segment misses by a little: one point each on the chord.
  NonlinearOptions none;
  none.method = Method::none;
  std::vector<Point> unchanged;
  std::vector<SegmentReport> programmed;
  Refiner(machine, machine.tool_vector(), rounding, none)
      .refine_run(run, {1e-6, Angle::degrees(1.0)}, unchanged, programmed);
  double least = 1e9;
  for (const SegmentReport& r : programmed) least = std::min(least, r.programmed_mm);
  const Tolerance tolerance{0.8 * least, Angle::degrees(0.2)};
  std::size_t inserted[2] = {0, 0};
  for (const bool moves : {false, true}) {
    NonlinearOptions options;
    options.method = Method::adaptive;
    options.move_programmed_points = moves;
    Refiner refiner(machine, machine.tool_vector(), rounding, options);
    std::vector<Point> out;
    std::vector<SegmentReport> reports;
    refiner.refine_run(run, tolerance, out, reports);
    ASSERT_EQ(reports.size(), run.size() - 1);
    EXPECT_EQ(out.front().q, run.front().q);
    EXPECT_EQ(out.back().q, run.back().q);
    for (const SegmentReport& r : reports) {
      EXPECT_TRUE(r.converged);
      inserted[moves ? 1 : 0] += r.inserted;
    }
    EXPECT_EQ(out.size(), run.size() + inserted[moves ? 1 : 0]);
    EXPECT_LE(largest_distance(machine, run, out), tolerance.tip_mm);
  }
  EXPECT_GE(inserted[0], run.size() - 1);
  EXPECT_LE(inserted[1], inserted[0] / 2);
}

TEST(RefineRun, ThinningKeepsTheTubeAndTheProgrammedPoints) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Rounding rounding = four_decimals(machine);
  const auto run = blade(machine, 400, 0.05, rounding);
  const Tolerance tolerance{0.005, Angle::degrees(0.05)};
  NonlinearOptions options;
  options.method = Method::adaptive;
  options.thin = true;
  Refiner refiner(machine, machine.tool_vector(), rounding, options);
  std::vector<Point> out;
  std::vector<SegmentReport> reports;
  refiner.refine_run(run, tolerance, out, reports);
  EXPECT_EQ(reports.size(), run.size() - 1);
  EXPECT_LT(out.size(), run.size() / 5);
  EXPECT_EQ(out.front().q, run.front().q);
  EXPECT_EQ(out.back().q, run.back().q);
  EXPECT_LE(largest_distance(machine, run, out), tolerance.tip_mm);
  for (const SegmentReport& r : reports) {
    EXPECT_TRUE(r.converged);
    EXPECT_LE(r.tip_mm, 1.05 * tolerance.tip_mm);
    EXPECT_LE(r.axis.rad(), 1.05 * tolerance.axis.rad());
  }
}

TEST(RefineRun, ThinningKeepsCorners) {
  const Machine machine = test::shipped_machine("paper");
  std::vector<ToolPose> poses;
  for (const Vec3& tip :
       {Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(10, 0, 0), Vec3(10, 5, 0), Vec3(10, 10, 0), Vec3(10, 4, 0)}) {
    poses.push_back({tip, Vec3(0.1, 0.2, 0.9).normalized()});
  }
  const auto run = test::nearest_path(machine, poses);
  NonlinearOptions options;
  options.thin = true;
  Refiner refiner(machine, machine.tool_vector(), {}, options);
  std::vector<Point> out;
  std::vector<SegmentReport> reports;
  refiner.refine_run(run, {0.01, Angle::degrees(0.05)}, out, reports);
  // The two points in the middle of a straight edge go; the corner and the turning point stay.
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[1].tip_P, Vec3(10, 0, 0));
  EXPECT_EQ(out[2].tip_P, Vec3(10, 10, 0));
}

}  // namespace
}  // namespace trunnion::path
