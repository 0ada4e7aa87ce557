#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/fit/heldout.hpp"

namespace trunnion::diagnosis {

/// Every effect of the library as if it alone were added: the members of `found` first, then by p-value.
std::vector<RankedEffect> ranking(const Atoms& atoms, const Search& search, const NoiseScale& noise,
                                  const EffectSet& found, double alpha);

/// Parameters of a member as they are printed.
std::vector<RankedParameter> printed_parameters(const Effect& effect, const std::vector<double>& values,
                                                const std::vector<double>& sigmas,
                                                const std::vector<double>& shape);

}  // namespace trunnion::diagnosis
