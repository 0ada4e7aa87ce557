#include "diagnosis/verdict/odd_runs.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kTried = 3;            // the runs that misfit most, in each of two ways
constexpr double kMisfits = 1.25;            // chi-square per reading of a run that does
constexpr double kOfOddRun = 0.9;            // confidence in what the others show
constexpr double kMostReadingsByRun = 5000;  // beyond, runs are many and one says little

// The runs that the model and what was found beside it explain worst, each as a whole and a reading: effects
// that follow a wrong run leave less of it in its few readings than they do wrong in many of others.
std::vector<std::size_t> worst_runs(const Observations& o, const Model& model) {
  const FitCore core = fit_core(o, model, {.robust = false});
  std::vector<std::pair<double, std::size_t>> whole, a_reading;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    double chi2 = 0.0;
    for (const Eigen::Index i : o.runs()[run]) chi2 += std::pow(core.white[i], 2);
    const auto count = static_cast<double>(o.runs()[run].size());
    if (!(chi2 > kMisfits * count)) continue;
    whole.emplace_back(count - chi2, run);
    a_reading.emplace_back(-chi2 / count, run);
  }
  std::vector<std::size_t> out;
  for (auto* order : {&whole, &a_reading}) {
    std::sort(order->begin(), order->end());
    for (std::size_t k = 0; k < std::min(order->size(), kTried); ++k)
      if (std::find(out.begin(), out.end(), (*order)[k].second) == out.end())
        out.push_back((*order)[k].second);
  }
  return out;
}

Dataset without(Dataset data, std::size_t run) {
  std::vector<Reading> kept;
  for (const Reading& r : data.readings)
    if (data.run_of(r) != run) kept.push_back(r);
  data.readings = std::move(kept);
  return data;
}

// What the readings show, and that beside it only noise is left.
struct Shown {
  std::vector<ModelEffect> effects;  // that every explanation has
  std::size_t count = 0;             // of the best explanation
  std::string words;
};

void keep_sure(Shown& out, const Diagnosis& d) {
  out.count += d.effects.size();
  out.words += (out.words.empty() ? "" : " ") + d.paragraph;
  for (const ModelEffect& effect : d.additions)
    if (std::all_of(d.sets.begin(), d.sets.end(), [&](const std::vector<std::string>& set) {
          return std::find(set.begin(), set.end(), effect.id()) != set.end();
        }))
      out.effects.push_back(effect);
}

Model with(Model model, const std::vector<ModelEffect>& effects) {
  model.effects.insert(model.effects.end(), effects.begin(), effects.end());
  return model;
}

// A search finds a few effects at once: where they are sure and not all, a second one goes on.
std::optional<Shown> shown(const Machine& machine, const Dataset& data, const Model& model,
                           const EffectSearch& search) {
  Shown out;
  Diagnosis d = search(machine, data, model);
  if (d.verdict == Verdict::named_but_incomplete) {
    keep_sure(out, d);
    d = search(machine, data, with(model, d.additions));
  }
  if (d.verdict != Verdict::nothing_to_find && d.verdict != Verdict::named && d.verdict != Verdict::ambiguous)
    return std::nullopt;
  keep_sure(out, d);
  return out;
}

// What all say.
std::vector<ModelEffect> common(const std::vector<Shown>& all) {
  std::vector<ModelEffect> out;
  for (const ModelEffect& effect : all.front().effects)
    if (std::all_of(all.begin(), all.end(), [&](const Shown& s) {
          return std::any_of(s.effects.begin(), s.effects.end(),
                             [&](const ModelEffect& other) { return other.id() == effect.id(); });
        }))
      out.push_back(effect);
  return out;
}

}  // namespace

void blame_odd_runs(const Observations& whole, const Model& model, Diagnosis& d, const EffectSearch& search) {
  const bool named = d.verdict == Verdict::named_but_incomplete && !d.only_number_is_open();
  if ((!named && d.verdict != Verdict::not_in_library) || whole.runs().size() < 3 ||
      static_cast<double>(whole.size()) > kMostReadingsByRun)
    return;
  const Dataset& data = whole.data();
  if (named && shown(whole.machine(), data, with(model, d.additions), search)) return;
  std::vector<std::size_t> runs;
  std::vector<Shown> others;
  for (const std::size_t run : worst_runs(whole, with(model, d.additions))) {
    std::optional<Shown> rest = shown(whole.machine(), without(data, run), model, search);
    if (!rest || (!others.empty() && rest->count > others.front().count)) continue;
    // Of two runs the one without which fewer effects are needed.
    if (!others.empty() && rest->count < others.front().count) {
      runs.clear();
      others.clear();
    }
    runs.push_back(run);
    others.push_back(std::move(*rest));
  }
  if (runs.empty()) return;
  for (const std::size_t run : runs) d.rows.odd_runs.push_back(data.context.runs[run].id);
  if (!named) {
    d.paragraph = odd_runs_text({}, {}, data, runs) + " " + d.paragraph;
    return;
  }
  const std::vector<std::string> before = d.effects;
  d.additions = common(others);
  d.effects.clear();
  for (const ModelEffect& effect : d.additions) d.effects.push_back(effect.id());
  d.sets.clear();
  if (d.effects.empty())
    d.verdict = Verdict::not_in_library;
  else
    d.sets.push_back(d.effects);
  d.confidence = std::min(d.confidence, kOfOddRun);
  d.paragraph = odd_runs_text(before, d.effects, data, runs) + " The others say: " + others.front().words +
                (d.formula ? formula_text(*d.formula) : "");
}

}  // namespace trunnion::diagnosis
