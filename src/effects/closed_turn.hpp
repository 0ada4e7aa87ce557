#pragma once
#include <vector>

#include "trunnion/effects/table.hpp"

namespace trunnion {

/// Nodes of a rotary axis (rad, ascending) that go around a whole turn, but for its end (0 to 330 deg every
/// 30). A gap that is wider than the widest step is a part of the turn that was not measured.
bool lacks_end_of_turn(const std::vector<double>& nodes);

/// The first node along u (`k` 0) or v (1) once more, a turn on, with its values.
void close_turn(Grid& grid, std::size_t k);

}  // namespace trunnion
