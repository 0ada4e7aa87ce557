#pragma once
#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// Where effects of positions are named beside a steady drift: whether a drift that settles in each run,
/// which the library lacks, does without one of them (README of this layer, "What settles"). Then it is
/// `ambiguous`, or `not_in_library` where the one that settles does better.
void doubt_beside_settling(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                           Diagnosis& d);

}  // namespace trunnion::diagnosis
