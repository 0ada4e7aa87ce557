#pragma once
#include <string>

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// What is wrong with the rows themselves: the same readings twice, readings that contradict each other.
/// Empty when nothing is.
std::string contradiction(const Observations& observations);

/// Rows that cannot be right, a sentence each, file:row first: positions outside the travel, a clock that was
/// set back, a reading that does not move with the machine, single readings far off. At most a few of each
/// kind.
std::vector<std::string> row_problems(const Observations& observations);

/// Runs that state one sense of an axis (`dir_`) throughout, which its positions do not go in. That is a
/// column that was not written, or every place was approached from one side.
struct OneSidedSense {
  std::size_t run = 0;
  AxisId axis = 0;
};
std::vector<OneSidedSense> one_sided_senses(const Observations& observations);

/// Of each reading, whether it is a single one far off.
std::vector<bool> far_readings(const Observations& observations);

}  // namespace trunnion::diagnosis
