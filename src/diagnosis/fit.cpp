#include "trunnion/diagnosis/fit.hpp"

#include <cmath>

#include "diagnosis/fit_core.hpp"

namespace trunnion::diagnosis {

Fit fit(const Machine& machine, const Dataset& data, const Model& model, const FitOptions& options) {
  const Observations observations(machine, data);
  const FitCore core = fit_core(observations, model, options);
  Fit out;
  out.model = core.model;
  for (std::size_t k = 0; k < core.free.size(); ++k) {
    ParameterValue& p = out.model.effects[core.free[k].effect].parameters[core.free[k].index];
    const auto i = static_cast<Eigen::Index>(k);
    p.given = true;
    p.sigma = core.determined[k] ? std::optional(std::sqrt(core.covariance(i, i))) : std::nullopt;
    if (core.determined[k]) ++out.parameter_count;
  }
  out.setup_P = core.whitening->setup_of(core.raw);
  const VectorXd white = core.white.head(observations.size());
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    out.residual.push_back(core.raw[i] -
                           observations.setup_row(i).dot(out.setup_P[observations.state(i).run]));
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
