#include "trunnion/diagnosis/improve.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "diagnosis/fit/heldout.hpp"
#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

config::Value text_value(std::string value) {
  return {std::move(value), {}};
}
config::Value real_value(double value) {
  return {value, {}};
}

VectorXd stated(const Dataset& data) {
  VectorXd out(static_cast<Eigen::Index>(data.readings.size()));
  for (std::size_t i = 0; i < data.readings.size(); ++i)
    out[static_cast<Eigen::Index>(i)] = data.readings[i].u_random;
  return out;
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

// Linear parameters as `first` gives them, 0 for effects that were added: a fit of the same readings keeps
// what they leave open near where it starts, and would move on with every step.
Model from_the_start(Model fitted, const Model& first) {
  for (std::size_t e = 0; e < fitted.effects.size(); ++e) {
    ModelEffect& effect = fitted.effects[e];
    for (std::size_t k = 0; k < effect.effect->info().linear_count(); ++k) {
      const bool added = e >= first.effects.size();
      effect.parameters[k].value = added ? 0.0 : first.effects[e].parameters[k].value;
      effect.parameters[k].sigma = added ? std::nullopt : first.effects[e].parameters[k].sigma;
    }
  }
  return fitted;
}

// Of one quantity held-out runs are off by less than half as much with an effect, of the other by no more but
// for what a few more parameters scatter.
bool takes_most_of_heldout(const RankedEffect& r) {
  constexpr double kMost = 0.5, kNoMore = 1.05;
  double best = 1.0, worst = 0.0;
  for (const auto& [before, after] : {std::pair(r.heldout_before_um, r.heldout_after_um),
                                      std::pair(r.heldout_before_urad, r.heldout_after_urad)}) {
    if (!before || !after || !(*before > 0.0)) continue;
    best = std::min(best, *after / *before);
    worst = std::max(worst, *after / *before);
  }
  return best < kMost && worst < kNoMore;
}

// Between the positions that were read a wrong number of periods a turn, or period, makes the machine worse.
bool number_is_open(const Diagnosis& d, const std::string& id) {
  return std::any_of(d.ranking.begin(), d.ranking.end(),
                     [&](const RankedEffect& r) { return r.id == id && r.number_is_open(); });
}

// Of explanations that cannot be told apart, the effect that is in each of them and alone takes most of what
// held-out runs are off by, or is sure in each with the same values: what is open is the rest. None that has
// variants: a set does not say which; none that something which no column records may be.
std::optional<ModelEffect> common_to_all(const Diagnosis& d) {
  if (d.verdict != Verdict::ambiguous || !d.bookkeeping.empty() || d.sets.size() < 2) return std::nullopt;
  for (const ModelEffect& effect : d.additions) {
    const EffectInfo& info = effect.effect->info();
    const auto has_it = [&](const std::vector<std::string>& set) {
      return std::find(set.begin(), set.end(), info.id) != set.end();
    };
    if (!info.variant.empty() || number_is_open(d, info.id) || find_effect(d.base.model, info) != nullptr ||
        std::find(d.imitators.begin(), d.imitators.end(), info.id) != d.imitators.end() ||
        !std::all_of(d.sets.begin(), d.sets.end(), has_it))
      continue;
    const auto r = std::find_if(d.ranking.begin(), d.ranking.end(),
                                [&](const RankedEffect& ranked) { return ranked.id == info.id; });
    if (r != d.ranking.end() && (r->same_in_all || takes_most_of_heldout(*r))) return effect;
  }
  return std::nullopt;
}

// The first effect that is known with its period and that can be added: a model file holds it once, though
// with a parameter held it may be named.
std::optional<ModelEffect> first_known(const Diagnosis& d) {
  for (const ModelEffect& effect : d.additions)
    if (!number_is_open(d, effect.id()) && find_effect(d.base.model, effect.effect->info()) == nullptr)
      return effect;
  return std::nullopt;
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
  const bool uneven = diagnosis != nullptr && diagnosis->scatter.uneven;
  out.fit = uneven ? fit(machine, weighed(data, *diagnosis->scatter.uneven), out.model)
                   : fit(machine, data, out.model);
  out.model = out.fit.model;
  if (!parent.file.empty()) out.model.parent = parent.file;
  return out;
}

HistoryEntry history_entry(const Machine& machine, const Dataset& data, const Model& given) {
  HistoryEntry out;
  out.name = given.name;
  out.parent = given.parent.value_or("");
  for (const ModelEffect& effect : given.effects) out.effects.push_back(effect.id());
  const Observations o(machine, data);
  const Model model = with_best_variants(o, given);
  const SizedFit sized = with_usual_sizes(o, model, fit_core(o, model, {}));
  const FitCore& core = sized.core;
  const SizeByQuantity rms = size_by_quantity(data, plain_residual(o, core), core.whitening->noise().used);
  const SizeByQuantity floor = size_by_quantity(data, stated(data));
  out.rms_um = rms.um;
  out.rms_urad = rms.urad;
  out.noise_floor_um = floor.um;
  out.noise_floor_urad = floor.urad;
  out.chi2 = sized.chi2;
  out.dof = sized.dof;
  const Atoms none(o, core, {});
  if (const auto h = held_out(none, {})) {
    if (std::isfinite(h->rms_um)) out.heldout_um = h->rms_um;
    if (std::isfinite(h->rms_urad)) out.heldout_urad = h->rms_urad;
  }
  return out;
}

std::vector<ImproveStep> improve(const Machine& machine, const Dataset& data, const Model& model,
                                 const ImproveOptions& options) {
  std::vector<ImproveStep> steps;
  Model now = model;
  for (std::size_t k = 0;; ++k) {
    ImproveStep step;
    step.error = history_entry(machine, data, now);
    step.diagnosis = diagnose(machine, data, now, options.diagnosis, options.extra);
    step.model = step.diagnosis.base.model;
    step.model.parent = now.parent;
    const Diagnosis& d = step.diagnosis;
    const bool sure = d.verdict == Verdict::named || d.verdict == Verdict::named_but_incomplete;
    // One effect a step, the best first: the next diagnosis sees the rest anew.
    const std::optional<ModelEffect> next = sure ? first_known(d) : common_to_all(d);
    steps.push_back(std::move(step));
    if (!next || k == options.most_steps) return steps;
    const Diagnosis& said = steps.back().diagnosis;
    Model parent = steps.back().model;
    now = from_the_start(add_and_fit(machine, data, parent, {*next}, &said).model, model);
    now.name = model.name + " + " + next->id();
  }
}

}  // namespace trunnion::diagnosis
