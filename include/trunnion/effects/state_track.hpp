#pragma once
#include <span>
#include <vector>

#include "trunnion/effects/effect.hpp"

namespace trunnion {

/// States of the machine over time, run by run, and first-order lags along them.
///
/// dy/dt = (u - y) / tau, where the signal u holds its value from its row to the next one of the same run (by
/// time; rows of equal time in the order given). At the start of a run lags of the spindle speed, of
/// velocities and of free states are at rest (y = 0), those of temperatures, positions and senses of motion
/// settled (y = u).
/// Exact for that u: y_k+1 = y_k + (u_k - y_k) (1 - exp(-dt / tau)).
class StateTrack {
 public:
  StateTrack() = default;
  /// Rows in any order; temperature and state values are copied.
  explicit StateTrack(std::span<const MachineState> rows);

  std::size_t size() const { return rows_.size(); }
  /// The state of row i; its spans point into the track.
  MachineState state(std::size_t row) const;

  /// The lagged signal at every row, in the order of the rows. Requires out.size() == size().
  void lag(const LagRequest& request, std::span<double> out) const;
  std::vector<double> lag(const LagRequest& request) const;

 private:
  struct Slice {
    std::size_t begin, temperatures, end;
  };
  std::vector<MachineState> rows_;
  std::vector<double> values_;  // temperatures and free states of all rows
  std::vector<Slice> slices_;
  std::vector<std::size_t> order_;  // rows by run, then by time
};

/// Lags along a program, block by block: the same equation as StateTrack, for states that come one after the
/// other.
class LagFollower {
 public:
  explicit LagFollower(std::vector<LagRequest> requests);
  /// The machine holds `state` for `seconds`.
  void hold(const MachineState& state, double seconds);
  /// In the order of the requests. Before the first `hold`: at rest (0).
  std::span<const double> values() const { return values_; }

 private:
  std::vector<LagRequest> requests_;
  std::vector<double> values_;
  bool started_ = false;
};

/// Sense of each axis' last motion along a sequence of commanded positions: kept until the axis moves the
/// other way by more than the rounding of an NC word. Unknown (0) before an axis has moved.
class DirectionTracker {
 public:
  /// `dead_band`: motions smaller than this (mm, rad) do not count.
  explicit DirectionTracker(double dead_band = 0.0) : dead_band_(dead_band) {}
  const std::array<std::int8_t, kMaxAxes>& move_to(const JointVector& q);

 private:
  double dead_band_;
  bool started_ = false;
  JointVector last_;
  std::array<std::int8_t, kMaxAxes> direction_{};
};

}  // namespace trunnion
