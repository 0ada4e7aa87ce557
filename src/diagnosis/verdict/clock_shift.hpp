#pragma once
#include "trunnion/diagnosis/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// A shift of the clock leaves the beginning or the end of every run without a state that was recorded. Where
/// speeds or free states vary what is held there instead may be anything: the readings without those.
Dataset with_known_state(const Dataset& data, const Convention& time_shift);

/// Runs with a beginning that has no recorded speed, in which speeds vary: what the spindle did there goes on
/// to act (ClockShift::speed_before_rpm).
std::vector<std::size_t> runs_with_lost_speeds(const Dataset& data, const Convention& time_shift);

}  // namespace trunnion::diagnosis
