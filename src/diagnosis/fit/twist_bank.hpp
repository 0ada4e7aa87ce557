#pragma once
#include <optional>

#include "diagnosis/fit/noise_scale.hpp"
#include "diagnosis/search/atoms.hpp"
#include "diagnosis/search/state_functions.hpp"

namespace trunnion::diagnosis {

/// Every twist of every joint as a function of the state: what an effect that nobody thought of would be
/// (README of this layer, "Leftover"). Thousands of small tests; the best of each covariate is what counts.
class TwistBank {
 public:
  explicit TwistBank(const Observations& observations);

  struct Hit {
    std::size_t functions = 0, weight = 0, span = 0;
    double drop = 0.0;  // noise units
    Eigen::Index rank = 0;
    double p = 1.0;  // of this one test
  };
  /// Frees the columns of set-ups and base, once for all sets of effects.
  void fit_to(const FitCore& base);

  /// The best test of each set of functions on what a set of effects leaves of the base's residual.
  std::vector<Hit> best(const Atoms& atoms, const Remainder& set, const NoiseScale& noise) const;
  /// The one test that explains most of what the readings of a fit are off by beyond their uncertainty, where
  /// that is more than half of it: readings that stand out have one cause. Fits the bank to `all`.
  std::optional<Hit> common_cause(const FitCore& all);
  const std::string& covariate(const Hit& hit) const { return functions_[hit.functions].covariate; }
  /// Raw columns of a test.
  MatrixXd columns(const Hit& hit) const;
  /// Number of tests.
  std::size_t count() const { return count_; }

 private:
  struct Task {
    std::size_t functions, weight;
    std::vector<Eigen::MatrixXf> gram;    // of each span: without set-ups and base
    std::vector<Eigen::VectorXf> before;  // squared lengths before
  };
  Eigen::MatrixXf divided(const Task& task, const FitCore& base) const;
  MatrixXd left_of(const Task& task, std::size_t span, const FitCore& base, const Remainder& set) const;
  const Observations& o_;
  std::vector<StateFunctions> functions_;
  Eigen::MatrixXf weights_;  // N x W: readings' answers to unit twists, without doubles
  std::vector<std::vector<std::size_t>> links_of_;  // of each weight: links that show it
  std::vector<Task> tasks_;
  std::size_t count_ = 0;
};

}  // namespace trunnion::diagnosis
