#pragma once
#include <optional>
#include <span>

#include "trunnion/machine/machine.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// `machine` without the limits of its rotary axes that are so many turns apart that LayerSearch leaves some
/// out; nothing where it has none such.
///
/// A choice on this machine is one on `machine`, too, where it keeps `far_limits`: no limit costs less time
/// than none, so that no way within them is shorter. Its price is that of an axis that turns for ever.
std::optional<Machine> without_far_limits(const Machine& machine);

/// The axes stay a turn away from the limits that `without_far_limits` took: neither they nor any way between
/// two of the positions comes to one.
bool keeps_far_limits(const Machine& machine, std::span<const ChosenPoint> chosen);

}  // namespace trunnion::path
