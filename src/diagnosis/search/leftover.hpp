#pragma once
#include <optional>

#include "diagnosis/fit/noise_scale.hpp"
#include "diagnosis/fit/twist_bank.hpp"
#include "diagnosis/search/structure.hpp"

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
    std::optional<TwistBank::Hit> twist = {};  // a test of the bank
  };
  std::vector<Test> tests;  // smallest p first
  double p = 1.0;           // smallest
  double drop = 0.0;        // of the block with the smallest p
  double tried = 1.0;       // independent tests that all of these amount to
  bool found(double alpha) const { return p < alpha; }
};

/// What a leftover is tested for.
struct Structures {
  std::vector<StructureBlock> blocks;
  TwistBank twists;
  /// Of each block's columns, scaled to length 1 before anything is taken out: their products without set-ups
  /// and base, and the scale.
  struct Freed {
    MatrixXd gram;
    VectorXd scale;
  };
  std::vector<Freed> freed;
  explicit Structures(const Observations& o) : blocks(structure_blocks(o)), twists(o) {}
  /// To be called before tests on another base; it must outlive them.
  void fit_to(const FitCore& base);
};

/// Tests every block and twist on what a set leaves; they are freed of base and set before.
Leftover leftover(const Atoms& atoms, const Remainder& set, const Structures& structures,
                  const NoiseScale& noise);

/// The same tests against another scale of the noise; both must be free of correlation.
Leftover rescaled(Leftover tests, const NoiseScale& from, const NoiseScale& to);

/// Noise beside a set, a smooth surrogate and whatever structure the stated uncertainty shows at once: what
/// is missing must not pass for noise.
struct Judgement {
  NoiseScale noise;
  Leftover left;  // against `noise`
};
Judgement judge(const Atoms& atoms, const Remainder& set, const Structures& structures,
                const MatrixXd& surrogate, std::uint64_t seed);

/// Lack of fit against repeated readings (same pose, direction of sensitivity and directions of motion):
/// p-value of the F test, 1 without repeats. `pure_variance`: of the repeats, whitened units.
struct Replicates {
  double p = 1.0, pure_variance = 1.0, pure_dof = 0.0;
};
Replicates replicates(const Observations& observations, const FitCore& fit, const VectorXd& white_residual,
                      double model_dof);

}  // namespace trunnion::diagnosis
