#include "post/making/measured_reach.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"

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

void MeasuredReach::warn_of_times(Posting& posting, const std::string& what, double first_s, double last_s) {
  constexpr double kHeld = 0.1;  // of the program's time: what is held for longer is worth a word
  const double end_s = posting.report.duration_s;
  if (first_s <= kHeld * end_s && last_s >= (1.0 - kHeld) * end_s) return;
  posting.diagnostics.warning("", {},
                              what + " cover " + fixed_text(first_s, 0) + " to " + fixed_text(last_s, 0) +
                                  " s, the program runs from 0 to " + fixed_text(end_s, 0) +
                                  " s: outside them the first or last value is used. Is their time in "
                                  "seconds from the start of the program?");
}

void MeasuredReach::warn(Posting& posting) const {
  // One row alone holds for the whole program on purpose.
  if (const auto* log = posting.job.temperatures; log != nullptr && log->time_s.size() > 1)
    warn_of_times(posting, "the temperatures of the log", log->time_s.front(), log->time_s.back());
  if (const auto* table = posting.job.offsets;
      table != nullptr && table->key == thermal::OffsetTable::Key::time && table->rows.size() > 1)
    warn_of_times(posting, "the thermal offsets", table->rows.front().time_s, table->rows.back().time_s);
  if (!cuts_) return;
  const std::string beyond = beyond_measured(posting.job.model->valid, used(posting));
  if (beyond.empty()) return;
  posting.diagnostics.warning(posting.job.model->file, {},
                              "the program cuts where the model was not measured: " + beyond);
}

}  // namespace trunnion::post
