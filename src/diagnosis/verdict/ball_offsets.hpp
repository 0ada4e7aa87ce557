#pragma once
#include <vector>

#include "trunnion/diagnosis/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// Offsets of positions, or of the tool's length, that hold still a ball that wanders (`turning_runs`): one
/// for all runs where all of them wander, else one for each run that does. By least squares over the places
/// of the ball; the fewest numbers that do. Nothing where no offset does, or where a run has too few poses to
/// tell. README of this layer, "What the positions prove".
std::vector<Convention> offsets_that_hold_the_ball(const Machine& machine, const Dataset& data);

}  // namespace trunnion::diagnosis
