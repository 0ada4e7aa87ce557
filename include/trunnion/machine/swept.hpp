#pragma once
#include <cstdint>
#include <optional>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// Which turns of the rotary axes are meant: those within the limits of the file, or within these taken
/// either way, so that an axis whose sense the file has wrong is among them.
enum class SweptTurns { within_limits, either_sense };
/// Highest place of a point of the part, in P, while the rotary axes turn: Z in M with the linear axes at
/// zero, mm. The innermost axis is taken as one without limits.
double swept_top_mm(const Machine& machine, const Vec3& point_P, SweptTurns turns);
/// Where the tip of a tool of this gauge length is at the safe height, along Z of M over the part, mm (Z
/// carries the tool away or the part: as the file says). Nothing: there is no safe height.
std::optional<double> safe_tip_mm(const Machine& machine, double tool_length_mm);

}  // namespace trunnion
