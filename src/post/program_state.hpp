#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "trunnion/effects/state_track.hpp"
#include "trunnion/post/verify.hpp"

namespace trunnion::post {

/// State of the machine along a program, for effects that depend on more than the position: the sense of each
/// axis' last motion, velocities, the spindle speed, the elapsed time, temperatures, and what of them is
/// lagged. A program begins with the spindle cold.
class ProgramState {
 public:
  /// `temperatures` may be null: at reference; else it must outlive this.
  explicit ProgramState(std::size_t axes, std::vector<LagRequest> lags = {},
                        const TemperatureHistory* temperatures = nullptr)
      : axes_(axes), lags_(std::move(lags)), temperatures_(temperatures) {
    // What is settled at the start (temperatures) is so before the first motion.
    wait(0.0);
  }

  /// The machine moves to `q` in `seconds` (0: not known).
  void move_to(const JointVector& q, double seconds = 0.0) {
    const MachineState moving = towards(q, q, seconds);
    if (lags_.values().empty() && temperatures_ == nullptr) {
      state_.time_s += seconds;
    } else {
      hold(towards(q, state_.q, seconds), seconds);
    }
    state_.q = q;
    state_.velocity = moving.velocity;
    state_.direction = moving.direction;
    started_ = true;
  }
  /// The machine stands.
  void wait(double seconds) {
    state_.velocity = {};
    hold(state_, seconds);
  }
  /// Values of the lags now: of a block they are those at its start.
  std::span<const double> lagged() const { return lags_.values(); }
  /// At `at`, on the way to `q`.
  MachineState towards(const JointVector& q, const JointVector& at, double seconds = 0.0) const {
    constexpr double kStill = 1e-9;  // below this an axis stands: rounding of a word is not a reversal
    MachineState s = state_;
    for (AxisId id = 0; id < axes_; ++id) {
      const double d = q[id] - state_.q[id];
      s.velocity[id] = seconds > 0.0 ? d / seconds : 0.0;
      if (started_ && std::abs(d) > kStill) s.direction[id] = d > 0.0 ? std::int8_t{1} : std::int8_t{-1};
    }
    s.q = at;
    return s;
  }
  void spindle(double rpm) { state_.spindle_rpm = rpm; }
  const MachineState& now() const { return state_; }

 private:
  // Temperatures change while a state is held.
  void hold(MachineState during, double seconds) {
    constexpr double kStep_s = 10.0;  // far below any time constant of a thermal effect
    double left_s = seconds;
    do {
      const double step_s = temperatures_ != nullptr ? std::min(left_s, kStep_s) : left_s;
      if (temperatures_ != nullptr) during.temperature_K = temperatures_->at(state_.time_s);
      lags_.hold(during, step_s);
      state_.time_s += step_s;
      left_s -= step_s;
    } while (left_s > 0.0);
    if (temperatures_ != nullptr) state_.temperature_K = temperatures_->at(state_.time_s);
  }

  std::size_t axes_;
  LagFollower lags_;
  const TemperatureHistory* temperatures_;
  MachineState state_;
  bool started_ = false;
};

/// A motion so small that it can only take up lost motion (backlash of machines is far below it): on the way
/// the part does not move as commanded, at its end it stands where the sense of motion says.
inline bool is_take_up(const Machine& machine, const JointVector& from, const JointVector& to) {
  constexpr double kLinear_mm = 0.1;
  constexpr double kRotary_rad = 0.02 * kRadPerDegree;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const double limit = machine.axes[id].kind == AxisKind::linear ? kLinear_mm : kRotary_rad;
    if (std::abs(to[id] - from[id]) > limit) return false;
  }
  return true;
}

}  // namespace trunnion::post
