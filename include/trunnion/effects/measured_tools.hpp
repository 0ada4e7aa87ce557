#pragma once
#include "trunnion/effects/measured_range.hpp"

namespace trunnion {

/// As [model.valid] names how long the tools were with which was measured, from S to the measured point. What
/// lies beyond it by up to a twentieth of the longest is not said.
inline constexpr const char* kToolLengthKey = "tool_length_mm";

}  // namespace trunnion
