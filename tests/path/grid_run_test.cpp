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
// its bow is the bound from norms.
TEST(GridRun, GivesWhatOnePointAtATimeGives) {
  std::mt19937_64 random(20261121);
  std::size_t kept = 0;
  std::size_t left = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    const Rounding rounding = test::four_decimals(machine);
    const Certifier certifier(kinematics);
    const Tolerance tolerance{0.005, Angle::degrees(0.05)};
    for (const std::size_t count : {1U, 2U, 3U, 37U, 500U, 5U, 74U}) {
      const test::OnlyTwoLanes lanes(count % 37 == 0);
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
      grid.place(&before, chosen, pose_at, tolerance, placed);
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
        EXPECT_DOUBLE_EQ(grid.bow_mm(i), certifier.bow_from_norms(from, to));
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

}  // namespace
}  // namespace trunnion::path
