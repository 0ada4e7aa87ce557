#pragma once
#include "trunnion/config/section.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::effects {

/// Reports each parameter whose value is beyond what a machine can have: it was given in another unit.
void check_sizes(config::Section& parameters, const ModelEffect& entry);

/// Reports an effect that gives no number wherever it is tried within the travel of `machine` (a formula `k /
/// 0`, a period of 0): it never will.
void try_out(config::Section& effect, const ModelEffect& entry, const Machine& machine,
             const EffectContext& context);

}  // namespace trunnion::effects
