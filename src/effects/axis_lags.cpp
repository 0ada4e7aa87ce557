#include "trunnion/effects/axis_lags.hpp"

#include <string_view>

namespace trunnion {
namespace {

constexpr std::string_view kLag = "servo_lag:", kSpike = "reversal_spike:";

}  // namespace

JointVector axis_lags(const Model& model) {
  JointVector out;
  for (AxisId id = 0; id < model.axes.size(); ++id) out[id] = model.lag_of_all_axes_s;
  for (const ModelEffect& e : model.effects)
    if (e.effect->info().id.starts_with(kLag)) out[e.effect->link().axis] += e.parameters.front().value;
  return out;
}

Model without_servo_effects(const Model& model) {
  Model out = filtered(model, [](const EffectInfo& info) {
    return !info.id.starts_with(kLag) && !info.id.starts_with(kSpike);
  });
  out.lag_of_all_axes_s = 0.0;
  return out;
}

}  // namespace trunnion
