#pragma once
#include <string>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// What ISO 841 does not expect of the directions of axes named X, Y, Z, A, B, C, a sentence each: a positive
/// command that moves the tool against the part the other way, a rotary axis that turns about another one. It
/// is possible, and mostly the wrong sign in a machine file: the part would be mirrored.
std::vector<std::string> directions_beside_iso841(const Machine& machine);

}  // namespace trunnion
