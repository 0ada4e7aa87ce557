#include "trunnion/diagnosis/improve.hpp"

#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/heldout.hpp"
#include "diagnosis/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

config::Value text_value(std::string value) {
  return {std::move(value), {}};
}
config::Value real_value(double value) {
  return {value, {}};
}

double rms_um(const Dataset& data, const Fit& fit) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < data.readings.size(); ++i) {
    if (fit.outlier[i]) continue;
    const double unit = data.readings[i].quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
    sum += std::pow(fit.residual[i] / unit, 2);
    count += 1.0;
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

double floor_um(const Dataset& data) {
  double sum = 0.0;
  for (const Reading& r : data.readings)
    sum += std::pow(r.u_random / (r.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad), 2);
  return std::sqrt(sum / static_cast<double>(data.readings.size()));
}

config::Table evidence(const Diagnosis& d, const std::string& id) {
  config::Table out;
  out.emplace_back("verdict", text_value(std::string(text_of(d.verdict))));
  out.emplace_back("confidence", real_value(d.confidence));
  for (const RankedEffect& r : d.ranking) {
    if (r.id != id) continue;
    out.emplace_back("chi2_drop", real_value(r.chi2_drop));
    out.emplace_back("dof", real_value(r.dof));
    out.emplace_back("p_value", real_value(r.p_value));
    if (r.heldout_before_um) out.emplace_back("heldout_rms_before_um", real_value(*r.heldout_before_um));
    if (r.heldout_after_um) out.emplace_back("heldout_rms_after_um", real_value(*r.heldout_after_um));
  }
  return out;
}

// The shapes that the diagnosis searched for: from the usual shape a fit would stop at a wrong period.
void start_from(const Diagnosis& d, ModelEffect& effect) {
  const EffectInfo& info = effect.effect->info();
  for (const RankedEffect& r : d.ranking) {
    if (r.id != info.id || r.variant != info.variant || r.parameters.size() != info.parameters.size())
      continue;
    for (std::size_t k = info.linear_count(); k < info.parameters.size(); ++k) {
      if (effect.parameters[k].given) continue;
      effect.parameters[k].value = r.parameters[k].value * unit_factor(info.parameters[k].unit);
      effect.parameters[k].given = true;
    }
  }
}

}  // namespace

Added add_and_fit(const Machine& machine, const Dataset& data, const Model& parent,
                  std::vector<ModelEffect> effects, const Diagnosis* diagnosis) {
  Added out;
  out.model = parent;
  for (ModelEffect& effect : effects) {
    if (diagnosis != nullptr) {
      effect.evidence = evidence(*diagnosis, effect.id());
      start_from(*diagnosis, effect);
    }
    out.model.effects.push_back(std::move(effect));
  }
  out.fit = fit(machine, data, out.model);
  out.model = out.fit.model;
  if (!parent.file.empty()) out.model.parent = parent.file;
  return out;
}

HistoryEntry history_entry(const Machine& machine, const Dataset& data, const Model& model) {
  HistoryEntry out;
  out.name = model.name;
  out.parent = model.parent.value_or("");
  for (const ModelEffect& effect : model.effects) out.effects.push_back(effect.id());
  const Observations o(machine, data);
  const FitCore core = fit_core(o, model, {});
  const Fit f = fit(machine, data, model);
  out.rms_um = rms_um(data, f);
  out.chi2 = core.chi2();
  out.dof = core.dof();
  out.noise_floor_um = floor_um(data);
  const Atoms none(o, core, {});
  if (const auto h = held_out(none, {})) out.heldout_um = h->rms_um;
  return out;
}

std::vector<ImproveStep> improve(const Machine& machine, const Dataset& data, const Model& model,
                                 const DiagnoseOptions& options, std::size_t most_steps,
                                 const std::vector<EffectFamily>& extra) {
  std::vector<ImproveStep> steps;
  Model now = model;
  for (std::size_t k = 0;; ++k) {
    ImproveStep step;
    const HistoryEntry entry = history_entry(machine, data, now);
    step.rms_um = entry.rms_um;
    step.heldout_um = entry.heldout_um;
    step.noise_floor_um = entry.noise_floor_um;
    step.diagnosis = diagnose(machine, data, now, options, extra);
    step.model = step.diagnosis.base.model;
    step.model.parent = now.parent;
    const Diagnosis& d = step.diagnosis;
    const bool sure = d.verdict == Verdict::named || d.verdict == Verdict::named_but_incomplete;
    steps.push_back(std::move(step));
    if (!sure || k == most_steps) return steps;
    // One effect a step, the best first: the next diagnosis sees the rest anew.
    const Diagnosis& said = steps.back().diagnosis;
    std::vector<ModelEffect> next(said.additions.begin(), said.additions.begin() + 1);
    Model parent = steps.back().model;
    now = add_and_fit(machine, data, parent, std::move(next), &said).model;
    now.name = model.name + " + " + said.effects.front();
  }
}

}  // namespace trunnion::diagnosis
