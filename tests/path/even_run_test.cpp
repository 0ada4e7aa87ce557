#include "trunnion/path/even_run.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "path/word_grid.hpp"
#include "support/lanes.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

struct PlacedWalk {
  std::vector<JointVector> joints;  // on the word grid
  std::vector<RotarySines> sines;
  std::vector<ToolPose> poses;  // as prescribed
};

// A random walk, now with short steps and now with long ones.
PlacedWalk placed_walk(const TableKinematics& kinematics, const Rounding& rounding, std::mt19937_64& random,
                       std::size_t count) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  PlacedWalk out;
  JointVector q;
  for (std::size_t k = 0; k < 2; ++k) q[kinematics.rotary(k)] = 1.2 * u(random);
  for (std::size_t k = 0; k < 3; ++k) q[kinematics.linear(k)] = 100.0 * u(random);
  for (std::size_t i = 0; i < count; ++i) {
    const double step = std::exp(3.0 * u(random) - 2.0);
    for (std::size_t k = 0; k < 2; ++k) q[kinematics.rotary(k)] += 0.02 * step * u(random);
    for (std::size_t k = 0; k < 3; ++k) q[kinematics.linear(k)] += step * u(random);
    out.poses.push_back(kinematics.pose(q));
    JointVector placed = q;
    out.sines.push_back(round_to_words(kinematics, rounding, out.poses.back().tip_P, placed));
    out.joints.push_back(placed);
  }
  return out;
}

Point point_of(const PlacedWalk& walk, std::size_t i) {
  Point out;
  out.q = walk.joints[i];
  out.tip_P = walk.poses[i].tip_P;
  out.axis_P = walk.poses[i].axis_P;
  out.where = {static_cast<std::uint32_t>(i), 1};
  return out;
}

void expect_same(const Point& a, const Point& b) {
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.tip_P, b.tip_P);
  EXPECT_EQ(a.axis_P, b.axis_P);
  EXPECT_EQ(a.where, b.where);
  EXPECT_EQ(a.inserted, b.inserted);
  EXPECT_EQ(a.beside_P, b.beside_P);
}

// Sampled: how far the tool leaves its place on the segment from `from` to the last of `pieces`, up to
// `flute_mm`; the place is the nearest of many.
double farthest_tool_mm(const TableKinematics& kinematics, const Point& from,
                        const std::vector<Point>& pieces, double flute_mm) {
  constexpr int kPlaces = 400;
  const Point& to = pieces.back();
  double out = 0.0;
  JointVector before = from.q;
  for (const Point& piece : pieces) {
    for (int k = 0; k <= 8; ++k) {
      const ToolPose tool = kinematics.pose(JointVector::interpolate(before, piece.q, k / 8.0));
      double least = std::numeric_limits<double>::infinity();
      for (int i = 0; i <= kPlaces; ++i) {
        const double t = static_cast<double>(i) / kPlaces;
        const Vec3 tip = tool.tip_P - from.tip_P - t * (to.tip_P - from.tip_P);
        const Vec3 end = tip + flute_mm * (tool.axis_P - slerp(from.axis_P, to.axis_P, t));
        least = std::min(least, std::max(tip.norm(), end.norm()));
      }
      out = std::max(out, least);
    }
    before = piece.q;
  }
  return out;
}

// Sampled: how far the tip leaves the segment from `from` to the last of `pieces`.
double farthest_off_mm(const TableKinematics& kinematics, const Point& from,
                       const std::vector<Point>& pieces) {
  double out = 0.0;
  JointVector before = from.q;
  for (const Point& to : pieces) {
    for (int k = 0; k <= 16; ++k) {
      const Vec3 tip_P = kinematics.pose(JointVector::interpolate(before, to.q, k / 16.0)).tip_P;
      out = std::max(out, distance_to_segment(tip_P, from.tip_P, pieces.back().tip_P));
    }
    before = to.q;
  }
  return out;
}

// What is settled side by side is what Refiner::decide makes of the segment alone: the bits of its points.
void settles_as_one_at_a_time(const Machine& machine, const NonlinearOptions& options, double flute_mm,
                              std::mt19937_64& random, std::array<std::size_t, 4>& settled_with) {
  const TableKinematics kinematics(machine, machine.tool_vector());
  if (!kinematics.side_by_side()) return;
  const Rounding rounding = test::four_decimals(machine);
  const bool exact = options.predictor.kind == Predictor::Kind::exact;
  EvenRun even(machine, kinematics, rounding, options);
  Refiner refiner(machine, machine.tool_vector(), rounding, options);
  for (const auto& [tip_mm, known_mm] :
       {std::pair{0.0002, 0.5}, std::pair{0.002, 0.5}, std::pair{0.0005, 0.001}}) {
    const Tolerance tolerance{tip_mm, Angle::degrees(0.05), {flute_mm, tip_mm}};
    for (const std::size_t count : {2U, 3U, 38U, 500U}) {
      const PlacedWalk walk = placed_walk(kinematics, rounding, random, count);
      even.clear();
      const auto end = [&](std::size_t i) {
        return EvenRun::End{&walk.joints[i], &walk.sines[i], &walk.poses[i]};
      };
      for (std::size_t i = 1; i < count; ++i)
        even.add({end(i - 1), end(i), {static_cast<std::uint32_t>(i), 1}, i});
      std::vector<Point> points(3);
      const double enough_mm = count % 2 == 0 ? 0.0 : tip_mm;
      for (const EvenRun::Settled& of : even.settle(tolerance, enough_mm, known_mm, points)) {
        std::vector<Point> alone;
        const Point a = point_of(walk, of.number - 1);
        const Point b = point_of(walk, of.number);
        const SegmentReport report = refiner.decide(
            {a, b, &walk.sines[of.number - 1], &walk.sines[of.number]}, tolerance, known_mm, alone);
        EXPECT_TRUE(report.converged);
        if (exact) {
          EXPECT_LE(report.predicted_mm, known_mm);
        } else if (report.predicted_mm > 0.0) {
          EXPECT_NEAR(of.predicted_mm, report.predicted_mm, 1e-12);
        } else {
          EXPECT_LE(of.predicted_mm, known_mm);  // it was proved without looking
        }
        if (report.midpoint_mm > 0.0) {
          EXPECT_EQ(of.midpoint_mm, report.midpoint_mm);
        } else {
          EXPECT_LE(of.midpoint_mm, known_mm);  // it was proved without looking
        }
        ASSERT_EQ(of.inserted, alone.size()) << machine.name << ' ' << of.number;
        ASSERT_LE(of.first + of.inserted, points.size());
        for (std::size_t k = 0; k < alone.size(); ++k) expect_same(points[of.first + k], alone[k]);
        EXPECT_LE(of.off_mm, tip_mm);
        alone.push_back(point_of(walk, of.number));
        const Point before = point_of(walk, of.number - 1);
        EXPECT_LE(farthest_off_mm(kinematics, before, alone), of.off_mm) << machine.name << ' ' << of.number;
        // Between two of the places that are looked at the tool goes so far.
        const double between_mm = ((alone.back().tip_P - before.tip_P).norm() +
                                   flute_mm * (alone.back().axis_P - before.axis_P).norm()) /
                                  400.0;
        if (flute_mm > 0.0 && of.number % 50 == 0) {
          EXPECT_LE(farthest_tool_mm(kinematics, before, alone, flute_mm), of.off_mm + between_mm)
              << machine.name << ' ' << of.number;
        }
        ++settled_with[std::min<std::size_t>(of.inserted, 3)];
      }
    }
  }
}

// Points on the chord and on both sides, proved and sampled, with every predictor that it takes.
std::vector<NonlinearOptions> settling_options() {
  std::vector<NonlinearOptions> out;
  for (const std::string_view predictor : {"exact", "harmonic", "parabola"}) {
    for (const bool certify : {false, true}) {
      NonlinearOptions options;
      options.predictor = *predictor_from_text(predictor);
      options.certify = certify;
      options.method = Method::reinsert;
      out.push_back(options);
      options.method = Method::adaptive;
      out.push_back(options);
      options.one_sided = true;
      out.push_back(options);
    }
  }
  return out;
}

TEST(LongEvenRun, SettlesSegmentsAsOneAtATimeIsDecided) {
  for (const lanes::Way way : test::kEveryWay) {
    const test::Calculating lanes(way);
    std::mt19937_64 random(20261122);
    for (const NonlinearOptions& options : settling_options()) {
      std::array<std::size_t, 4> settled_with{};
      for (const std::string& name : test::shipped_machines())
        settles_as_one_at_a_time(test::shipped_machine(name), options, 0.0, random, settled_with);
      for (const std::size_t count : settled_with) EXPECT_GT(count, 50U);
    }
  }
}

TEST(LongEvenRun, SettlesSegmentsWithAFluteAsOneAtATimeIsDecided) {
  for (const lanes::Way way : test::kEveryWay) {
    const test::Calculating lanes(way);
    std::mt19937_64 random(20261123);
    for (const NonlinearOptions& options : settling_options()) {
      std::array<std::size_t, 4> settled_with{};
      for (const std::string& name : test::shipped_machines())
        for (const double flute_mm : {10.0, 60.0})
          settles_as_one_at_a_time(test::shipped_machine(name), options, flute_mm, random, settled_with);
      for (const std::size_t count : settled_with) EXPECT_GT(count, 50U);
    }
  }
}

}  // namespace
}  // namespace trunnion::path
