#pragma once
#include <memory>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/effects/effect.hpp"

namespace trunnion {

/// One run of the data, as effects see it: what shares one set-up.
struct RunInfo {
  std::string id;
  double duration_s = 0.0;  // the last time of the run
};

/// What the data offer to effects: sensors and runs. Empty for a program without a temperature log.
struct EffectContext {
  StateNames names;
  std::vector<RunInfo> runs;
};

/// All instances of one id. Most have one; where an effect has a discrete choice (component and carrying axis
/// of a cross-talk, sensor of a thermal location, run of a step) there is one variant for each, and a fit
/// takes the best of them.
struct EffectFamily {
  std::vector<std::shared_ptr<const Effect>> variants;  // at least one
  const EffectInfo& info() const { return variants.front()->info(); }
  const std::string& id() const { return info().id; }
};

/// Every effect of the library that this machine and these data can have (README of this layer), in a fixed
/// order: by file name, then by axis. Effects that need a sensor which `context` lacks are left out.
std::vector<EffectFamily> effect_library(const Machine& machine, const EffectContext& context);

/// One instance by its id and variant keys ({"component", "EZX"}, ...); unlike `effect_library` it makes
/// instances for sensors and runs outside `context` too, which it appends there. Fails with wrong_input,
/// saying what is unknown and what there is.
Result<std::shared_ptr<const Effect>> make_effect(
    const Machine& machine, EffectContext& context, const std::string& id,
    const std::vector<std::pair<std::string, std::string>>& variant = {});

/// Canonical ISO symbol: X0C, XOC, EX0C -> X0C; EXX stays; anything else comes back as it is.
std::string canonical_symbol(std::string_view symbol);

}  // namespace trunnion
