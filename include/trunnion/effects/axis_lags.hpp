#pragma once
#include "trunnion/effects/model.hpp"

namespace trunnion {

/// By how much each axis is behind its command, s: what the `servo_lag` of the model and the lag of all axes
/// sum up to; 0 where the model knows of none, below 0 for an axis that is ahead of the others.
JointVector axis_lags(const Model& model);

/// The model without what follows the command in time: delays of axes, and what is over within milliseconds
/// of a reversal. In a program these are no errors at a place: words are led by them in time, or not at all.
Model without_servo_effects(const Model& model);

}  // namespace trunnion
