#pragma once
#include "diagnosis/noise_scale.hpp"
#include "diagnosis/structure.hpp"

namespace trunnion::diagnosis {

/// Smooth structure in a residual, block by block.
struct Leftover {
  struct Test {
    std::string covariate;
    double p = 1.0;     // over all blocks
    double drop = 0.0;  // noise units
    Eigen::Index rank = 0;
    std::size_t block = 0;    // of those tested
    bool neighbours = false;  // a test of neighbouring readings along an axis, by `z`
    double z = 0.0;
  };
  std::vector<Test> tests;  // smallest p first
  double p = 1.0;           // smallest
  double drop = 0.0;        // of the block with the smallest p
  bool found(double alpha) const { return p < alpha; }
};

/// Tests every block on what a set leaves; the blocks are freed of base and set before.
Leftover leftover(const Atoms& atoms, const Remainder& set, const std::vector<StructureBlock>& blocks,
                  const NoiseScale& noise);

/// The same tests against another scale of the noise; both must be free of correlation.
Leftover rescaled(Leftover tests, const NoiseScale& from, const NoiseScale& to);

/// Noise beside a set, a smooth surrogate and whatever structure the stated uncertainty shows at once: what
/// is missing must not pass for noise.
struct Judgement {
  NoiseScale noise;
  Leftover left;  // against `noise`
};
Judgement judge(const Atoms& atoms, const Remainder& set, const std::vector<StructureBlock>& blocks,
                const MatrixXd& surrogate, std::uint64_t seed);

/// Lack of fit against repeated readings (same pose, direction of sensitivity and directions of motion):
/// p-value of the F test, 1 without repeats. `pure_variance`: of the repeats, whitened units.
struct Replicates {
  double p = 1.0, pure_variance = 1.0, pure_dof = 0.0;
};
Replicates replicates(const Observations& observations, const FitCore& fit, const VectorXd& white_residual,
                      double model_dof);

}  // namespace trunnion::diagnosis
