#pragma once
#include <string>

#include "diagnosis/observations.hpp"

namespace trunnion::diagnosis {

/// What is wrong with the rows themselves: the same readings twice, readings that contradict each other.
/// Empty when nothing is.
std::string contradiction(const Observations& observations);

}  // namespace trunnion::diagnosis
