#pragma once
#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {

/// Of the effects that were named those that are still needed when a formula stands beside them: functions of
/// the library imitate a part of what the library lacks, and do nothing any more beside the formula. One
/// after the other is left out, the least needed first, while chi-square rises by no more than its parameters
/// pay (ln N each) and noise explains.
std::vector<ModelEffect> needed_beside(const Observations& observations, const Model& base,
                                       const std::vector<ModelEffect>& named,
                                       const std::vector<ModelEffect>& formula,
                                       const std::vector<bool>& left_out);

}  // namespace trunnion::diagnosis
