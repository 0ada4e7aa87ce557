#include "trunnion/effects/model_values.hpp"

#include <algorithm>

namespace trunnion {

bool has_values(const Model& model) {
  return model.lag_of_all_axes_s != 0.0 ||
         std::any_of(model.effects.begin(), model.effects.end(), [](const ModelEffect& e) {
           const auto linear = static_cast<std::ptrdiff_t>(e.effect->info().linear_count());
           return linear == 0 || std::any_of(e.parameters.begin(), e.parameters.begin() + linear,
                                             [](const ParameterValue& p) { return p.value != 0.0; });
         });
}

}  // namespace trunnion
