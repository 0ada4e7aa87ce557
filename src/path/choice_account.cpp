#include "path/choice_account.hpp"

#include <cmath>

#include "path/reach.hpp"
#include "path/turns.hpp"

namespace trunnion::path {

ChoiceAccount::ChoiceAccount(const Machine& machine, const JointVector& seed, std::uint8_t branch)
    : rotary_(machine.rotary_axes()), before_(seed), branch_(branch) {
  for (AxisId id = 0; id < machine.axes.size(); ++id) seconds_[id] = seconds_per_unit(machine.axes[id]);
}

void ChoiceAccount::add(std::span<const ChosenPoint> chosen, ChoiceSummary& summary) {
  double axis_time_s = summary.axis_time_s;
  double rotary_travel_rad = summary.rotary_travel_rad;
  for (const ChosenPoint& point : chosen) {
    // Positions that the machine has no axis for take no time.
    for (AxisId id = 0; id < kMaxAxes; ++id)
      axis_time_s += std::abs(point.q[id] - before_[id]) * seconds_[id];
    for (const AxisId id : rotary_) rotary_travel_rad += std::abs(point.q[id] - before_[id]);
    if (point.reconfigure) ++summary.reconfigurations;
    if (point.singular) {
      ++summary.pole_points;
    } else {
      if (point.branch != branch_) ++summary.branch_changes;
      branch_ = point.branch;
    }
    before_ = point.q;
  }
  summary.axis_time_s = axis_time_s;
  summary.rotary_travel_rad = rotary_travel_rad;
  summary.last_branch = branch_;
}

// Why no branch reaches a pose: the tilt itself, or a limit of a rotary axis.
Error unreachable(const Machine& machine, const ChoicePoint& point, const ChoiceOptions& options,
                  const std::string& cl_file) {
  return {ErrorCode::check_failed, unreachable_text(machine, point.pose.axis_P, options.inverse), cl_file,
          point.where};
}

}  // namespace trunnion::path
