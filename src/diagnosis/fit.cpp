#include "trunnion/diagnosis/fit.hpp"

#include <cmath>

#include "diagnosis/fit_core.hpp"
#include "diagnosis/statistics.hpp"

namespace trunnion::diagnosis {

namespace {

// Where the model does not explain the readings within their uncertainty, its parameters are as uncertain as
// the residual says.
double sigma_factor(double chi2, double dof) {
  constexpr double kTooLarge = 1.25, kChance = 1e-4;
  if (dof < 1.0 || chi2 < kTooLarge * dof || chi2_tail(chi2, dof) > kChance) return 1.0;
  return std::sqrt(chi2 / dof);
}

}  // namespace

Fit fit(const Machine& machine, const Dataset& data, const Model& model, const FitOptions& options) {
  const Observations observations(machine, data);
  const FitCore core = fit_core(observations, model, options);
  Fit out;
  out.model = core.model;
  out.sigma_factor = sigma_factor(core.chi2(), core.dof());
  for (std::size_t k = 0; k < core.free.size(); ++k) {
    ParameterValue& p = out.model.effects[core.free[k].effect].parameters[core.free[k].index];
    const auto i = static_cast<Eigen::Index>(k);
    p.given = true;
    p.sigma = core.determined[k] ? std::optional(std::sqrt(core.covariance(i, i)) * out.sigma_factor)
                                 : std::nullopt;
    if (core.determined[k]) ++out.parameter_count;
  }
  out.setup_P = core.whitening->setup_of(core.raw);
  const VectorXd white = core.white.head(observations.size());
  const VectorXd plain = plain_residual(observations, core);
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    out.residual.push_back(plain[i]);
    out.normalised.push_back(
        core.whitening->noise().used[at] ? white[i] : out.residual.back() / core.whitening->noise().u[i]);
    out.outlier.push_back(!core.whitening->noise().used[at]);
  }
  out.chi2 = core.chi2();
  out.dof = core.dof();
  out.common = core.common;
  out.null_directions = null_directions(observations, core);
  out.converged = core.converged;
  return out;
}

}  // namespace trunnion::diagnosis
