#pragma once
#include <string>

#include "diagnosis/observations.hpp"

namespace trunnion::diagnosis {

/// Smooth functions of one covariate (or a pair), one set for each component of the deviation that the
/// readings see.
struct StructureBlock {
  std::string covariate;  // "C", "X x Z", "time", "direction of A", ...
  bool pair = false;
  int degree = 0;
  MatrixXd columns;  // raw, N x k
};

/// Every block that these data can excite: each axis position, direction, velocity, time, speed, sensor, tool
/// length, direction of sensitivity, runs; then pairs of axes. Low degrees stand as blocks of their own
/// beside the full ones, for power.
std::vector<StructureBlock> structure_blocks(const Observations& observations);

/// A smooth surrogate for anything that may be missing: the lowest degrees of all blocks, at most `limit`
/// columns. Noise is judged beside it, so that a missing effect is not taken for noise.
MatrixXd smooth_surrogate(const Observations& observations, Eigen::Index limit);

}  // namespace trunnion::diagnosis
