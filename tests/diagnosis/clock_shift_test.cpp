#include "diagnosis/verdict/clock_shift.hpp"

#include "diagnosis/campaigns.hpp"
#include "support/cases.hpp"

// The clock of the recorded speeds went ahead of that of the readings.
namespace trunnion::diagnosis {
namespace {

const std::string kModel = "[model]\nname = \"m\"\n[[effect]]\nid = \"spindle_growth\"\n";

// A spindle cycle read along three directions, and a laser beside it.
std::string plan() {
  return "[[run]]\nid = \"warm_up\"\nminutes = 100\nquantity = \"displacement\"\nn = [[1, 0, 0], [0, 1, 0], "
         "[0, 0, "
         "1]]\nu_random = 0.8\nu_common = 0.3\nspindle_rpm = [[0, 8000], [25, 0], [50, 12000], [75, "
         "0]]\nrepeat = 100\nposes = [[0, 0, 100, 0, 0]]\n" +
         test::sweep_run("laser_x", "X", -250, 250, 21, "[1, 0, 0]", "displacement", {});
}

struct Shifted {
  Machine machine = test::thermal_machine("trunnion_offset");
  Dataset data;
  explicit Shifted(double by_s) {
    const Dataset right = test::measured(
        machine, plan(),
        "[model]\nname = \"m\"\n[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = "
        "1.5\nY_um_per_krpm = -0.7\ntau_s = 600\n",
        5);
    Convention wrong;
    wrong.kind = ConventionKind::time_shift;
    wrong.clock.by_s = by_s;
    data = put_right(machine, test::model_for(machine, right, kModel), right, wrong).data;
  }
};

TEST(ClockShift, LeavesReadingsWithoutAStateWhereSpeedsVary) {
  const Shifted s(0.0);
  Convention c;
  c.kind = ConventionKind::time_shift;
  c.clock.by_s = -600.0;
  const Dataset known = with_known_state(s.data, c);
  // 60 s from one reading to the next of the spindle cycle, three directions; none of the laser's.
  std::size_t lost = 0;
  for (const Reading& r : s.data.readings) {
    const MachineState state = s.data.track.state(r.row);
    if (s.data.context.runs[state.run].id == "warm_up" && state.time_s < 600.0) ++lost;
  }
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(s.data.readings.size() - known.readings.size(), lost);
  EXPECT_EQ(runs_with_lost_speeds(s.data, c), std::vector<std::size_t>{0});
  c.clock.by_s = 600.0;
  EXPECT_TRUE(runs_with_lost_speeds(s.data, c).empty());
}

// Speeds of the beginning were never written: neither their lag nor other effects may be named for it.
TEST(LongClockShift, IsNamedThoughTheBeginningIsLost) {
  for (const double by : {-900.0, 500.0, 1200.0}) {
    const Shifted s(by);
    const Diagnosis d = diagnose(s.machine, s.data, test::model_for(s.machine, s.data, kModel));
    ASSERT_EQ(d.verdict, Verdict::bookkeeping) << by << "\n" << d.paragraph;
    ASSERT_FALSE(d.bookkeeping.empty());
    EXPECT_EQ(d.bookkeeping.front().convention.kind, ConventionKind::time_shift) << by;
    EXPECT_NEAR(d.bookkeeping.front().convention.clock.by_s, -by, 0.15 * std::abs(by) + 60.0);
    EXPECT_TRUE(d.effects.empty());
  }
}

}  // namespace
}  // namespace trunnion::diagnosis
