#include "report/effect_tables.hpp"

#include <algorithm>
#include <cmath>

#include "report/residual_figures.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

using diagnosis::Diagnosis;
using diagnosis::RankedEffect;

std::string parameters_text(const RankedEffect& r) {
  std::vector<std::string> parts;
  for (const auto& p : r.parameters)
    parts.push_back(p.key + " " + short_number(p.value, 3) +
                    (p.sigma ? " ± " + short_number(*p.sigma, 2) : ""));
  return joined(parts, ", ");
}

std::string usual_range(const EffectInfo& info) {
  std::vector<std::string> parts;
  for (const Parameter& p : info.parameters) {
    if (p.role == ParameterRole::linear)
      parts.push_back(p.key() + " ± " + short_number(p.usual / unit_factor(p.unit), 3));
  }
  return joined(parts, ", ");
}

std::string parameters_text(const ModelEffect& effect) {
  std::vector<std::string> parts;
  const auto& info = effect.effect->info();
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    const double factor = unit_factor(info.parameters[i].unit);
    const ParameterValue& p = effect.parameters[i];
    parts.push_back(info.parameters[i].key() + " " + short_number(p.value / factor, 4) +
                    (p.sigma   ? " ± " + short_number(*p.sigma / factor, 2)
                     : p.fixed ? " (fixed)"
                               : ""));
  }
  return joined(parts, ", ");
}

// What the keys that `improve` writes mean; another key stands as it is.
std::string evidence_words(const std::string& key) {
  constexpr std::pair<const char*, const char*> kWords[] = {
      {"chi2_drop", "chi-square falls by"},
      {"dof", "parameters"},
      {"p_value", "p"},
      {"heldout_rms_before_um", "held out, µm before"},
      {"heldout_rms_after_um", "after"},
      {"heldout_rms_before_urad", "held out, µrad before"},
      {"heldout_rms_after_urad", "µrad after"}};
  for (const auto& [name, words] : kWords)
    if (key == name) return words;
  return key;
}

std::string evidence_text(const config::Table& evidence) {
  std::vector<std::string> parts;
  for (const auto& [key, value] : evidence) {
    const std::string words = evidence_words(key);
    if (const auto* text = value.as_string()) parts.push_back(words + " " + *text);
    if (const auto* number = std::get_if<double>(&value.data))
      parts.push_back(words + " " + short_number(*number, 3));
    if (const auto* whole = std::get_if<std::int64_t>(&value.data))
      parts.push_back(words + " " + std::to_string(*whole));
  }
  return joined(parts, ", ");
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double v : values) squares += v * v;
  return values.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(values.size()));
}

Series bars_of(std::string name, int colour) {
  Series s;
  s.name = std::move(name);
  s.mark = Mark::bars;
  s.colour = colour;
  return s;
}

}  // namespace

Table model_table(const Machine& machine, const diagnosis::Dataset& data, const Model& model) {
  Table table;
  table.id = "effects";
  table.title = "Effects of the model";
  table.caption = "Does: effect on these readings, RMS.";
  table.columns = {"effect", "what it is", "value ± sigma", "usual", "does / µm", "evidence"};
  table.numeric = {false, false, false, false, true, false};
  const auto contributions = contributions_um(machine, data, model);
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const ModelEffect& effect = model.effects[i];
    const EffectInfo& info = effect.effect->info();
    table.rows.push_back({effect.id(), info.what, parameters_text(effect), usual_range(info),
                          short_number(rms(contributions[i]), 3), evidence_text(effect.evidence)});
  }
  return table;
}

Table model_table(const Model& model) {
  Table table;
  table.id = "effects";
  table.title = "Effects of the model";
  table.columns = {"effect", "what it is", "value ± sigma", "usual"};
  for (const ModelEffect& effect : model.effects) {
    const EffectInfo& info = effect.effect->info();
    table.rows.push_back({effect.id(), info.what, parameters_text(effect), usual_range(info)});
  }
  return table;
}

Table ranking_table(const Machine& machine, const EffectContext& context, const Diagnosis& d) {
  Table table;
  table.id = "ranking";
  table.title = "Effects of the library, each as if it alone were added";
  table.caption =
      "p: probability of at least this improvement by chance, with all effects and shapes tried taken into "
      "account. Detectable: size that these data would show with 95 % probability. Rivals: effects that "
      "change these readings in nearly the same way.";
  table.columns = {"effect",
                   "what it is",
                   "p",
                   "chi-square drop",
                   "dof",
                   "value ± sigma",
                   "usual",
                   "detectable / µm",
                   "held out before / µm",
                   "after / µm",
                   "rivals"};
  table.numeric = {false, false, true, true, true, false, false, true, true, true, false};
  const auto library = effect_library(machine, context);
  for (const RankedEffect& r : d.ranking) {
    const auto family =
        std::find_if(library.begin(), library.end(), [&](const auto& f) { return f.id() == r.id; });
    std::vector<std::string> rivals;
    for (const auto& rival : r.rivals) rivals.push_back(rival.effect + " " + short_number(rival.rho, 2));
    table.rows.push_back({r.id, family == library.end() ? "" : family->info().what,
                          r.excited ? short_number(r.p_value, 2) : "not excited",
                          short_number(r.chi2_drop, 4), short_number(r.dof, 3), parameters_text(r),
                          family == library.end() ? "" : usual_range(family->info()),
                          optional_text(r.detectable_um), optional_text(r.heldout_before_um),
                          optional_text(r.heldout_after_um), joined(rivals, ", ")});
  }
  return table;
}

std::optional<Figure> rivals_figure(const Diagnosis& d) {
  constexpr std::size_t kMost = 14;
  MatrixPlot plot;
  plot.colour = {"likeness rho", ""};
  for (const RankedEffect& r : d.ranking) {
    if (plot.rows.size() < kMost && r.excited) plot.rows.push_back(r.id);
  }
  if (plot.rows.size() < 2) return std::nullopt;
  plot.columns = plot.rows;
  plot.values.assign(plot.rows.size(), std::vector<double>(plot.rows.size(), 0.0));
  for (std::size_t i = 0; i < plot.rows.size(); ++i) {
    plot.values[i][i] = 1.0;
    const auto ranked =
        std::find_if(d.ranking.begin(), d.ranking.end(), [&](const auto& r) { return r.id == plot.rows[i]; });
    for (const auto& rival : ranked->rivals) {
      const auto j = static_cast<std::size_t>(std::find(plot.rows.begin(), plot.rows.end(), rival.effect) -
                                              plot.rows.begin());
      if (j < plot.rows.size())
        plot.values[i][j] = plot.values[j][i] = std::max(plot.values[j][i], rival.rho);
    }
  }
  return Figure{"pairs", "Effects that look alike in these data",
                "Largest cosine between the changes of these readings by two effects: 1 means that they "
                "cannot be separated; dark: below the threshold of a rival.",
                std::move(plot)};
}

Figure budget_figure(const Machine& machine, const diagnosis::Dataset& data, const Model& model) {
  const auto shares = shapley_shares(contributions_um(machine, data, model));
  XyPlot plot{{"", ""}, {"share of the mean square", "µm²"}, {}, {}, {}, false};
  Series bars;
  bars.mark = Mark::bars;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    plot.categories.push_back(model.effects[i].id());
    bars.x.push_back(static_cast<double>(i));
    bars.y.push_back(shares[i]);
  }
  plot.series.push_back(std::move(bars));
  return {"budget", "Error budget by effect",
          "Share of each effect in the mean square of the error in these readings (Shapley values: they add "
          "up to the whole and do not depend on the order). Negative: the effect cancels part of others.",
          std::move(plot)};
}

Figure significance_figure(const Model& model) {
  constexpr std::size_t kMost = 40;
  std::vector<std::pair<std::string, double>> all;
  for (const ModelEffect& effect : model.effects) {
    const auto& info = effect.effect->info();
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const ParameterValue& p = effect.parameters[i];
      if (p.sigma && *p.sigma > 0.0)
        all.emplace_back(effect.id() + " " + info.parameters[i].key(), p.value / *p.sigma);
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
  const bool cut = all.size() > kMost;
  if (cut) all.resize(kMost);
  XyPlot plot{{"", ""}, {"value over its sigma", ""}, {}, {{"2", 2.0}, {"-2", -2.0}}, {}, false};
  Series bars = bars_of("", 0);
  for (const auto& [name, ratio] : all) {
    bars.x.push_back(static_cast<double>(plot.categories.size()));
    bars.y.push_back(ratio);
    plot.categories.push_back(name);
  }
  plot.series.push_back(std::move(bars));
  return {"significance", "How sure each parameter is",
          std::string("Within the dashed lines a parameter may as well be zero.") +
              (cut ? " The 40 surest ones." : ""),
          std::move(plot)};
}

Figure steps_figure(const std::vector<diagnosis::HistoryEntry>& entries, std::size_t shown) {
  // Lengths where there are any: they are what a part shows.
  const bool lengths =
      std::any_of(entries.begin(), entries.end(), [](const auto& e) { return std::isfinite(e.rms_um); });
  XyPlot plot{{"model", ""}, {"error", lengths ? "µm" : "µrad"}, {}, {}, {}, false};
  Series fit = bars_of("these data", 0);
  Series held = bars_of("held-out runs", 1);
  Series noise;
  noise.name = "noise floor";
  noise.mark = Mark::band;
  noise.colour = 7;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto& e = entries[i];
    const auto x = static_cast<double>(i);
    plot.categories.push_back(e.name);
    const double not_yet = std::nan("");
    fit.x.push_back(x);
    fit.y.push_back(i >= shown ? not_yet : lengths ? e.rms_um : e.rms_urad);
    held.x.push_back(x);
    held.y.push_back(i >= shown ? not_yet : (lengths ? e.heldout_um : e.heldout_urad).value_or(not_yet));
    for (const double edge : {x - 0.5, x + 0.5}) {
      noise.x.push_back(edge);
      noise.y.push_back(0.0);
      noise.y2.push_back(lengths ? e.noise_floor_um : e.noise_floor_urad);
    }
  }
  plot.series = {std::move(noise), std::move(fit), std::move(held)};
  return {"steps-error", "Error by step",
          "Root mean square on these data, and on runs that were left out of the fit; band: expected from "
          "measurement noise alone.",
          std::move(plot)};
}

}  // namespace trunnion::report
