#include "diagnosis/verdict/odd_runs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/diagnosis/formula.hpp"

#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kTried = 3;       // the runs that misfit most, in each of two ways
constexpr double kMisfits = 1.25;       // chi-square per reading of a run that does
constexpr double kOfOddRun = 0.9;       // confidence in what the others show
constexpr double kStoodStill = 1e-6;    // mm, rad
constexpr double kFasterThan = 1.5;     // quotient of speeds that are another one
constexpr double kFinerThan = 4.0;      // quotient of steps between places
constexpr double kFurther_K = 1.0;      // beyond the temperatures of the others, and as much as they span
constexpr double kAskedFor = 1e-3;      // chance that noise alone gains so much
constexpr double kBesideFormula = 1.1;  // chi-square per degree of freedom beside a formula
constexpr double kMostReadingsByRun = 5000;  // beyond, runs are many and one says little

double chi2_of(const Observations& o, const Model& model) {
  return fit_core(o, model, {.robust = false}).white.squaredNorm();
}

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

// What a run does with the machine, of which errors may come that only it shows.
struct Doings {
  std::vector<bool> moves, turns_round;  // of each axis
  std::vector<double> speed;             // the highest, of each axis
  std::vector<double> step;              // the smallest between places of each axis; infinite: it stands
  std::vector<std::vector<bool>> along;  // two linear axes at once
  std::vector<double> coldest, warmest;  // of each sensor
  double rpm = 0.0;
};

double smallest_step(const Observations& o, const std::vector<Eigen::Index>& rows, AxisId axis) {
  std::vector<double> places;
  places.reserve(rows.size());
  for (const Eigen::Index i : rows) places.push_back(o.state(i).q[axis]);
  std::sort(places.begin(), places.end());
  double out = INFINITY;
  for (std::size_t k = 1; k < places.size(); ++k)
    if (const double step = places[k] - places[k - 1]; step > kStoodStill) out = std::min(out, step);
  return out;
}

Doings doings(const Observations& o, std::size_t run) {
  const std::size_t axes = o.machine().axes.size();
  const std::size_t sensors = o.data().context.names.temperatures.size();
  Doings out{std::vector<bool>(axes),
             std::vector<bool>(axes),
             std::vector<double>(axes),
             std::vector<double>(axes, INFINITY),
             std::vector<std::vector<bool>>(axes, std::vector<bool>(axes)),
             std::vector<double>(sensors, INFINITY),
             std::vector<double>(sensors, -INFINITY)};
  const auto& rows = o.runs()[run];
  if (rows.empty()) return out;
  const MachineState& first = o.state(rows.front());
  std::vector<bool> forth(axes), back(axes);
  for (const Eigen::Index i : rows) {
    const MachineState& s = o.state(i);
    for (std::size_t a = 0; a < axes; ++a) {
      if (std::abs(s.q[a] - first.q[a]) > kStoodStill) out.moves[a] = true;
      if (s.direction[a] > 0) forth[a] = true;
      if (s.direction[a] < 0) back[a] = true;
      out.speed[a] = std::max(out.speed[a], std::abs(s.velocity[a]));
      for (std::size_t b = 0; b < a; ++b)
        if (s.velocity[a] != 0.0 && s.velocity[b] != 0.0) out.along[a][b] = true;
    }
    for (std::size_t t = 0; t < sensors; ++t) {
      out.coldest[t] = std::min(out.coldest[t], s.temperature(t));
      out.warmest[t] = std::max(out.warmest[t], s.temperature(t));
    }
    out.rpm = std::max(out.rpm, std::abs(s.spindle_rpm));
  }
  for (std::size_t a = 0; a < axes; ++a) {
    out.turns_round[a] = out.moves[a] && forth[a] && back[a];
    if (out.moves[a]) out.step[a] = smallest_step(o, rows, a);
  }
  return out;
}

// What this run does and no other: an error of that kind is shown by it alone, however rightly it was
// measured.
std::vector<std::string> only_in(const Observations& o, std::size_t run) {
  const Doings own = doings(o, run);
  std::vector<Doings> others;
  for (std::size_t r = 0; r < o.runs().size(); ++r)
    if (r != run && !o.runs()[r].empty()) others.push_back(doings(o, r));
  const auto none = [&](const auto& does) { return std::none_of(others.begin(), others.end(), does); };
  std::vector<std::string> out;
  for (std::size_t a = 0; a < own.moves.size(); ++a) {
    const std::string& name = o.machine().axes[a].name;
    if (own.moves[a] && none([&](const Doings& d) { return d.moves[a]; }))
      out.push_back("moves " + name);
    else if (own.turns_round[a] && none([&](const Doings& d) { return d.turns_round[a]; }))
      out.push_back("turns " + name + " round");
    else if (own.speed[a] > 0.0 &&
             none([&](const Doings& d) { return d.speed[a] * kFasterThan > own.speed[a]; }))
      out.push_back("moves " + name + " as fast");
    // Short waves are seen by nobody else.
    else if (std::isfinite(own.step[a]) &&
             none([&](const Doings& d) { return d.step[a] < kFinerThan * own.step[a]; }))
      out.push_back("reads " + name + " in steps as fine");
    for (std::size_t b = 0; b < a; ++b)
      if (own.along[a][b] && none([&](const Doings& d) { return d.along[a][b]; }))
        out.push_back("moves " + o.machine().axes[b].name + " and " + name + " at once");
  }
  if (own.rpm > 0.0 && none([&](const Doings& d) { return d.rpm * kFasterThan > own.rpm; }))
    out.emplace_back(none([](const Doings& d) { return d.rpm > 0.0; }) ? "turns the spindle"
                                                                       : "turns the spindle as fast");
  for (std::size_t t = 0; t < own.warmest.size(); ++t) {
    double low = INFINITY, high = -INFINITY;
    for (const Doings& d : others) low = std::min(low, d.coldest[t]), high = std::max(high, d.warmest[t]);
    const std::string& sensor = o.data().context.names.temperatures[t];
    const double further = std::max(kFurther_K, high - low);
    if (own.warmest[t] - high > further) out.push_back("is as warm at sensor '" + sensor + "'");
    if (low - own.coldest[t] > further) out.push_back("is as cold at sensor '" + sensor + "'");
  }
  return out;
}

// A formula that the other runs ask for as well is no name for this run alone. Where only this run shows it
// (another run goes nowhere near, or does nothing of that kind), nothing tells the two apart.
bool others_ask_for(const ProposedFormula& formula, const Machine& machine, const Dataset& others,
                    const Model& found) {
  const Observations o(machine, others);
  const double gain = chi2_of(o, found) - chi2_of(o, with(found, formula.alone.effects));
  return chi2_tail(gain, static_cast<double>(std::max<std::size_t>(formula.terms, 1))) < kAskedFor;
}

struct Others {
  std::size_t without;  // run
  const Shown& shown;
};

// The run shows more of an error than the others do, which a formula follows in all of them. Effects that
// only this run asked for stood for a part of it: they are named no more where the formula does without them
// and leaves noise. False: it does not.
bool name_what_all_ask_for(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                           const Others& all, Diagnosis& d) {
  const auto& [run, others] = all;
  if (others.effects.size() >= d.additions.size()) return false;
  const Dataset& data = whole.data();
  auto again = propose_formula(whole.machine(), data, with(model, others.effects), left_out);
  if (!again || again->chi2_after > kBesideFormula * again->dof_after) return false;
  const std::vector<std::string> before = std::exchange(d.effects, {});
  d.additions = others.effects;
  for (const ModelEffect& effect : d.additions) d.effects.push_back(effect.id());
  d.imitators.clear();
  for (const std::string& id : before)
    if (std::find(d.effects.begin(), d.effects.end(), id) == d.effects.end()) d.imitators.push_back(id);
  d.sets.clear();
  d.confidence = std::min(d.confidence, kOfOddRun);
  d.formula = std::move(again);
  if (d.effects.empty()) {
    d.verdict = Verdict::not_in_library;
    d.leftover = d.depends_on;
    d.paragraph = imitated_text(d);
  } else {
    d.sets.push_back(d.effects);
    d.paragraph = fewer_text(d);
  }
  d.paragraph += formula_text(*d.formula) + " Without run '" + data.context.runs[run].id +
                 "', which shows most of it, the others say: " + others.words;
  return true;
}

}  // namespace

void blame_odd_runs(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                    Diagnosis& d, const EffectSearch& search) {
  const bool named = d.verdict == Verdict::named_but_incomplete && !d.only_number_is_open();
  if ((!named && d.verdict != Verdict::not_in_library) || whole.runs().size() < 3 ||
      static_cast<double>(whole.size()) > kMostReadingsByRun)
    return;
  const Dataset& data = whole.data();
  if (named && shown(whole.machine(), data, with(model, d.additions), search)) return;
  std::vector<std::size_t> runs;
  std::vector<Shown> others;
  for (const std::size_t run : worst_runs(whole, with(model, d.additions))) {
    const Dataset left = without(data, run);
    std::optional<Shown> rest = shown(whole.machine(), left, model, search);
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
  if (d.formula && runs.size() == 1 &&
      others_ask_for(*d.formula, whole.machine(), without(data, runs.front()),
                     with(model, others.front().effects)) &&
      (name_what_all_ask_for(whole, model, left_out, {runs.front(), others.front()}, d) ||
       d.formula->chi2_after <= kBesideFormula * d.formula->dof_after))
    return;
  // Of several runs that may be the odd one each shows what the others do.
  const std::vector<std::string> deeds =
      runs.size() == 1 ? only_in(whole, runs.front()) : std::vector<std::string>();
  const auto words = [&](const std::vector<std::string>& before, const std::vector<std::string>& now) {
    return deeds.empty() ? odd_runs_text(before, now, data, runs)
                         : alone_text(before, now, data, runs.front(), deeds);
  };
  if (deeds.empty())
    for (const std::size_t run : runs) d.rows.odd_runs.push_back(data.context.runs[run].id);
  if (!named) {
    d.paragraph = words({}, {}) + " " + d.paragraph;
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
  d.paragraph = words(before, d.effects) + " The others say: " + others.front().words +
                (d.formula ? formula_text(*d.formula) : "");
}

}  // namespace trunnion::diagnosis
