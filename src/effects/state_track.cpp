#include "trunnion/effects/state_track.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

// What drives an error through its heat starts at rest; what is a state of the machine has been there long.
bool settled_at_start(Signal::Kind kind) {
  return kind == Signal::Kind::temperature || kind == Signal::Kind::position ||
         kind == Signal::Kind::direction;
}

}  // namespace

StateTrack::StateTrack(std::span<const MachineState> rows)
    : rows_(rows.begin(), rows.end()), order_(rows.size()) {
  slices_.reserve(rows.size());
  for (MachineState& row : rows_) {
    const std::size_t begin = values_.size();
    values_.insert(values_.end(), row.temperature_K.begin(), row.temperature_K.end());
    const std::size_t middle = values_.size();
    values_.insert(values_.end(), row.state.begin(), row.state.end());
    slices_.push_back({begin, middle, values_.size()});
    row.temperature_K = {};
    row.state = {};
  }
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::stable_sort(order_.begin(), order_.end(), [this](std::size_t a, std::size_t b) {
    return std::pair(rows_[a].run, rows_[a].time_s) < std::pair(rows_[b].run, rows_[b].time_s);
  });
}

MachineState StateTrack::state(std::size_t row) const {
  MachineState out = rows_[row];
  const Slice& slice = slices_[row];
  const std::span<const double> values(values_);
  out.temperature_K = values.subspan(slice.begin, slice.temperatures - slice.begin);
  out.state = values.subspan(slice.temperatures, slice.end - slice.temperatures);
  return out;
}

void StateTrack::lag(const LagRequest& request, std::span<double> out) const {
  TRUNNION_EXPECTS(out.size() == rows_.size());
  double y = 0.0;
  double u = 0.0;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const std::size_t row = order_[k];
    const double now = state(row).value(request.signal);
    if (k == 0 || rows_[order_[k - 1]].run != rows_[row].run) {
      y = settled_at_start(request.signal.kind) ? now : 0.0;
    } else {
      const double dt = rows_[row].time_s - rows_[order_[k - 1]].time_s;
      y -= (u - y) * std::expm1(-dt / request.tau_s);
    }
    u = now;
    out[row] = request.tau_s > 0.0 ? y : now;
  }
}

std::vector<double> StateTrack::lag(const LagRequest& request) const {
  std::vector<double> out(size());
  lag(request, out);
  return out;
}

LagFollower::LagFollower(std::vector<LagRequest> requests)
    : requests_(std::move(requests)), values_(requests_.size(), 0.0) {}

void LagFollower::hold(const MachineState& state, double seconds) {
  for (std::size_t k = 0; k < requests_.size(); ++k) {
    const LagRequest& r = requests_[k];
    const double u = state.value(r.signal);
    if (!started_ && settled_at_start(r.signal.kind)) values_[k] = u;
    if (r.tau_s > 0.0)
      values_[k] -= (u - values_[k]) * std::expm1(-seconds / r.tau_s);
    else
      values_[k] = u;
  }
  started_ = true;
}

const std::array<std::int8_t, kMaxAxes>& DirectionTracker::move_to(const JointVector& q) {
  for (std::size_t i = 0; i < kMaxAxes; ++i) {
    const double step = started_ ? q[i] - last_[i] : 0.0;
    if (std::abs(step) > dead_band_) direction_[i] = step > 0.0 ? 1 : -1;
    if (!started_ || std::abs(step) > dead_band_) last_[i] = q[i];
  }
  started_ = true;
  return direction_;
}

}  // namespace trunnion
