#include "path/choice/choice_account.hpp"

#include <cmath>

#include "trunnion/base/lanes.hpp"

#include "path/choice/reach.hpp"
#include "path/choice/turns.hpp"

namespace trunnion::path {

ChoiceAccount::ChoiceAccount(const Machine& machine, const JointVector& seed, std::uint8_t branch)
    : before_(seed), branch_(branch) {
  for (const AxisId id : machine.rotary_axes()) turns_[id] = 1.0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) seconds_[id] = seconds_per_unit(machine.axes[id]);
}

void ChoiceAccount::add(std::span<const ChosenPoint> chosen, ChoiceSummary& summary) {
  double axis_time_s = summary.axis_time_s;
  double rotary_travel_rad = summary.rotary_travel_rad;
  for (const ChosenPoint& point : chosen) {
    static_assert(kMaxAxes == 5, "two pairs and one");
    // Positions that the machine has no axis for take no time.
    const auto way = [&](AxisId id) {
      return lanes::abs(Lanes{point.q[id] - before_[id], point.q[id + 1] - before_[id + 1]});
    };
    const Lanes first = way(0);
    const Lanes second = way(2);
    const double last = std::abs(point.q[4] - before_[4]);
    const Lanes both = first * Lanes{seconds_[0], seconds_[1]} + second * Lanes{seconds_[2], seconds_[3]};
    axis_time_s += both[0] + both[1] + last * seconds_[4];
    const Lanes turned = first * Lanes{turns_[0], turns_[1]} + second * Lanes{turns_[2], turns_[3]};
    rotary_travel_rad += turned[0] + turned[1] + last * turns_[4];
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
