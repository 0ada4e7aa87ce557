#pragma once
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

struct FitCore;

/// Waves along a range that are looked for: cycles, and from one to the next, so that their lines overlap.
inline constexpr double kSlowestWave = 1.5, kFastestWave = 16.0, kWaveStep = 0.5;

/// Smooth functions of one covariate (or a pair) in one or all components of the deviation that the readings
/// see.
struct StructureBlock {
  std::string covariate;  // "C", "X x Z", "time", "direction of A", ...
  bool pair = false;
  int degree = 0;
  bool single = false;                        // one component of several: lies within another block
  std::shared_ptr<const MatrixXd> functions;  // N x f
  std::shared_ptr<const MatrixXd> weights;    // N x components
  Eigen::Index first = 0, count = 0;          // of the components

  Eigen::Index width() const { return functions->cols() * count; }
  /// Raw, N x width: made when it is asked for, since all blocks together are large.
  MatrixXd columns() const;
};

/// How much two covariates vary together: the number of places on a grid of 8 x 8 whose readings a sum of one
/// function of each does not explain already; 0 where one is at rest whenever the other moves.
int joint_variation(const VectorXd& a, const VectorXd& b);

/// Every block that these data can excite: each axis position, direction, velocity, time, speed, sensor, tool
/// length, direction of sensitivity, runs; then pairs of axes. Low degrees and single components stand as
/// blocks of their own beside the full ones, for power.
std::vector<StructureBlock> structure_blocks(const Observations& observations);

/// A smooth surrogate for anything that may be missing: the lowest degrees of all blocks, at most `limit`
/// columns, as FitCore::projected leaves them. Noise is judged beside it, so that a missing effect is not
/// taken for noise.
MatrixXd smooth_surrogate(const Observations& observations, const FitCore& fit, Eigen::Index limit);
MatrixXd smooth_surrogate(std::vector<StructureBlock> blocks, const FitCore& fit, Eigen::Index limit);

}  // namespace trunnion::diagnosis
