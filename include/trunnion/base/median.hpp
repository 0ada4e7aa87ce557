#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace trunnion {

/// Median of the sizes of a Gaussian's deviations to its standard deviation.
inline constexpr double kMadToSigma = 1.4826;

/// The middle value; of an even number of them the larger one of the two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace trunnion
