#include "trunnion/effects/axis_lags.hpp"

#include <string_view>

namespace trunnion {
namespace {

constexpr std::string_view kLag = "servo_lag:", kSpike = "reversal_spike:";

}  // namespace

JointVector axis_lags(const Model& model) {
  JointVector out;
  for (const ModelEffect& e : model.effects)
    if (e.effect->info().id.starts_with(kLag)) out[e.effect->link().axis] += e.parameters.front().value;
  return out;
}

Model without_servo_effects(const Model& model) {
  return filtered(model, [](const EffectInfo& info) {
    return !info.id.starts_with(kLag) && !info.id.starts_with(kSpike);
  });
}

}  // namespace trunnion
