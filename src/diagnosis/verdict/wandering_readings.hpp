#pragma once
#include "diagnosis/verdict/unrecorded.hpp"

namespace trunnion::diagnosis {

/// What was named, or followed by a formula, against readings that wander (an instrument that drifts): the
/// best set of the named effects beside such a noise. `named` and the result's condition, which `out` holds,
/// must outlive it. Nothing where there are too many readings, or nothing to compare.
std::optional<InPlace> beside_wandering_readings(const Observations& observations, const FitCore& base,
                                                 const std::vector<ModelEffect>& named, const Diagnosis& d,
                                                 UnrecordedCondition& out);

}  // namespace trunnion::diagnosis
