#pragma once
#include <algorithm>

#include "trunnion/machine/machine.hpp"

// Private to the verifier.
namespace trunnion::post {

/// Where the axes have been in a program that is read back, and whether their travel holds that.
class TravelSeen {
 public:
  explicit TravelSeen(const Machine& machine) {
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      least_[id] = machine.axes[id].min;
      most_[id] = machine.axes[id].max;
    }
  }

  /// The position of the next block is within the travel. Axes that the machine does not have stand at 0,
  /// within 0 and 0.
  bool take(const JointVector& q, bool is_first) {
    if (is_first) smallest_q_ = largest_q_ = q;
    double room = 0.0;
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      smallest_q_[id] = std::min(smallest_q_[id], q[id]);
      largest_q_[id] = std::max(largest_q_[id], q[id]);
      room = std::min({room, q[id] - least_[id], most_[id] - q[id]});
    }
    is_within_ = room >= 0.0;
    return is_within_;
  }
  /// Of an axis, many positions that are within the travel.
  void take_within(AxisId id, double smallest, double largest) {
    smallest_q_[id] = std::min(smallest_q_[id], smallest);
    largest_q_[id] = std::max(largest_q_[id], largest);
    is_within_ = true;
  }
  bool holds(AxisId id, double smallest, double largest) const {
    return smallest >= least_[id] && largest <= most_[id];
  }
  /// The last block was.
  bool is_within() const { return is_within_; }
  double smallest(AxisId id) const { return smallest_q_[id]; }
  double largest(AxisId id) const { return largest_q_[id]; }

 private:
  JointVector least_, most_;
  JointVector smallest_q_, largest_q_;
  bool is_within_ = false;
};

}  // namespace trunnion::post
