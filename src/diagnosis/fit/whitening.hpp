#pragma once
#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// What is taken for the covariance of the readings: C = diag(u^2) + sum over groups of c c' (README of this
/// layer, "Covariance").
struct NoiseModel {
  VectorXd u;              // standard deviation of each reading, > 0
  VectorXd common;         // of the offset that its group shares
  std::vector<bool> used;  // false: an outlier, without weight

  Eigen::Index used_count() const;
};

/// The step of the readings of one quantity (mm, rad), where all are whole multiples of one: of the display,
/// or of the digits in the file. 0 without one, or with fewer than 20 readings.
double resolution(const Observations& observations, Quantity quantity);

/// As the data state it; unknown common offsets get the given standard deviations (displacement in mm,
/// rotation in rad).
NoiseModel stated_noise(const Observations& observations, double unknown_mm, double unknown_rad);

/// The map x -> Q C^-1/2 x, where Q takes out each run's set-up translation. Orthogonal projection after
/// whitening, so that least squares on mapped columns is generalised least squares with a free set-up.
class Whitening {
 public:
  Whitening(const Observations& observations, NoiseModel noise, bool free_setup);

  const NoiseModel& noise() const { return noise_; }
  /// In place; readings without weight become 0.
  void apply(Eigen::Ref<MatrixXd> columns) const;
  VectorXd applied(const VectorXd& x) const;
  MatrixXd applied(MatrixXd x) const {
    apply(x);
    return x;
  }
  /// Q only: takes the set-ups out of what is whitened already.
  void take_setups(Eigen::Ref<MatrixXd> whitened) const;
  /// C^-1/2 only.
  void whiten(Eigen::Ref<MatrixXd> columns) const;
  /// The same in two steps: rows divided by u (0 where a reading has no weight), then `mix`, which is
  /// symmetric.
  const VectorXd& inverse_u() const { return inverse_u_; }
  void mix(Eigen::Ref<MatrixXd> columns) const;
  /// Of each reading: its share in the offset of its group, after division by u.
  const VectorXd& shared() const { return shared_; }
  /// Orthonormal basis of a run's set-up in the whitened rows of that run.
  const MatrixXd& setup_basis(std::size_t run) const { return runs_[run].basis; }
  bool free_setup() const { return !runs_.empty(); }
  /// Dimensions that the set-ups take, all runs together.
  Eigen::Index setup_rank() const { return setup_rank_; }
  /// ln |C| + ln |S' C^-1 S| (of the readings with weight): for the restricted likelihood.
  double log_determinant() const { return log_determinant_; }
  /// Set-up translation of each run that fits `residual` (raw) best, in P, mm; 0 in directions that were not
  /// measured.
  std::vector<Vec3> setup_of(const VectorXd& residual) const;

 private:
  struct Run {
    MatrixXd basis;     // n x rank, orthonormal, whitened
    MatrixXd to_setup;  // 3 x rank
  };
  void make_setup_bases();
  const Observations* observations_;
  NoiseModel noise_;
  VectorXd inverse_u_;
  VectorXd shared_;             // common / u
  std::vector<double> shrink_;  // per group
  std::vector<Run> runs_;
  Eigen::Index setup_rank_ = 0;
  double log_determinant_ = 0.0;
};

}  // namespace trunnion::diagnosis
