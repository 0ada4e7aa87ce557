#include "trunnion/post/axes_of.hpp"

namespace trunnion::post {

nc::Controller with_axes_of(const Machine& machine, nc::Controller controller) {
  for (const Axis& axis : machine.axes) {
    const auto letter = nc::axis_letter(axis.name);
    if (letter && !axis.cyclic)
      controller.rotary.modulo_axes =
          static_cast<std::uint16_t>(controller.rotary.modulo_axes & ~nc::AxisWords::bit(*letter));
  }
  controller.tcp.unknown_at_start = controller.tcp.switches_kinematics && machine.switchable_kinematics;
  controller.tcp.has_one_kinematics = controller.tcp.switches_kinematics && !machine.switchable_kinematics;
  return controller;
}

}  // namespace trunnion::post
