#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/effects/library.hpp"

#include "diagnosis/fit_core.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kAlike = 1e-9;

const EffectFamily* family_of(const std::vector<EffectFamily>& library, const std::string& id) {
  const auto found =
      std::find_if(library.begin(), library.end(), [&](const EffectFamily& f) { return f.id() == id; });
  return found == library.end() ? nullptr : &*found;
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
    std::shared_ptr<const Effect> best = model.effects[e].effect;
    for (const auto& variant : family->variants) {
      model.effects[e].effect = variant;
      // Of two that these readings cannot tell apart the first.
      const double chi2 = fit_core(o, model, {.robust = false}).chi2();
      if (chi2 < least * (1.0 - kAlike)) least = chi2, best = variant;
    }
    model.effects[e].effect = best;
    model.effects[e].variant_given = true;
  }
  return model;
}

}  // namespace trunnion::diagnosis
