#pragma once
#include "trunnion/effects/model.hpp"

namespace trunnion {

/// The model does something: all axes are late, or one of the parameters of an effect is not 0, or it is a
/// table or a formula without parameters.
bool has_values(const Model& model);

}  // namespace trunnion
