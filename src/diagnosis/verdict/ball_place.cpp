#include "diagnosis/verdict/ball_place.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kTurns_rad = 0.5 * kRadPerDegree;  // 30 degrees, written in radians

double wanders_mm(const Machine& machine, const Dataset& data, const std::vector<std::size_t>& rows) {
  std::vector<Vec3> places_P;
  places_P.reserve(rows.size());
  Vec3 middle = Vec3::Zero();
  for (const std::size_t row : rows) {
    places_P.push_back(forward(machine, data.track.state(row).q, data.rows[row].tool_mm).p);
    middle += places_P.back() / static_cast<double>(rows.size());
  }
  double most = 0.0;
  for (const Vec3& place : places_P) most = std::max(most, (place - middle).norm());
  return most;
}

}  // namespace

std::vector<TurningRun> turning_runs(const Machine& machine, const Dataset& data) {
  std::vector<TurningRun> runs(data.context.runs.size());
  std::vector<bool> turns(runs.size(), false);
  std::size_t before = data.track.size();
  for (const Reading& r : data.readings) {
    if (r.quantity != Quantity::displacement || r.row == before) continue;
    before = r.row;
    const MachineState state = data.track.state(r.row);
    TurningRun& run = runs[state.run];
    run.run = state.run;
    run.rows.push_back(r.row);
    const MachineState first = data.track.state(run.rows.front());
    for (AxisId axis = 0; axis < machine.axes.size(); ++axis) {
      const double by = std::abs(state.q[axis] - first.q[axis]);
      if (machine.axes[axis].kind == AxisKind::linear)
        run.follows = run.follows || by > kBallWanders_mm;
      else if (by > kTurns_rad)
        turns[state.run] = true;
    }
  }
  std::erase_if(runs, [&](const TurningRun& run) { return run.rows.empty() || !turns[run.run]; });
  for (TurningRun& run : runs) run.wanders_mm = wanders_mm(machine, data, run.rows);
  return runs;
}

bool moves_the_ball(const Convention& c) {
  switch (c.kind) {
    case ConventionKind::axis_sense:
    case ConventionKind::stacking_order:
      return true;
    case ConventionKind::swapped_columns:
    case ConventionKind::unit:
      return !c.axes.empty();
    case ConventionKind::tool_length:  // of the lever alone: else the readings show that the ball is
                                       // elsewhere
      return !c.in_readings && c.by_mm != Vec3::Zero();
    default:
      return false;
  }
}

bool refuted_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                         const Convention& c) {
  if (!moves_the_ball(c)) return false;
  const std::vector<TurningRun> before = turning_runs(machine, data);
  const auto stands = [](const TurningRun& run) { return run.wanders_mm < kBallStands_mm; };
  if (std::none_of(before.begin(), before.end(), stands)) return false;
  const PutRight right = put_right(machine, model, data, c);
  const std::vector<TurningRun> after = turning_runs(right.machine, right.data);
  // Of runs that turn in either case.
  if (after.size() != before.size()) return false;
  for (std::size_t k = 0; k < before.size(); ++k)
    if (stands(before[k]) && after[k].wanders_mm > kBallWanders_mm) return true;
  return false;
}

bool proved_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                        const Convention& c) {
  if (!moves_the_ball(c)) return false;
  const auto is_other = [&](const TurningRun& run) { return c.run && run.run != *c.run; };
  std::vector<TurningRun> before = turning_runs(machine, data);
  std::erase_if(before, is_other);
  if (std::none_of(before.begin(), before.end(),
                   [](const TurningRun& run) { return run.follows && run.wanders_mm > kBallWanders_mm; }))
    return false;
  const PutRight right = put_right(machine, model, data, c);
  std::vector<TurningRun> after = turning_runs(right.machine, right.data);
  std::erase_if(after, is_other);
  // A factor that makes all positions nearly one would hold anything still.
  return std::any_of(after.begin(), after.end(), [](const TurningRun& run) { return run.follows; }) &&
         std::all_of(after.begin(), after.end(), [&](const TurningRun& now) {
           const auto was = std::find_if(before.begin(), before.end(),
                                         [&](const TurningRun& run) { return run.run == now.run; });
           const bool followed = was == before.end() || was->follows;
           return !followed || (now.follows && now.wanders_mm < kBallStands_mm);
         });
}

std::string wandering_text(const Machine& machine, const Dataset& data) {
  std::vector<TurningRun> runs = turning_runs(machine, data);
  std::erase_if(runs, [](const TurningRun& run) { return !run.follows; });
  const auto stands = std::find_if(runs.begin(), runs.end(),
                                   [](const TurningRun& run) { return run.wanders_mm < kBallStands_mm; });
  if (stands == runs.end()) return {};
  std::string names;
  double most_mm = 0.0;
  for (const TurningRun& run : runs) {
    if (run.wanders_mm <= kBallWanders_mm) continue;
    names += (names.empty() ? "'" : ", '") + data.context.runs[run.run].id + "'";
    most_mm = std::max(most_mm, run.wanders_mm);
  }
  if (names.empty()) return {};
  return "In " + names + " the measured point wanders by up to " + fixed_text(most_mm, 1) +
         " mm on the part while the rotary axes turn; in '" + data.context.runs[stands->run].id +
         "' it stands still. If it is a ball there, too, then positions, the tool or the run's order of rows "
         "are "
         "wrong in the file, and what is said here is built on them.";
}

}  // namespace trunnion::diagnosis
