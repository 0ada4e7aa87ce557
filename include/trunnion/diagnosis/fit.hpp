#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::diagnosis {

struct FitOptions {
  bool robust = true;       // flag outliers and leave them out
  int max_iterations = 12;  // Gauss-Newton steps of the exact forward model
};

/// A combination of parameters that no reading sees.
struct NullDirection {
  std::string words;  // for a person
  struct Part {
    std::string effect, parameter;
    double share = 0.0;  // internal units, the largest scaled to its usual magnitude
  };
  std::vector<Part> parts;
};

/// Standard deviations of the shared offsets whose `u_common` the data leave open.
struct EstimatedCommon {
  std::optional<double> displacement_mm, rotation_rad;
};

/// Generalised least squares of a model's parameters (README of this layer, "Fit").
struct Fit {
  Model model;  // values and sigmas filled in; sigma empty where the data (and priors) do not determine a
                // parameter
  std::vector<Vec3> setup_P;  // of each run, mm
  /// Of each reading: value - prediction - set-up, without the offset of its group where the data had to tell
  /// how large such offsets are; mm, rad.
  std::vector<double> residual;
  std::vector<double> normalised;  // whitened residual of each reading, about 1 for noise
  std::vector<bool> outlier;       // of each reading
  double chi2 = 0.0;
  double dof = 0.0;
  /// By which the parameters' standard uncertainties are larger than the stated ones of the readings make
  /// them: root of chi-square per degree of freedom where that is too large, else 1.
  double sigma_factor = 1.0;
  std::size_t parameter_count = 0;  // determined ones, without the set-ups
  EstimatedCommon common;
  std::vector<NullDirection> null_directions;
  bool converged = true;
};

/// Fits all parameters that are not fixed, from the model's values. Deterministic.
Fit fit(const Machine& machine, const Dataset& data, const Model& model, const FitOptions& options = {});

}  // namespace trunnion::diagnosis
