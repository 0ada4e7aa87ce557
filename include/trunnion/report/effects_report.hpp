#pragma once
#include <string>
#include <vector>

#include "trunnion/effects/library.hpp"

namespace trunnion::report {

/// The library as JSON: an array `effects` of id, class, what, cause, remedy, contains, choices, parameters
/// (key, unit, role, usual, search range), in the order of the library.
std::string effects_json(const std::vector<EffectFamily>& library);

/// The same for people, effects of one kind together.
std::string effects_text(const std::vector<EffectFamily>& library);

}  // namespace trunnion::report
