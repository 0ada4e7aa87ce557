#pragma once
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// The control as it is set up on this machine: an axis counts modulo one turn (`[rotary] modulo_axes`) only
/// where the machine file calls it cyclic. An axis with limits does not: a control that took the shorter way
/// there would run it into them (TNC 640: M126 acts on axes whose display is reduced to one turn).
nc::Controller with_axes_of(const Machine& machine, nc::Controller controller);

}  // namespace trunnion::post
