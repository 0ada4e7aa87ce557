#include "path/choice/far_limits.hpp"

#include <algorithm>
#include <limits>

#include "path/choice/global_choice.hpp"

namespace trunnion::path {
namespace {

// LayerSearch looks at half as many turns as it follows positions, and a turn is kept to either limit.
constexpr double kFar = kTwoPi * (static_cast<double>(GlobalChoice::kFewPositions) / 2.0 + 2.0);

bool is_far(const Axis& axis) {
  return axis.has_limits() && axis.max - axis.min > kFar;
}

}  // namespace

std::optional<Machine> without_far_limits(const Machine& machine) {
  std::optional<Machine> out;
  for (const AxisId id : machine.rotary_axes()) {
    if (!is_far(machine.axes[id])) continue;
    if (!out) out = machine;
    out->axes[id].min = -std::numeric_limits<double>::infinity();
    out->axes[id].max = std::numeric_limits<double>::infinity();
  }
  return out;
}

bool keeps_far_limits(const Machine& machine, std::span<const ChosenPoint> chosen) {
  for (const AxisId id : machine.rotary_axes()) {
    const Axis& axis = machine.axes[id];
    if (!is_far(axis)) continue;
    const double least = axis.min + kTwoPi, most = axis.max - kTwoPi;
    const auto is_near = [&](const ChosenPoint& point) {
      return !(std::min(point.q[id], point.q_leave[id]) >= least &&
               std::max(point.q[id], point.q_leave[id]) <= most);
    };
    if (std::any_of(chosen.begin(), chosen.end(), is_near)) return false;
  }
  return true;
}

}  // namespace trunnion::path
