#pragma once
#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {

/// Times its usual magnitude: an effect that is larger costs evidence, slowly.
inline constexpr double kFarFromUsual = 10.0;

/// A fit whose parameters stay near their usual size where the readings do not decide.
struct SizedFit {
  FitCore core;                  // the fit as it was, or the one beside priors of the usual size
  double sigma_factor = 1.0;     // of the standard deviations in `core.covariance`
  double chi2 = 0.0, dof = 0.0;  // of the readings alone
};

/// `fit` started from `start`. Where it leaves a combination of parameters more uncertain than its usual
/// size, every linear parameter of the library gets a prior around its value in `start`, three times its
/// usual size wide (wider for an effect that is sure to be larger), and the fit is made again. Else nothing
/// changes.
/// @param options  those that the fit was made with
SizedFit with_usual_sizes(const Observations& observations, const Model& start, FitCore fit,
                          const FitOptions& options = {});

/// Usual sizes of the free parameters (internal units); 0 where nobody knows one (shapes, formulas of the
/// user) or the file says better (a prior).
VectorXd usual_sizes(const FitCore& fit);

/// A linear parameter is larger than so many times its usual size.
bool is_beyond_usual(const ModelEffect& effect, double times);

/// By which the uncertainties are larger than the stated ones of the readings make them: the root of
/// chi-square per degree of freedom where that is sure to be too large, else 1.
double sigma_factor(double chi2, double dof);

/// Combinations of parameters that these readings leave more uncertain than their usual size, as columns
/// (internal units): what they see a little, not at all (`FitCore::null_vectors`) left out.
MatrixXd undecided(const FitCore& fit);

/// Both kinds in words: what no reading sees, then what these readings hardly see.
std::vector<NullDirection> open_directions(const Observations& observations, const FitCore& fit);

}  // namespace trunnion::diagnosis
