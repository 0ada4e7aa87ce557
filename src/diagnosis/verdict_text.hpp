#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/search.hpp"

namespace trunnion::diagnosis {

/// What a person should know and do, for the verdict that `d` holds.
std::string paragraph(const Diagnosis& d, const Atoms& atoms, const EffectSet& found);

/// "1.2 um and 3.4 urad RMS": what was measured.
std::string sizes_text(std::optional<double> um, std::optional<double> urad);

/// 3 significant digits.
std::string short_number(double value);

/// What to put right, of the verdict `bookkeeping`.
std::string bookkeeping_text(const std::vector<Bookkeeping>& all);

}  // namespace trunnion::diagnosis
