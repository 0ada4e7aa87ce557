#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/diagnose.hpp"

namespace trunnion::diagnosis {

/// Of one quantity, um or urad; NaN where it was not measured.
struct ResidualSize {
  double rms = std::nan(""), p95 = std::nan(""), largest = std::nan("");
};

struct RunResidual {
  std::string run_id;
  std::size_t readings = 0;
  ResidualSize displacement, rotation;
  double chi2 = 0.0;
};

struct RowResidual {
  std::string file, run_id;
  std::uint32_t row = 0;  // line of the file
  JointVector q;
  double residual = 0.0;    // um or urad
  double normalised = 0.0;  // over its uncertainty
  Quantity quantity = Quantity::displacement;
};

/// How well a model as it stands explains measurements (set-ups fitted, nothing else).
struct Evaluation {
  ResidualSize displacement, rotation;
  double chi2 = 0.0, dof = 0.0, p_value = 1.0;  // against the stated uncertainty
  /// Lack of fit against repeated readings; nothing without repeats.
  std::optional<double> replicate_p, replicate_um;
  std::string verdict;  // one sentence
  /// Where these readings lie beyond those that the model is from, as `beyond_measured` says it.
  std::string beyond;
  std::vector<RunResidual> runs;
  std::vector<RowResidual> worst;
  std::vector<Dependence> by_covariate;  // all tried, the surest first
};
Evaluation evaluate(const Machine& machine, const Dataset& data, const Model& model, std::size_t worst = 20);

}  // namespace trunnion::diagnosis
