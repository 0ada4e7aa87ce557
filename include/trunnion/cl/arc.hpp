#pragma once
#include <vector>

#include "trunnion/cl/record.hpp"

namespace trunnion::cl {

/// The point of `arc` at fraction t of its sweep (frame P, mm). The distance from the axis and the height go
/// linearly from those of the start to those of the end: the file's rounding, and helices.
Vec3 point_on(const Arc& arc, double t);

/// How many chords `linearise` makes of the arc.
double chords_of(const Arc& arc, double tolerance_mm);

/// Points behind the start, the last of them the arc's end, whose chords stay within `tolerance_mm` (> 0) of
/// the arc: a chord over the angle d is off by r (1 - cos(d / 2)).
std::vector<Vec3> linearise(const Arc& arc, double tolerance_mm);

}  // namespace trunnion::cl
