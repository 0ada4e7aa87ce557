#pragma once
#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/measured_range.hpp"

namespace trunnion::diagnosis {

/// Of the axes, the temperatures and the tools of all readings.
MeasuredRanges ranges_of_readings(const Machine& machine, const Dataset& data);

}  // namespace trunnion::diagnosis
