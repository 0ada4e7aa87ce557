#include "trunnion/report/model_page.hpp"

#include <algorithm>
#include <cmath>

#include "report/residual_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

using diagnosis::Diagnosis;
using diagnosis::RankedEffect;

std::string um(double value) {
  return short_number(value, 3) + " µm";
}
std::string p_text(double p) {
  return short_number(p, 2);
}
std::string optional_text(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? short_number(*value, 3) : "–";
}
std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string out;
  for (const auto& part : parts) out += (out.empty() ? "" : between) + part;
  return out;
}

// A fit that moves no parameter: the residual of the model as it stands.
diagnosis::Fit as_it_stands(const ModelPageInput& input, Model model) {
  for (ModelEffect& effect : model.effects) {
    for (ParameterValue& p : effect.parameters) p.fixed = true;
  }
  return diagnosis::fit(*input.machine, *input.data, model, {.robust = false});
}

Figure vectors_figure(const Residuals& residuals, const VectorScale& scale, std::string id,
                      std::string title) {
  return {std::move(id), std::move(title),
          "Machine axes; vectors drawn " + short_number(scale.magnification) +
              " times too long, colours up to " + um(scale.largest_um) + ".",
          residual_vectors(residuals, scale)};
}

void add_residual_sections(Page& page, const Residuals& residuals, const std::vector<std::string>& first) {
  Section against{"What the residual depends on", {}};
  for (Figure& figure : residual_against_covariates(residuals, first))
    against.items.emplace_back(std::move(figure));
  if (!against.items.empty()) page.sections.push_back(std::move(against));
  page.sections.push_back(
      {"Distribution",
       {Figure{"runs", "Residual by run",
               "Box: the middle half; whiskers to 1.5 times its length; beyond: single readings.",
               residual_by_run(residuals)},
        Figure{"quantiles", "Normalised residual against the normal distribution",
               "On the line: the scatter is that of the stated uncertainty.", normal_quantiles(residuals)}}});
}

Figure budget_figure(const ModelPageInput& input, const Model& model) {
  const auto shares = shapley_shares(contributions_um(*input.machine, *input.data, model));
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
          "Shapley shares of the mean square of what the effects do to these readings: they add up to the "
          "whole and do not "
          "depend on the order. A negative share: the effect undoes others.",
          std::move(plot)};
}

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

Table ranking_table(const ModelPageInput& input, const Diagnosis& d) {
  Table table;
  table.id = "ranking";
  table.title = "Effects of the library, each as if it alone were added";
  table.caption =
      "p: chance of at least this over all effects and shapes tried, if nothing were missing. Detectable: "
      "what these data would "
      "show with 95 % chance. Rivals: effects that do nearly the same to these readings.";
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
  const auto library = effect_library(*input.machine, input.data->context);
  for (const RankedEffect& r : d.ranking) {
    const auto family =
        std::find_if(library.begin(), library.end(), [&](const auto& f) { return f.id() == r.id; });
    std::vector<std::string> rivals;
    for (const auto& rival : r.rivals) rivals.push_back(rival.effect + " " + short_number(rival.rho, 2));
    table.rows.push_back({r.id, family == library.end() ? "" : family->info().what,
                          r.excited ? p_text(r.p_value) : "not excited", short_number(r.chi2_drop, 4),
                          short_number(r.dof, 3), parameters_text(r),
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
  return Figure{"pairs", "Who looks like whom",
                "Largest cosine between what two effects do to these readings; dark where it was below what "
                "counts as a rival.",
                std::move(plot)};
}

Section next_section(const Diagnosis& d) {
  Section out{"The next measurement", {}};
  out.items.emplace_back(Paragraph{d.next->why});
  Table table;
  table.id = "next";
  table.title = "Runs";
  table.caption = "Together " + short_number(d.next->minutes, 3) + " min; chance of a wrong name " +
                  short_number(100 * d.next->wrong_before, 2) + " % before, " +
                  short_number(100 * d.next->wrong_after, 2) + " % after.";
  table.columns = {"run", "minutes", "readings of"};
  table.numeric = {false, true, false};
  for (const auto& run : d.next->runs) {
    table.rows.push_back({run.id, short_number(run.minutes, 3),
                          run.quantity == diagnosis::Quantity::displacement ? "displacement" : "rotation"});
  }
  out.items.emplace_back(std::move(table));
  return out;
}

std::vector<std::string> names_of(const std::vector<diagnosis::Dependence>& all) {
  std::vector<std::string> out;
  for (const auto& d : all) out.push_back(d.covariate);
  return out;
}

Page start(const ModelPageInput& input, std::string title, std::string verdict, Tone tone) {
  Page page;
  page.title = std::move(title);
  page.verdict = std::move(verdict);
  page.tone = tone;
  page.result_json = input.result_json;
  page.made_by = input.made_by;
  return page;
}

}  // namespace

Page evaluation_page(const ModelPageInput& input, const Model& model, const diagnosis::Evaluation& e) {
  Page page = start(input, "Model " + model.name + " against measurements of " + input.machine->name,
                    e.verdict, Tone::neutral);
  page.facts = {{"rms_um", "rms residual", um(e.rms_um), e.rms_um},
                {"p95_um", "95 % are below", um(e.p95_um), e.p95_um},
                {"max_um", "largest residual", um(e.max_um), e.max_um},
                {"chi2", "chi-square", short_number(e.chi2, 5), e.chi2},
                {"dof", "degrees of freedom", short_number(e.dof, 6), e.dof}};
  const Residuals residuals = residuals_of(*input.machine, *input.data, as_it_stands(input, model));
  Section first{"Residual",
                {vectors_figure(residuals, vector_scale(residuals), "vectors", "Residual vectors")}};
  if (!model.effects.empty()) first.items.emplace_back(budget_figure(input, model));
  page.sections.push_back(std::move(first));
  add_residual_sections(page, residuals, names_of(e.by_covariate));
  return page;
}

Page diagnosis_page(const ModelPageInput& input, const Diagnosis& d) {
  const bool clear =
      d.verdict == diagnosis::Verdict::nothing_to_find || d.verdict == diagnosis::Verdict::named;
  Page page = start(input, "What the model of " + input.machine->name + " lacks", d.paragraph,
                    clear ? Tone::good : Tone::neutral);
  page.facts = {{"verdict", "verdict", std::string(diagnosis::text_of(d.verdict)), std::nullopt},
                {"effects", "missing", d.effects.empty() ? "–" : joined(d.effects, " + "), std::nullopt},
                {"confidence", "confidence", short_number(100 * d.confidence, 3) + " %", d.confidence},
                {"rms_um", "rms residual", um(d.rms_um), d.rms_um},
                {"noise_floor_um", "noise floor", um(d.noise_floor_um), d.noise_floor_um},
                {"chi2", "chi-square", short_number(d.chi2, 5), d.chi2},
                {"dof", "degrees of freedom", short_number(d.dof, 6), d.dof}};
  const Residuals before = residuals_of(*input.machine, *input.data, d.base);
  const VectorScale scale = vector_scale(before);
  Section first{
      "Before and after",
      {vectors_figure(before, scale, "vectors-before", "Residual vectors, model as given (fitted)")}};
  if (!d.additions.empty()) {
    const auto added = diagnosis::add_and_fit(*input.machine, *input.data, d.base.model, d.additions, &d);
    const Residuals after = residuals_of(*input.machine, *input.data, added.fit);
    first.items.emplace_back(
        vectors_figure(after, scale, "vectors-after", "Residual vectors with " + joined(d.effects, " + ")));
    first.items.emplace_back(budget_figure(input, added.fit.model));
  } else if (!d.base.model.effects.empty()) {
    first.items.emplace_back(budget_figure(input, d.base.model));
  }
  page.sections.push_back(std::move(first));
  Section ranking{"The candidates", {ranking_table(input, d)}};
  if (auto figure = rivals_figure(d)) ranking.items.emplace_back(std::move(*figure));
  for (const auto& direction : d.null_directions) ranking.items.emplace_back(Paragraph{direction.words});
  page.sections.push_back(std::move(ranking));
  add_residual_sections(page, before, names_of(d.depends_on));
  if (d.next) page.sections.push_back(next_section(d));
  return page;
}

Page history_page(const ModelPageInput& input, const std::vector<diagnosis::HistoryEntry>& entries) {
  Page page = start(input, "How the error of " + input.machine->name + " fell", "", Tone::neutral);
  XyPlot plot{{"model", ""}, {"error", "µm"}, {}, {}, {}, false};
  Series fit{.name = "these data", .mark = Mark::bars, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = 0};
  Series held{
      .name = "held-out runs", .mark = Mark::bars, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = 1};
  Series noise{
      .name = "noise floor", .mark = Mark::band, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = 7};
  Table table;
  table.id = "steps";
  table.title = "Models";
  table.columns = {"model",         "parent",           "effects",    "rms / µm",
                   "held out / µm", "noise floor / µm", "chi-square", "dof"};
  table.numeric = {false, false, false, true, true, true, true, true};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto& e = entries[i];
    const auto x = static_cast<double>(i);
    plot.categories.push_back(e.name);
    fit.x.push_back(x);
    fit.y.push_back(e.rms_um);
    held.x.push_back(x);
    held.y.push_back(e.heldout_um.value_or(std::nan("")));
    for (const double edge : {x - 0.5, x + 0.5}) {
      noise.x.push_back(edge);
      noise.y.push_back(0.0);
      noise.y2.push_back(e.noise_floor_um);
    }
    table.rows.push_back({e.name, e.parent, joined(e.effects, " + "), short_number(e.rms_um, 4),
                          optional_text(e.heldout_um), short_number(e.noise_floor_um, 3),
                          short_number(e.chi2, 5), short_number(e.dof, 6)});
  }
  if (input.data != nullptr && !entries.empty()) {
    const auto& first = entries.front();
    const auto& last = entries.back();
    page.verdict = "From " + um(first.heldout_um.value_or(first.rms_um)) + " with " + first.name + " to " +
                   um(last.heldout_um.value_or(last.rms_um)) + " with " + last.name +
                   (last.heldout_um ? " on held-out runs" : "") + "; the noise floor is " +
                   um(last.noise_floor_um) + ".";
    page.facts = {{"rms_um", "last model: rms", um(last.rms_um), last.rms_um},
                  {"noise_floor_um", "noise floor", um(last.noise_floor_um), last.noise_floor_um}};
    plot.series = {std::move(noise), std::move(fit), std::move(held)};
    page.sections.push_back(
        {"The error falls",
         {Figure{"steps-error", "Error by step",
                 "Root mean square on these data, and on runs that were held out while the parameters were "
                 "fitted; the band is what the readings' own noise leaves.",
                 std::move(plot)},
          std::move(table)}});
  } else {
    page.verdict = std::to_string(entries.size()) + " models; without data there is no error to show.";
    page.sections.push_back({"Models", {std::move(table)}});
  }
  return page;
}

}  // namespace trunnion::report
