#pragma once
#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// Where structure is left: runs without which only noise is. What only they ask for is named no more (README
/// of this layer, "Held out").
/// `left_out`: outliers, as propose_formula takes them.
void blame_odd_runs(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                    Diagnosis& d, const EffectSearch& search);

}  // namespace trunnion::diagnosis
