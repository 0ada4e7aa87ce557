#include "post/prepare/compensators.hpp"

namespace trunnion::post {

Compensators::LargestEffect Compensators::largest_effect(const MachineState& at, double length_mm) const {
  const Vec3 tool_mm(0.0, 0.0, -length_mm);
  const Vec3 nominal_P = TableKinematics(machine_, tool_mm).pose(at.q).tip_P;
  LargestEffect out;
  for (const ModelEffect& effect : model_.effects) {
    Model alone = model_;
    alone.effects = {effect};
    const double tip_mm = (path::Compensator(machine_, alone, tool_mm).actual(at).tip_P - nominal_P).norm();
    if (tip_mm > out.tip_mm) out = {effect.id(), tip_mm};
  }
  return out;
}

}  // namespace trunnion::post
