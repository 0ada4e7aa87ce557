#pragma once
#include "diagnosis/verdict/unrecorded.hpp"

namespace trunnion::diagnosis {

/// Readings that wander (an instrument that drifts) against what was named, or follows a formula (README of
/// this layer): the set of named effects that is best beside such a noise. `named` must outlive the result.
/// Nothing where readings are too many or too few, or where the formula is needed beside the wander, too.
std::optional<InPlace> beside_wandering_readings(const Observations& observations, const FitCore& base,
                                                 const std::vector<ModelEffect>& named, const Diagnosis& d);

}  // namespace trunnion::diagnosis
