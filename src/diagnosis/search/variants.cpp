#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/effects/library.hpp"

#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kSameFit = 1e-9;

const EffectFamily* family_of(const std::vector<EffectFamily>& library, const std::string& id) {
  const auto found =
      std::find_if(library.begin(), library.end(), [&](const EffectFamily& f) { return f.id() == id; });
  return found == library.end() ? nullptr : &*found;
}

// The effect as this variant, which may have parameters that the others lack: values go by their names.
ModelEffect as_variant(const ModelEffect& given, const std::shared_ptr<const Effect>& variant) {
  ModelEffect out = given;
  out.effect = variant;
  out.parameters = model_effect(variant).parameters;
  const auto& names = given.effect->info().parameters;
  for (std::size_t k = 0; k < out.parameters.size(); ++k) {
    const auto same = std::find_if(names.begin(), names.end(), [&](const Parameter& p) {
      return p.key() == variant->info().parameters[k].key();
    });
    if (same != names.end())
      out.parameters[k] = given.parameters[static_cast<std::size_t>(same - names.begin())];
  }
  return out;
}

}  // namespace

Model with_best_variants(const Observations& o, Model model) {
  if (std::all_of(model.effects.begin(), model.effects.end(),
                  [](const ModelEffect& e) { return e.variant_given; }))
    return model;
  const auto library = effect_library(o.machine(), o.data().context);
  for (std::size_t e = 0; e < model.effects.size(); ++e) {
    if (model.effects[e].variant_given) continue;
    const EffectFamily* family = family_of(library, model.effects[e].id());
    if (family == nullptr) continue;
    double least = std::numeric_limits<double>::max();
    const ModelEffect asked = model.effects[e];
    ModelEffect best = asked;
    for (const auto& variant : family->variants) {
      model.effects[e] = as_variant(asked, variant);
      // Of two that these readings cannot tell apart the first.
      const double chi2 = fit_core(o, model, {.robust = false}).chi2();
      if (chi2 < least * (1.0 - kSameFit)) least = chi2, best = model.effects[e];
    }
    model.effects[e] = std::move(best);
    model.effects[e].variant_given = true;
  }
  return model;
}

const ModelEffect* find_effect(const Model& model, const EffectInfo& info) {
  const auto found = std::find_if(model.effects.begin(), model.effects.end(), [&](const ModelEffect& known) {
    return known.id() == info.id && known.effect->info().variant == info.variant;
  });
  return found == model.effects.end() ? nullptr : &*found;
}

}  // namespace trunnion::diagnosis
