#include "diagnosis/verdict/ball_place.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kTurns_rad = 0.5 * kRadPerDegree;  // 30 degrees, written in radians

struct OfRun {
  std::vector<Vec3> places_P;
  std::optional<JointVector> first;
  bool turns = false;
};

}  // namespace

std::vector<double> ball_wanders_mm(const Machine& machine, const Dataset& data) {
  std::vector<OfRun> runs(data.context.runs.size());
  std::size_t before = data.track.size();
  for (const Reading& r : data.readings) {
    if (r.quantity != Quantity::displacement || r.row == before) continue;
    before = r.row;
    const MachineState state = data.track.state(r.row);
    OfRun& run = runs[state.run];
    if (!run.first) run.first = state.q;
    for (const AxisId axis : machine.rotary_axes())
      run.turns = run.turns || std::abs(state.q[axis] - (*run.first)[axis]) > kTurns_rad;
    run.places_P.push_back(forward(machine, state.q, data.rows[r.row].tool_mm).p);
  }
  std::vector<double> out;
  for (const OfRun& run : runs) {
    if (!run.turns) continue;
    Vec3 middle = Vec3::Zero();
    for (const Vec3& place : run.places_P) middle += place / static_cast<double>(run.places_P.size());
    double most = 0.0;
    for (const Vec3& place : run.places_P) most = std::max(most, (place - middle).norm());
    out.push_back(most);
  }
  return out;
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
  const std::vector<double> before = ball_wanders_mm(machine, data);
  if (std::none_of(before.begin(), before.end(), [](double mm) { return mm < kBallStands_mm; })) return false;
  const PutRight right = put_right(machine, model, data, c);
  const std::vector<double> after = ball_wanders_mm(right.machine, right.data);
  // Of runs that turn in either case.
  if (after.size() != before.size()) return false;
  for (std::size_t k = 0; k < before.size(); ++k)
    if (before[k] < kBallStands_mm && after[k] > kBallWanders_mm) return true;
  return false;
}

bool proved_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                        const Convention& c) {
  if (!moves_the_ball(c)) return false;
  const std::vector<double> before = ball_wanders_mm(machine, data);
  if (std::none_of(before.begin(), before.end(), [](double mm) { return mm > kBallWanders_mm; }))
    return false;
  const PutRight right = put_right(machine, model, data, c);
  const std::vector<double> after = ball_wanders_mm(right.machine, right.data);
  return !after.empty() &&
         std::all_of(after.begin(), after.end(), [](double mm) { return mm < kBallStands_mm; });
}

}  // namespace trunnion::diagnosis
