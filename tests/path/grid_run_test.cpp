#include "trunnion/path/grid_run.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/path/certificate.hpp"

#include "path/word_grid.hpp"
#include "support/lanes.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

struct Walk {
  std::vector<Point> points;
  std::vector<ChosenPoint> chosen;
};

// A random walk of joint positions; some sines are not known.
Walk random_walk(const Machine& machine, const TableKinematics& kinematics, std::mt19937_64& random,
                 std::size_t count) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Walk run;
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    q[id] = u(random) * (machine.axes[id].kind == AxisKind::rotary ? 1.5 : 100.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double step = std::exp(4.0 * u(random) - 3.5);
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      q[id] += step * u(random) * (machine.axes[id].kind == AxisKind::rotary ? 0.05 : 1.0);
    const ToolPose pose = kinematics.pose(q);
    Point point;
    point.q = q;
    point.tip_P = pose.tip_P;
    point.axis_P = pose.axis_P;
    run.points.push_back(point);
    ChosenPoint chosen;
    chosen.q = chosen.q_leave = q;
    if (i % 7 != 3) chosen.sines = {kinematics.sines(q), {q[kinematics.rotary(0)], q[kinematics.rotary(1)]}};
    run.chosen.push_back(chosen);
  }
  return run;
}

// A few at a time: the bits of one. A segment that is said to keep is one that the proof lets through, and
// the bound from norms says which ones do not count.
TEST(GridRun, GivesWhatOnePointAtATimeGives) {
  std::mt19937_64 random(20261121);
  std::size_t kept = 0;
  std::size_t walks = 0;
  std::size_t left = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    const Rounding rounding = test::four_decimals(machine);
    const Certifier certifier(kinematics);
    const Tolerance tolerance{0.005, Angle::degrees(0.05)};
    for (const std::size_t count : {1U, 2U, 3U, 37U, 500U, 5U, 74U, 40U}) {
      const test::Calculating lanes(test::kEveryWay[walks++ % 3]);
      GridRun grid(kinematics, rounding);
      Walk run = random_walk(machine, kinematics, random, count + 1);
      Point before = run.points.front();
      round_to_words(kinematics, rounding, before.tip_P, before.q);
      const std::vector<Point> points(run.points.begin() + 1, run.points.end());
      std::vector<ToolPose> poses;
      for (const Point& point : run.points) poses.push_back({point.tip_P, point.axis_P});
      const std::vector<ChosenPoint> chosen(run.chosen.begin() + 1, run.chosen.end());
      std::vector<JointVector> placed(count);
      const auto pose_at = [&](std::size_t i) -> const ToolPose& { return poses[i + 1]; };
      const GridRun::Known known{1e-3, 1e-3};
      grid.place(&before, chosen, pose_at, tolerance, known, placed);
      Station from = station(kinematics, before.q);
      for (std::size_t i = 0; i < count; ++i) {
        JointVector q = chosen[i].q;
        const RotarySines sines = round_to_words(kinematics, rounding, points[i].tip_P, q, chosen[i].sines);
        ASSERT_EQ(placed[i], q) << name << ' ' << i;
        EXPECT_EQ(grid.sines(i).sin, sines.sin);
        EXPECT_EQ(grid.sines(i).cos, sines.cos);
        const Station to = station(kinematics, q, sines);
        const Point& a = i == 0 ? before : points[i - 1];
        const Reference reference{a.tip_P, points[i].tip_P, a.axis_P, points[i].axis_P};
        EXPECT_FALSE(grid.keeps(i) && certifier.bow_from_norms(from, to) < known.predicted_mm &&
                     grid.counts(i, known));
        if (grid.keeps(i)) {
          EXPECT_EQ(certifier.tip_within(from, to, reference, tolerance.tip_mm), Within::yes);
          EXPECT_EQ(certifier.axis_within(from, to, reference, tolerance.axis), Within::yes);
        }
        ++(grid.keeps(i) ? kept : left);
        from = to;
      }
    }
  }
  EXPECT_GT(kept, 100U);
  EXPECT_GT(left, 100U);
}

// How far the tip leaves its chord, and by how much it misses the chord's middle.
GridRun::Known sampled(const TableKinematics& kinematics, const JointVector& a, const JointVector& b) {
  const auto tip_at = [&](double share) {
    JointVector q;
    for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = a[id] + share * (b[id] - a[id]);
    return kinematics.tip_P(q, kinematics.sines(q));
  };
  const Vec3 from = tip_at(0.0);
  const Vec3 to = tip_at(1.0);
  GridRun::Known out{0.0, (tip_at(0.5) - 0.5 * (from + to)).norm()};
  for (const double share : {0.1, 0.3, 0.4, 0.45, 0.5, 0.55, 0.6, 0.7, 0.9})
    out.predicted_mm = std::max(out.predicted_mm, distance_to_segment(tip_at(share), from, to));
  return out;
}

// A segment that does not count is below what is known; one that is well below it rarely counts.
TEST(GridRun, SaysWhichSegmentsCount) {
  std::mt19937_64 random(20261122);
  std::size_t below = 0, count = 0, norms_let_count = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    const Certifier certifier(kinematics);
    for (int round = 0; round < 40; ++round) {
      const test::Calculating lanes(test::kEveryWay[static_cast<std::size_t>(round % 3)]);
      const Walk run = random_walk(machine, kinematics, random, 301);
      std::vector<ToolPose> poses;
      for (const Point& point : run.points) poses.push_back({point.tip_P, point.axis_P});
      const auto pose_at = [&](std::size_t i) -> const ToolPose& { return poses[i + 1]; };
      const GridRun::Known known{round % 4 < 2 ? 2e-4 : 1e-3, 1e-3};
      GridRun grid(kinematics, Rounding{});
      std::vector<JointVector> placed(300);
      grid.place(&run.points[0], std::span(run.chosen).subspan(1), pose_at, {1.0, Angle::degrees(20.0)},
                 known, placed);
      for (std::size_t i = 0; i < placed.size(); ++i) {
        const JointVector& from = i == 0 ? run.points[0].q : placed[i - 1];
        if (!grid.keeps(i)) continue;
        const GridRun::Known truth = sampled(kinematics, from, placed[i]);
        if (!grid.counts(i, known)) {
          ASSERT_LE(truth.predicted_mm, known.predicted_mm) << name << ' ' << i;
          ASSERT_LE(truth.midpoint_mm, known.midpoint_mm) << name << ' ' << i;
        }
        if (truth.predicted_mm > 0.8 * known.predicted_mm || truth.midpoint_mm > 0.8 * known.midpoint_mm)
          continue;
        ++below;
        if (grid.counts(i, known)) ++count;
        const double bow_mm =
            certifier.bow_from_norms(station(kinematics, from), station(kinematics, placed[i]));
        if (bow_mm > known.predicted_mm) ++norms_let_count;
      }
    }
  }
  EXPECT_GT(below, 10000U);
  EXPECT_GT(norms_let_count, 1000U);
  EXPECT_LT(count, norms_let_count / 10) << norms_let_count;
}

}  // namespace
}  // namespace trunnion::path
