#include "trunnion/path/station_run.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/lanes.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

// A few at a time: the stations and the bows of one at a time.
class StationRuns : public testing::TestWithParam<lanes::Way> {
 protected:
  const test::Calculating lanes_{GetParam()};
};

TEST_P(StationRuns, GiveWhatOnePositionAtATimeGives) {
  std::mt19937_64 random(20261121);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::size_t machines = 0;
  std::size_t nearer_arc = 0;
  std::size_t smaller = 0;  // bows of the tip than from norms
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    ++machines;
    const Certifier certifier(kinematics);
    StationRun run(kinematics);
    for (const std::size_t count : {1U, 2U, 7U, 40U, 3U}) {
      std::vector<Station> stations;
      run.resize(count);
      JointVector q;
      for (std::size_t row = 0; row < count; ++row) {
        for (AxisId id = 0; id < machine.axes.size(); ++id) {
          q[id] += u(random) * (machine.axes[id].kind == AxisKind::rotary ? 0.3 : 20.0);
          run.of_axis(id)[row] = q[id];
        }
        stations.push_back(station(kinematics, q));
      }
      run.evaluate();
      for (std::size_t row = 0; row < count; ++row) {
        const Station& s = stations[row];
        ASSERT_EQ(run.q(row), s.q);
        for (std::size_t k = 0; k < 2; ++k) {
          ASSERT_EQ(run.sines(row).sin[k], s.sines.sin[k]);
          ASSERT_EQ(run.sines(row).cos[k], s.sines.cos[k]);
        }
        ASSERT_LT((run.poses().pose(row).tip_P - s.tip_P).norm(), 1e-11);
        ASSERT_LT((run.poses().pose(row).axis_P - s.axis_P).norm(), 1e-14);
        if (row + 1 == count) continue;
        const Certifier::Bows bows = certifier.bows_from_norms(s, stations[row + 1]);
        const double bow_mm = run.poses().bow_mm[row];
        ASSERT_LE(bow_mm, bows.tip_mm * (1.0 + 1e-13) + 1e-13);
        smaller += bow_mm < 0.7 * bows.tip_mm ? 1U : 0U;
        // The tip keeps within it of its chord, and within the rest of the parabola.
        const PoseRun& poses = run.poses();
        const Vec3 sag_mm(poses.sag_mm[0][row], poses.sag_mm[1][row], poses.sag_mm[2][row]);
        const Vec3 from = poses.pose(row).tip_P;
        const Vec3 to = poses.pose(row + 1).tip_P;
        for (const double t : {0.1, 0.25, 0.4, 0.5, 0.6, 0.8, 0.95}) {
          const Vec3 at = kinematics.pose(JointVector::interpolate(s.q, stations[row + 1].q, t)).tip_P;
          ASSERT_LE(distance_to_segment(at, from, to), bow_mm);
          const Vec3 parabola = (1.0 - t) * from + t * to + 4.0 * t * (1.0 - t) * sag_mm;
          ASSERT_LE((at - parabola).norm(), poses.rest_mm[row]);
          const Vec3 axis = kinematics.pose(JointVector::interpolate(s.q, stations[row + 1].q, t)).axis_P;
          const double off_arc = (axis - slerp(s.axis_P, stations[row + 1].axis_P, t)).norm();
          const double off_chord = distance_to_segment(axis, s.axis_P, stations[row + 1].axis_P);
          ASSERT_LE(std::min(off_arc, off_chord), poses.bow_axis[row]);
        }
        ASSERT_LE(poses.bow_axis[row], bows.axis * (1.0 + 1e-13) + 1e-14);
        nearer_arc += poses.bow_axis[row] < 0.5 * bows.axis ? 1U : 0U;
      }
    }
  }
  EXPECT_GT(machines, 3U);
  EXPECT_GT(smaller, 20U);
  EXPECT_GT(nearer_arc, 20U);
}

INSTANTIATE_TEST_SUITE_P(Path, StationRuns, testing::ValuesIn(test::kEveryWay));

}  // namespace
}  // namespace trunnion::path
