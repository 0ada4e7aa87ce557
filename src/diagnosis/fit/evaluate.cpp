#include "trunnion/diagnosis/evaluate.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/measured_tools.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/fit/variance.hpp"
#include "diagnosis/search/leftover.hpp"

namespace trunnion::diagnosis {
namespace {

double unit_of(const Reading& r) {
  return r.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
}

// Residuals of both quantities; micrometres and microradians do not add.
struct Spread {
  struct Sizes {
    std::vector<double> values;
    void add(double v) { values.push_back(std::abs(v)); }
    ResidualSize size() const {
      ResidualSize out;
      if (values.empty()) return out;
      std::vector<double> sorted = values;
      std::sort(sorted.begin(), sorted.end());
      const auto count = static_cast<double>(sorted.size());
      double sum = 0.0;
      for (const double v : sorted) sum += v * v;
      out.rms = std::sqrt(sum / count);
      out.largest = sorted.back();
      out.p95 = sorted[static_cast<std::size_t>(std::ceil(0.95 * count)) - 1];
      return out;
    }
  };
  Sizes um, urad;
  void add(Quantity q, double value) { (q == Quantity::displacement ? um : urad).add(value); }
};

Model held(const Model& model) {
  Model out = model;
  for (ModelEffect& effect : out.effects)
    for (ParameterValue& p : effect.parameters) p.fixed = true;
  return out;
}

std::string sentence(const Evaluation& e) {
  const double reduced = e.dof > 0.0 ? e.chi2 / e.dof : 0.0;
  const bool too_big = e.p_value < 1e-4 && reduced > 1.25,
             too_small = e.p_value > 1.0 - 1e-4 && reduced < 0.8;
  const bool repeats = e.replicate_p.has_value(), lack = repeats && *e.replicate_p < 1e-3;
  if (too_big && repeats && !lack)
    return "The residual is larger than the stated uncertainty, and no larger than the scatter of repeats: "
           "the stated uncertainty is wrong.";
  if (too_big)
    return "The model does not explain these readings: the residual is larger than their uncertainty.";
  if (too_small)
    return "The residual is smaller than the stated uncertainty: the stated uncertainty is too large.";
  if (lack)
    return "The residual is within the stated uncertainty, and larger than the scatter of repeats: something "
           "is left.";
  return "The model explains these readings within their uncertainty.";
}

}  // namespace

Evaluation evaluate(const Machine& machine, const Dataset& data, const Model& model, std::size_t worst) {
  const Observations o(machine, data);
  const FitCore core = fit_core(o, held(model), {.robust = false});
  const VectorXd plain = plain_residual(o, core);
  Evaluation out;
  out.runs.resize(o.runs().size());
  Spread spread;
  std::vector<Spread> of_run(o.runs().size());
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const Reading& r = o.reading(i);
    const std::size_t run = o.state(i).run;
    const double residual = plain[i] / unit_of(r);
    const RowOrigin& row = data.rows[r.row];
    spread.add(r.quantity, residual);
    of_run[run].add(r.quantity, residual);
    out.worst.push_back({data.files[row.file], data.context.runs[run].id, row.line, o.state(i).q, residual,
                         core.white[i], r.quantity});
    ++out.runs[run].readings;
    out.runs[run].chi2 += core.white[i] * core.white[i];
  }
  out.displacement = spread.um.size();
  out.rotation = spread.urad.size();
  for (std::size_t run = 0; run < out.runs.size(); ++run) {
    out.runs[run].run_id = data.context.runs[run].id;
    out.runs[run].displacement = of_run[run].um.size();
    out.runs[run].rotation = of_run[run].urad.size();
  }
  std::erase_if(out.runs, [](const RunResidual& r) { return r.readings == 0; });
  std::stable_sort(out.worst.begin(), out.worst.end(), [](const RowResidual& a, const RowResidual& b) {
    return std::abs(a.normalised) > std::abs(b.normalised);
  });
  if (out.worst.size() > worst) out.worst.resize(worst);
  out.chi2 = core.chi2();
  out.dof = core.dof();
  if (out.dof > 0.0) out.p_value = chi2_tail(out.chi2, out.dof);
  const Replicates repeats = replicates(o, core, core.white, out.dof);
  if (repeats.pure_dof >= 4.0) {
    out.replicate_p = repeats.p;
    out.replicate_um = std::sqrt(repeats.pure_variance) * typical_u(o, Quantity::displacement) / kMmPerUm;
  }
  const Atoms nothing(o, core, {});
  const Remainder all = nothing.remainder({});
  const auto room = static_cast<Eigen::Index>(std::clamp(core.dof() / 5.0, 0.0, kMostSurrogate));
  const NoiseScale noise = noise_scale(nothing, all, smooth_surrogate(o, core, room), 1);
  Structures structures(o);
  structures.fit_to(core);
  for (const auto& t : leftover(nothing, all, structures, noise).tests)
    if (t.rank > 0 && std::none_of(out.by_covariate.begin(), out.by_covariate.end(),
                                   [&](const Dependence& d) { return d.covariate == t.covariate; }))
      out.by_covariate.push_back({t.covariate, t.p});
  out.verdict = sentence(out);
  out.beyond = beyond_measured(model.valid, ranges_of_readings(machine, data));
  return out;
}

}  // namespace trunnion::diagnosis
