#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace trunnion::diagnosis {

class Observations;

/// Which readings are taken together (README of this layer, "Very many readings").
struct Bins {
  std::vector<std::vector<Eigen::Index>> members;  // of each bin, in the order of the readings
  /// Readings that stand out from those that they would be taken together with: in no bin.
  std::vector<Eigen::Index> far;
};

/// Readings from which on some are taken together.
inline constexpr Eigen::Index kMostSingly = 5000;

/// About kMostSingly bins of readings of one group (or, where each has a direction of its own, of one run and
/// quantity) and the same senses of motion, that are near each other in pose, time and speeds. Deterministic.
Bins bins_of(const Observations& observations);

}  // namespace trunnion::diagnosis
