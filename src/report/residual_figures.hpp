#pragma once
#include <string>
#include <vector>

#include "trunnion/diagnosis/fit.hpp"
#include "trunnion/report/page.hpp"

/// Plots of residuals: parts of the model pages.
namespace trunnion::report {

/// Residuals of all readings of a dataset; rotations in urad, that is um at 1 m.
struct Residuals {
  const Machine* machine = nullptr;
  const diagnosis::Dataset* data = nullptr;
  std::vector<double> um;          // of each reading
  std::vector<double> normalised;  // whitened
};
Residuals residuals_of(const Machine& machine, const diagnosis::Dataset& data, const diagnosis::Fit& fit);

/// The readings themselves, for the same plots.
Residuals readings_of(const Machine& machine, const diagnosis::Dataset& data);

/// One scale for vector plots that are to be compared.
struct VectorScale {
  double magnification = 1.0;
  double largest_um = 0.0;
};
VectorScale vector_scale(const Residuals& residuals);
/// Residual displacements at the measured points, machine axes: the readings of a row are added along their
/// directions.
SpacePlot residual_vectors(const Residuals& residuals, const VectorScale& scale);

/// Residual against every axis position that varies and against time, with a smooth line; coloured by run
/// where there are few, else by the direction of the axis. `first` are covariates to put in front, `what` the
/// name of the values.
std::vector<Figure> residual_against_covariates(const Residuals& residuals,
                                                const std::vector<std::string>& first,
                                                const std::string& what = "residual");

BoxPlot residual_by_run(const Residuals& residuals);

/// Quantiles of the normalised residual against the normal distribution's, with the band in which 95 of 100
/// samples of independent normal readings lie, place by place (simulated, fixed seed).
XyPlot normal_quantiles(const Residuals& residuals);

/// What each effect of the model does to the readings: n . deviation, um.
std::vector<std::vector<double>> contributions_um(const Machine& machine, const diagnosis::Dataset& data,
                                                  const Model& model);

/// Shapley shares of the mean square of the sum of the contributions, um^2. Contributions add, so the share
/// of an effect is its mean product with the whole: exact, and the order of effects does not matter.
std::vector<double> shapley_shares(const std::vector<std::vector<double>>& contributions);

}  // namespace trunnion::report
