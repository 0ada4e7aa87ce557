#pragma once
#include "diagnosis/search/atoms.hpp"

namespace trunnion::diagnosis {

inline constexpr double kMostSurrogate = 150;  // columns beside which noise is judged
inline constexpr double kStatedDof = 1e4;      // the stated uncertainty, taken at its word

/// What the residual says of the noise beside the base, a set of effects and a smooth surrogate for all else.
struct NoiseScale {
  double variance = 1.0;  // of whitened readings, drawn towards 1 (the stated one) by kPriorDof
  double raw_variance = 1.0;
  double dof = 0.0;                                  // of raw_variance
  double phi = 0.0;                                  // correlation of successive readings, 0 unless sure
  std::vector<std::vector<Eigen::Index>> sequences;  // of readings, in time
  /// Degrees of freedom for tests against `variance`.
  double test_dof() const;
};

NoiseScale noise_scale(const Atoms& atoms, const Remainder& set, const MatrixXd& surrogate,
                       std::uint64_t seed);

/// Orthonormal basis of what both span; `set` is one already.
MatrixXd joined_basis(const MatrixXd& set, const MatrixXd& surrogate);

/// Test statistic of orthonormal columns U on residual r: b' (U'RU)^-1 b / variance with the correlation R of
/// the noise.
double corrected_drop(const MatrixXd& U, const VectorXd& r, const NoiseScale& noise);

}  // namespace trunnion::diagnosis
