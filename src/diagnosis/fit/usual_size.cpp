#include "diagnosis/fit/usual_size.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kWideInUsual = 3.0;  // usual sizes: a prior that an ordinary machine does not feel
constexpr double kDecided = 0.3;  // of the prior's width: below, the readings say how large a parameter is

const Parameter& parameter_of(const FitCore& fit, std::size_t k) {
  return fit.model.effects[fit.free[k].effect].effect->info().parameters[fit.free[k].index];
}

// Covariance in usual sizes; parameters without one stay out.
MatrixXd relative_covariance(const FitCore& fit) {
  VectorXd inverse = usual_sizes(fit);
  for (double& u : inverse) u = u > 0.0 ? 1.0 / u : 0.0;
  const double factor = fit.converged ? sigma_factor(fit.chi2(), fit.dof()) : 1.0;
  return factor * factor * (inverse.asDiagonal() * fit.covariance * inverse.asDiagonal());
}

// The fit beside priors of these widths (0: none) around the values of `start`. Of one that ran away without
// them nothing is taken over.
FitCore beside_priors(const Observations& o, const Model& start, const FitCore& fit, const VectorXd& width,
                      const FitOptions& options) {
  Model model = start;
  for (std::size_t e = 0; fit.converged && e < model.effects.size(); ++e) {
    const std::size_t linear = model.effects[e].effect->info().linear_count();
    for (std::size_t k = linear; k < model.effects[e].parameters.size(); ++k) {
      model.effects[e].parameters[k].value = fit.model.effects[e].parameters[k].value;
      model.effects[e].parameters[k].given = true;
    }
  }
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    if (!(width[static_cast<Eigen::Index>(k)] > 0.0)) continue;
    ParameterValue& p = model.effects[fit.free[k].effect].parameters[fit.free[k].index];
    p.prior = true;
    p.sigma = width[static_cast<Eigen::Index>(k)];
  }
  if (!fit.converged) return fit_core(o, model, options);
  std::vector<bool> outliers = fit.whitening->noise().used;
  outliers.flip();
  return fit_core(o, model, {.robust = false}, outliers);
}

// Chi-square and degrees of freedom of the readings alone, into `out`.
void count(const Observations& o, SizedFit& out) {
  const Whitening& whitening = *out.core.whitening;
  out.chi2 = out.core.white.head(o.size()).squaredNorm();
  out.dof = static_cast<double>(whitening.noise().used_count()) -
            static_cast<double>(whitening.setup_rank()) - out.core.basis.topRows(o.size()).squaredNorm();
  out.sigma_factor = sigma_factor(out.chi2, out.dof);
}

}  // namespace

bool is_beyond_usual(const ModelEffect& effect, double times) {
  const EffectInfo& info = effect.effect->info();
  for (std::size_t k = 0; k < info.linear_count(); ++k) {
    const double usual = info.parameters[k].usual;
    if (usual > 0.0 && std::abs(effect.parameters[k].value) > times * usual) return true;
  }
  return false;
}

VectorXd usual_sizes(const FitCore& fit) {
  VectorXd out = VectorXd::Zero(static_cast<Eigen::Index>(fit.free.size()));
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const Parameter& p = parameter_of(fit, k);
    const bool of_user = fit.model.effects[fit.free[k].effect].id().starts_with("user:");
    if (p.role == ParameterRole::linear && !fit.free[k].prior && !of_user)
      out[static_cast<Eigen::Index>(k)] = std::abs(p.usual);
  }
  return out;
}

double sigma_factor(double chi2, double dof) {
  constexpr double kTooLarge = 1.25, kChance = 1e-4;
  if (dof < 1.0 || chi2 < kTooLarge * dof || chi2_tail(chi2, dof) > kChance) return 1.0;
  return std::sqrt(chi2 / dof);
}

MatrixXd undecided(const FitCore& fit) {
  const auto p = static_cast<Eigen::Index>(fit.free.size());
  const VectorXd usual = usual_sizes(fit);
  const SymmetricEigen eigen = symmetric_eigen(relative_covariance(fit));
  Eigen::Index decided = 0;
  while (decided < p && eigen.values[decided] <= 1.0) ++decided;
  const MatrixXd open = eigen.vectors.rightCols(p - decided);
  // One vector for each pivot column: few parameters in each, as a person would name them.
  const PivotedQr qr = pivoted_qr(open * open.transpose(), 0.0);
  MatrixXd out(p, p - decided);
  for (Eigen::Index i = 0; i < out.cols(); ++i)
    out.col(i) = usual.cwiseProduct(open * open.row(qr.order[i]).transpose());
  return out;
}

SizedFit with_usual_sizes(const Observations& o, const Model& start, FitCore fit, const FitOptions& options) {
  SizedFit out;
  const VectorXd usual = usual_sizes(fit);
  const bool open = !fit.converged || fit.null_vectors.cols() > 0 || undecided(fit).cols() > 0;
  if (!open || usual.isZero(0.0)) {
    out.core = std::move(fit);
    out.chi2 = out.core.chi2();
    out.dof = out.core.dof();
    out.sigma_factor = sigma_factor(out.chi2, out.dof);
    return out;
  }
  VectorXd width = kWideInUsual * usual;
  out.core = beside_priors(o, start, fit, width, options);
  count(o, out);
  const double factor = out.sigma_factor;
  if (factor > 1.0) out.core = beside_priors(o, start, fit, width / factor, options);
  // An effect that is sure to be larger than usual is no reason to make its other parameters small.
  bool wider = false;
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (!(usual[i] > 0.0)) continue;
    const FreeParameter& at = fit.free[k];
    const double moved = std::abs(out.core.model.effects[at.effect].parameters[at.index].value -
                                  start.effects[at.effect].parameters[at.index].value);
    const double sigma = std::sqrt(out.core.covariance(i, i)) * factor;
    if (moved <= kWideInUsual * usual[i] || sigma > kDecided * kWideInUsual * usual[i]) continue;
    for (std::size_t other = 0; other < fit.free.size(); ++other) {
      if (fit.free[other].effect != at.effect) continue;
      const auto of = static_cast<Eigen::Index>(other);
      width[of] = std::max(width[of], moved / usual[i] * usual[of]);
      wider = true;
    }
  }
  if (wider) out.core = beside_priors(o, start, fit, width / factor, options);
  count(o, out);
  return out;
}

}  // namespace trunnion::diagnosis
