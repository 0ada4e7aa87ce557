#include "diagnosis/verdict/clock_shift.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {
namespace {

struct RunClock {
  double from_s = INFINITY, to_s = -INFINITY;
  double slowest_rpm = INFINITY, fastest_rpm = -INFINITY;
  bool states_vary = false;
  bool speeds_vary() const { return fastest_rpm > slowest_rpm; }
};

std::vector<RunClock> clocks(const Dataset& data) {
  std::vector<RunClock> out(data.context.runs.size());
  std::vector<std::size_t> first(out.size(), data.track.size());
  for (std::size_t i = 0; i < data.track.size(); ++i) {
    const MachineState s = data.track.state(i);
    RunClock& run = out[s.run];
    run.from_s = std::min(run.from_s, s.time_s);
    run.to_s = std::max(run.to_s, s.time_s);
    run.slowest_rpm = std::min(run.slowest_rpm, s.spindle_rpm);
    run.fastest_rpm = std::max(run.fastest_rpm, s.spindle_rpm);
    if (first[s.run] == data.track.size()) first[s.run] = i;
    const MachineState f = data.track.state(first[s.run]);
    run.states_vary =
        run.states_vary || !std::equal(s.state.begin(), s.state.end(), f.state.begin(), f.state.end());
  }
  return out;
}

}  // namespace

Dataset with_known_state(const Dataset& data, const Convention& c) {
  Dataset out = data;
  if (c.kind != ConventionKind::time_shift) return out;
  const auto runs = clocks(data);
  std::erase_if(out.readings, [&](const Reading& r) {
    const MachineState s = data.track.state(r.row);
    const RunClock& run = runs[s.run];
    const double t = s.time_s + c.clock.by_s;
    return (run.speeds_vary() || run.states_vary) && (t < run.from_s || t > run.to_s);
  });
  return out;
}

std::vector<std::size_t> runs_with_lost_speeds(const Dataset& data, const Convention& c) {
  std::vector<std::size_t> out;
  if (c.kind != ConventionKind::time_shift || c.clock.by_s >= 0.0) return out;
  const auto runs = clocks(data);
  for (std::size_t run = 0; run < runs.size(); ++run)
    if (runs[run].speeds_vary()) out.push_back(run);
  return out;
}

}  // namespace trunnion::diagnosis
