#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::diagnosis {

/// What `measurement_template` knows: "laser", "rtest", "ballbar", "probe".
std::vector<std::string> template_kinds();

/// A measurement file (CSV) of this machine with the poses of an ordinary campaign and no readings yet:
/// `value` is to be filled in, in um or urad or in the unit that `unit` is changed to. `laser`: every linear
/// axis there and back, along itself and across; `rtest`: a ball on the table, followed over all rotary
/// positions, along X, Y and Z; `ballbar`: circles of every two linear axes, radial; `probe`: the ball of the
/// R-test touched from five sides. Fails where the machine has no axes for it, or a ball is out of its reach.
/// @param kind  one of template_kinds()
Result<std::string> measurement_template(const Machine& machine, std::string_view kind);

}  // namespace trunnion::diagnosis
