#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "trunnion/effects/model.hpp"
#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::path {

/// How far the errors of a machine leave a straight course while the axes make one straight motion: what a
/// certificate of the nominal curve lacks on a machine with errors.
///
/// Over a motion from q0 to q1 let delta(t) be the actual minus the nominal tip in P (mm), epsilon(t) the
/// same of the tool axis. Proved: |delta(t) - [(1 - t) delta(0) + t delta(1)]| <= tip_mm and likewise for
/// epsilon. Proof: README of this layer, "A machine with errors". No allocation; thread-safe.
class ErrorCourse {
 public:
  /// References must outlive the object. `tool_mm`: vector from S to the tip.
  ErrorCourse(const Machine& machine, const Vec3& tool_mm, const ModelEvaluator& model);

  struct Bend {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    const Effect* unbounded = nullptr;  // an effect that knows no bound: the figures say nothing then
  };
  /// @param from, to  states at the ends of the motion; all but `q` equal
  /// @param lagged  values of the model's lags on the way; empty for a model without memory, or at rest
  Bend over(const MachineState& from, const MachineState& to, std::span<const double> lagged = {}) const;

  /// An end of a motion with what is known there: sines of the rotary positions and the model's errors.
  struct End {
    const MachineState& state;
    const RotarySines& sines;
    const ChainErrors& errors;
  };
  Bend over(const End& from, const End& to) const;

 private:
  const Machine& machine_;
  Vec3 tool_mm_;
  const ModelEvaluator& model_;
  std::vector<AxisTurn> turns_;  // of the part's rotary axes, from the bed outwards
};

}  // namespace trunnion::path
