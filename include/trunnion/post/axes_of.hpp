#pragma once
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// The control as it is set up on this machine: an axis counts modulo one turn (`[rotary] modulo_axes`) only
/// where the machine file calls it cyclic. An axis with limits does not: a control that took the shorter way
/// there would run it into them (TNC 640: M126 acts on axes whose display is reduced to one turn). Words that
/// switch between kinematics ([tcp] switches_kinematics): where the machine file says that the control has
/// both
/// ([machine] switchable_kinematics) nobody knows which of them is active where a program begins.
nc::Controller with_axes_of(const Machine& machine, nc::Controller controller);

}  // namespace trunnion::post
