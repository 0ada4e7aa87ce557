#include "trunnion/diagnosis/fit.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/fit/measured_tools.hpp"
#include "diagnosis/fit/usual_size.hpp"

namespace trunnion::diagnosis {
namespace {

// Where the readings were that the fitted numbers are from: those of this fit, and those of an earlier one
// where it keeps some of the numbers.
MeasuredRanges valid_ranges(const Observations& o, const Model& given) {
  const MeasuredRanges here = ranges_of_readings(o.machine(), o.data());
  const bool keeps = std::any_of(given.effects.begin(), given.effects.end(), [](const ModelEffect& effect) {
    return std::any_of(effect.parameters.begin(), effect.parameters.end(),
                       [](const ParameterValue& p) { return p.fixed || p.prior; });
  });
  return keeps ? joined(given.valid, here) : here;
}

}  // namespace

Fit fit(const Machine& machine, const Dataset& data, const Model& given, const FitOptions& options) {
  return fit(Observations(machine, data), given, options);
}

Fit fit(const Observations& observations, const Model& given, const FitOptions& options) {
  const Model model = with_best_variants(observations, given);
  FitCore own = fit_core(observations, model, options);
  Fit out;
  out.null_directions = open_directions(observations, own);
  const std::vector<bool> determined = own.determined;
  const SizedFit sized = with_usual_sizes(observations, model, std::move(own), options);
  const FitCore& core = sized.core;
  out.model = core.model;
  out.model.valid = valid_ranges(observations, given);
  out.sigma_factor = sized.sigma_factor;
  for (std::size_t k = 0; k < core.free.size(); ++k) {
    ParameterValue& p = out.model.effects[core.free[k].effect].parameters[core.free[k].index];
    const auto i = static_cast<Eigen::Index>(k);
    p.given = true;
    p.prior = core.free[k].prior && model.effects[core.free[k].effect].parameters[core.free[k].index].prior;
    p.sigma =
        determined[k] ? std::optional(std::sqrt(core.covariance(i, i)) * out.sigma_factor) : std::nullopt;
    if (determined[k]) ++out.parameter_count;
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
  out.chi2 = sized.chi2;
  out.dof = sized.dof;
  out.common = core.common;
  out.converged = core.converged;
  return out;
}

}  // namespace trunnion::diagnosis
