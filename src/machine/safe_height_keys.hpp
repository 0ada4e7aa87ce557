#pragma once
#include "trunnion/config/section.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// radius_mm and height_mm of [part].
void read_part_extent(config::Section& part, Machine& machine);
/// [retract] and [table], after the axes and chains are known.
void read_safe_height(config::Section& root, Machine& machine);

}  // namespace trunnion
