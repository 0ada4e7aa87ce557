#include "trunnion/machine/reach.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion {
namespace {

// Of an axis with limits its travel in steps of five degrees, of one without a turn.
std::vector<double> positions_of(const Axis& axis) {
  const double from = axis.has_limits() ? axis.min : 0.0;
  const double to = axis.has_limits() ? std::min(axis.max, from + kTwoPi) : kTwoPi;
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / (5.0 * kRadPerDegree))));
  std::vector<double> out;
  for (int i = 0; i <= steps; ++i) out.push_back(from + (to - from) * i / steps);
  return out;
}

bool reaches(const Machine& machine, const Vec3& axis_P) {
  const auto rotary = machine.rotary_axes();
  const RotarySolutions solutions = rotary_solutions(machine, axis_P, 0.0);
  for (std::size_t i = 0; i < solutions.count; ++i) {
    bool within = true;
    for (std::size_t k = 0; k < rotary.size(); ++k)
      within = within && nearest_turn(machine.axes[rotary[k]], solutions.at[i].angle[k], 0.0).has_value();
    if (within) return true;
  }
  return false;
}

void take(const Machine& machine, JointVector q, std::vector<MachineReach::Beyond>& out) {
  solve_linear(machine, Vec3::Zero(), machine.tool_vector(), q);
  for (const LimitViolation& v : limit_violations(machine, q)) {
    if (machine.axes[v.axis].kind != AxisKind::linear) continue;
    const auto known = std::find_if(out.begin(), out.end(), [&](const auto& b) { return b.axis == v.axis; });
    if (known == out.end())
      out.push_back({v.axis, v.by, q});
    else if (known->by_mm < v.by)
      *known = {v.axis, v.by, q};
  }
}

}  // namespace

MachineReach machine_reach(const Machine& machine) {
  MachineReach out;
  const auto rotary = machine.rotary_axes();
  bool every = !rotary.empty();
  for (int tilt = 0; tilt <= 180 && !rotary.empty(); ++tilt) {
    const double t = tilt * kRadPerDegree;
    bool some = false;
    for (int way = 0; way < 360; way += 5) {
      const double w = way * kRadPerDegree;
      const bool reached =
          reaches(machine, Vec3(std::sin(t) * std::cos(w), std::sin(t) * std::sin(w), std::cos(t)));
      every = every && reached;
      some = some || reached;
    }
    if (every) out.every_way = Angle::degrees(tilt);
    if (some) out.one_way = Angle::degrees(tilt);
  }
  JointVector q;
  if (rotary.empty()) {
    take(machine, q, out.beyond);
    return out;
  }
  for (const double outer : positions_of(machine.axes[rotary.front()])) {
    q[rotary.front()] = outer;
    if (rotary.size() == 1) {
      take(machine, q, out.beyond);
      continue;
    }
    for (const double inner : positions_of(machine.axes[rotary.back()])) {
      q[rotary.back()] = inner;
      take(machine, q, out.beyond);
    }
  }
  return out;
}

}  // namespace trunnion
