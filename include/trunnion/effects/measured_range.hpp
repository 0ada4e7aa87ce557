#pragma once
#include <functional>
#include <string>
#include <vector>

#include "trunnion/effects/effect.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// Where an axis stood, or what a sensor said, over all readings from which a model has its numbers, or over
/// all states in which it is used.
struct MeasuredRange {
  std::string key;               // as [model.valid] names it: "X_mm", "C_deg", "T_room_degC"
  double low = 0.0, high = 0.0;  // in the unit of the key
};
using MeasuredRanges = std::vector<MeasuredRange>;

/// From `low` to `high`, in mm or rad.
MeasuredRange range_of_axis(const Axis& axis, double low, double high);
/// From `low_K` to `high_K` above the machine's reference temperature.
MeasuredRange range_of_sensor(const Machine& machine, const std::string& sensor, double low_K, double high_K);

/// Of the axes and temperatures of `count` states. A rotary axis whose positions leave no larger gap where
/// the turn ends than somewhere within it was measured all round: its range is a whole turn.
MeasuredRanges ranges_of(const Machine& machine, const StateNames& names, std::size_t count,
                         const std::function<MachineState(std::size_t)>& state);

/// Of each key that either has, from the least to the largest.
MeasuredRanges joined(MeasuredRanges a, const MeasuredRanges& b);

/// What of `used` lies beyond `measured` by more than a hundredth of the measured range, with both, as in
/// "X -310 to 250 mm (measured: -250 to 250)"; empty where nothing does. A rotary axis is where it is a turn
/// further; keys that only one of them has are not compared.
std::string beyond_measured(const MeasuredRanges& measured, const MeasuredRanges& used);

}  // namespace trunnion
