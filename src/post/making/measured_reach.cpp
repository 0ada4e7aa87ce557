#include "post/making/measured_reach.hpp"

#include <algorithm>

namespace trunnion::post {

void MeasuredReach::take(const Chunk& chunk) {
  if (!asked_) return;
  for (std::size_t i = 0; i < chunk.size(); ++i) {
    if (chunk.points[i].rapid) continue;
    const JointVector& q = chunk.chosen[i].q;
    if (!cuts_) smallest_q_ = largest_q_ = q;
    cuts_ = true;
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      smallest_q_[id] = std::min(smallest_q_[id], q[id]);
      largest_q_[id] = std::max(largest_q_[id], q[id]);
    }
  }
}

MeasuredRanges MeasuredReach::used(const Posting& posting) const {
  MeasuredRanges out;
  for (AxisId id = 0; id < posting.machine.axes.size(); ++id)
    out.push_back(range_of_axis(posting.machine.axes[id], smallest_q_[id], largest_q_[id]));
  const TemperatureHistory* history = posting.job.temperatures;
  if (history == nullptr) return out;
  const auto& sensors = posting.job.model->context.names.temperatures;
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    double low = history->at(0.0)[k], high = low;
    for (std::size_t row = 0; row < history->time_s.size(); ++row) {
      if (history->time_s[row] < 0.0 || history->time_s[row] > posting.report.duration_s) continue;
      low = std::min(low, history->temperature_K[row][k]);
      high = std::max(high, history->temperature_K[row][k]);
    }
    out.push_back(range_of_sensor(posting.machine, sensors[k], low, high));
  }
  return out;
}

void MeasuredReach::warn(Posting& posting) const {
  if (!cuts_) return;
  const std::string beyond = beyond_measured(posting.job.model->valid, used(posting));
  if (beyond.empty()) return;
  posting.diagnostics.warning(posting.job.model->file, {},
                              "the program cuts where the model was not measured: " + beyond);
}

}  // namespace trunnion::post
