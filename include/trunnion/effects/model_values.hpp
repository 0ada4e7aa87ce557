#pragma once
#include "trunnion/effects/model.hpp"

namespace trunnion {

/// An effect of the model does something: one of its parameters is not 0, or it is a table or a formula
/// without parameters.
bool has_values(const Model& model);

}  // namespace trunnion
