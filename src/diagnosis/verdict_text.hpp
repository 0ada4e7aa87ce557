#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/search.hpp"

namespace trunnion::diagnosis {

/// What a person should know and do, for the verdict that `d` holds.
std::string paragraph(const Diagnosis& d, const Atoms& atoms, const EffectSet& found);

/// 3 significant digits.
std::string short_number(double value);

}  // namespace trunnion::diagnosis
