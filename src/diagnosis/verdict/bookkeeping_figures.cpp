#include "diagnosis/verdict/bookkeeping_figures.hpp"

#include <cmath>

#include "trunnion/base/median.hpp"

#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {
namespace {

// ln |C| of the readings with weight. Not the restricted one: a set-up in another unit is no evidence.
double log_determinant(const Observations& o, const NoiseModel& noise) {
  double out = 0.0;
  for (Eigen::Index i = 0; i < o.size(); ++i)
    if (noise.used[static_cast<std::size_t>(i)]) out += 2.0 * std::log(noise.u[i]);
  for (const auto& group : o.groups()) {
    double shared = 0.0;
    for (const Eigen::Index i : group)
      if (noise.used[static_cast<std::size_t>(i)]) shared += std::pow(noise.common[i] / noise.u[i], 2);
    out += std::log1p(shared);
  }
  return out;
}

// -2 ln of a long-tailed prior of the parameters (Cauchy's, ten usual sizes). Displacements that are 1000
// times too large fit as well as rotations that are 1000 times too small; but then every parameter is 1000
// times its usual size.
double of_sizes(const FitCore& core) {
  double out = 0.0;
  for (const FreeParameter& f : core.free) {
    const ModelEffect& effect = core.model.effects[f.effect];
    const Parameter& p = effect.effect->info().parameters[f.index];
    if (p.role == ParameterRole::linear && p.usual > 0.0)
      out += 2.0 * std::log1p(std::pow(effect.parameters[f.index].value / (kFarFromUsual * p.usual), 2));
  }
  return out;
}

}  // namespace

double of_scale(const Convention& c, const Dataset& data) {
  if (c.kind != ConventionKind::unit || !c.axes.empty() || c.only_uncertainty) return 0.0;
  double count = 0.0;
  for (const Reading& r : data.readings)
    if (concerns(data, r, c)) count += 1.0;
  return -2.0 * count * std::log(c.factor);
}

Figures least_figures(const Observations& o, const FitCore& core, double scale) {
  Figures out;
  out.chi2 = core.chi2();
  out.dof = core.dof();
  const double fixed = log_determinant(o, core.whitening->noise()) + scale;
  // Readings that scatter less than stated are no better explained.
  out.deviance = std::max(out.chi2, out.dof) + fixed;
  out.floor = out.dof + fixed;
  return out;
}

Figures figures(const Observations& o, const Model& start, const FitCore& core, double scale) {
  // Where the readings leave combinations open, the plain fit runs away along them: sizes are those of the
  // smallest parameters that do as well, and what is hardly seen is no parameter that was paid for.
  const SizedFit sized = with_usual_sizes(o, start, core, {.robust = false});
  const Whitening& whitening = *core.whitening;
  Figures out = least_figures(o, core, scale);
  out.parameters = static_cast<double>(whitening.noise().used_count() - whitening.setup_rank()) - sized.dof;
  out.sizes = of_sizes(sized.core);
  out.deviance += out.sizes;
  return out;
}

std::vector<double> scatter_over_uncertainty(const Dataset& data, const std::optional<Quantity>& quantity,
                                             const std::optional<std::size_t>& run) {
  constexpr std::size_t kFewest = 3;
  std::vector<std::vector<const Reading*>> groups(data.group_count);
  for (const Reading& r : data.readings)
    if ((!quantity || r.quantity == *quantity) && (!run || data.run_of(r) == *run))
      groups[r.group].push_back(&r);
  std::vector<double> out;
  for (const auto& group : groups) {
    if (group.size() < kFewest) continue;
    std::vector<double> values;
    values.reserve(group.size());
    for (const Reading* r : group) values.push_back(r->value);
    const double middle = median(std::move(values));
    for (const Reading* r : group) out.push_back(std::abs(r->value - middle) / r->u_random);
  }
  return out;
}

}  // namespace trunnion::diagnosis
