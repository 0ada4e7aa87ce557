#include "trunnion/path/station_run.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/machines.hpp"

namespace trunnion::path {
namespace {

// Two at a time: the stations and the bows of one at a time.
TEST(StationRun, GivesWhatOnePositionAtATimeGives) {
  std::mt19937_64 random(20261121);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::size_t machines = 0;
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
        ASSERT_LT((run.poses()[row].tip_P - s.tip_P).norm(), 1e-11);
        ASSERT_LT((run.poses()[row].axis_P - s.axis_P).norm(), 1e-14);
        if (row + 1 == count) continue;
        const Certifier::Bows bows = certifier.bows_from_norms(s, stations[row + 1]);
        ASSERT_NEAR(run.bows()[row].tip_mm, bows.tip_mm, 1e-13 * (1.0 + bows.tip_mm));
        ASSERT_NEAR(run.bows()[row].axis, bows.axis, 1e-14);
      }
    }
  }
  EXPECT_GT(machines, 3U);
}

}  // namespace
}  // namespace trunnion::path
