#pragma once
#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// Where a thermal effect is named: whether a tool or ball that stands wrong by a constant would do as well
/// (README of this layer, "What stands between tools only"). Then it is `ambiguous`, or `not_in_library`
/// where the tool does better.
void doubt_between_tools(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                         Diagnosis& d);

}  // namespace trunnion::diagnosis
