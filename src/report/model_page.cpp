#include "trunnion/report/model_page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/contract.hpp"

#include "report/effect_tables.hpp"
#include "report/nc_figures.hpp"
#include "report/residual_figures.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

using diagnosis::Diagnosis;

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
              " times too long, colours up to " + um_text(scale.largest_um) + ".",
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

Section next_section(const Machine& machine, const Diagnosis& d) {
  Section out{"The next measurement", {}};
  out.items.emplace_back(Paragraph{d.next->why});
  Table table;
  table.id = "next";
  table.title = "Runs";
  table.caption =
      "Total " + short_number(d.next->minutes, 3) +
      " min; probability of naming a wrong effect: " + short_number(100 * d.next->wrong_before, 2) +
      " % now, " + short_number(100 * d.next->wrong_after, 2) + " % afterwards.";
  table.columns = {"run", "minutes", "readings of"};
  table.numeric = {false, true, false};
  for (const auto& run : d.next->runs) {
    table.rows.push_back({run.id, short_number(run.minutes, 3),
                          run.quantity == diagnosis::Quantity::displacement ? "displacement" : "rotation"});
  }
  if (auto scene = planned_scene(machine, d.next->runs)) out.items.emplace_back(std::move(*scene));
  out.items.emplace_back(std::move(table));
  return out;
}

std::vector<std::string> names_of(const std::vector<diagnosis::Dependence>& all) {
  std::vector<std::string> out;
  out.reserve(all.size());
  for (const auto& d : all) out.push_back(d.covariate);
  return out;
}

std::string verdict_words(diagnosis::Verdict verdict) {
  std::string out(diagnosis::text_of(verdict));
  std::replace(out.begin(), out.end(), '_', ' ');
  return out;
}

Section model_section(const ModelPageInput& input, const Model& model) {
  return {
      "What the model knows",
      {budget_figure(*input.machine, *input.data, model), model_table(*input.machine, *input.data, model)}};
}

// The verdict in one sentence, with what these data could have shown.
std::string headline(const Diagnosis& d) {
  using diagnosis::Verdict;
  const std::string named = joined(d.effects, " + ");
  std::string out;
  switch (d.verdict) {
    case Verdict::nothing_to_find:
      out = "Nothing is missing that these data could show";
      break;
    case Verdict::named:
      out = "Missing: " + named + "; with it the rest is noise";
      break;
    case Verdict::named_but_incomplete:
      out = "Missing: " + named +
            (d.only_number_is_open() ? "; how often an error repeats is open"
                                     : ", and something more that is not in the library");
      break;
    case Verdict::ambiguous: {
      std::vector<std::string> sets;
      // A sentence that names a dozen says nothing; all of them stand below, in words.
      constexpr std::size_t kNamed = 4;
      const std::size_t shown = d.sets.size() > kNamed + 1 ? kNamed : d.sets.size();
      for (std::size_t i = 0; i < shown; ++i) sets.push_back(joined(d.sets[i], " + "));
      if (shown < d.sets.size())
        sets.push_back("one of " + std::to_string(d.sets.size() - shown) + " others");
      for (const auto& b : d.bookkeeping)
        sets.push_back("a mistake in the files (" + std::string(text_of(b.convention.kind)) + ")");
      out = sets.size() == 1
                ? "Something is missing, perhaps " + sets.front()
                : "Something is missing, and these data cannot tell which: " + joined(sets, " or ");
      break;
    }
    case Verdict::not_in_library:
      out = "Something real is missing that is none of the effects of the library";
      break;
    case Verdict::not_testable:
      out = "These runs cannot answer the question";
      break;
    case Verdict::data_problem:
      out = "The readings do not fit their own uncertainty";
      break;
    case Verdict::bookkeeping:
      return d.bookkeeping.front().words;
  }
  double best = std::numeric_limits<double>::infinity();
  double worst = 0.0;
  std::size_t blind = 0;
  for (const auto& r : d.ranking) {
    if (!r.detectable_um) ++blind;
    best = std::min(best, r.detectable_um.value_or(best));
    worst = std::max(worst, r.detectable_um.value_or(worst));
  }
  if (worst > 0.0)
    out += ". Detection limits: " + um_text(best) + " rms for the effect seen best, " + um_text(worst) +
           " for the one seen worst";
  if (blind > 0) out += "; " + std::to_string(blind) + " effects cannot be seen in these runs";
  return out + ".";
}

// The model as given, and with one addition after the other.
std::vector<diagnosis::HistoryEntry> steps_of(const ModelPageInput& input, const Diagnosis& d,
                                              const diagnosis::Added& added) {
  std::vector<diagnosis::HistoryEntry> out;
  out.push_back(diagnosis::history_entry(*input.machine, *input.data, d.base.model));
  out.back().name = "as given (fitted)";
  for (std::size_t i = 1; i <= d.additions.size(); ++i) {
    const bool whole = i == d.additions.size();
    const std::vector<ModelEffect> some(d.additions.begin(),
                                        d.additions.begin() + static_cast<std::ptrdiff_t>(i));
    out.push_back(diagnosis::history_entry(
        *input.machine, *input.data,
        whole ? added.fit.model
              : diagnosis::add_and_fit(*input.machine, *input.data, d.base.model, some).fit.model));
    out.back().name = "+ " + d.additions[i - 1].id();
  }
  return out;
}

// Of a story, all lists as long as the story.
struct Story {
  const std::vector<diagnosis::HistoryEntry>& entries;
  const std::vector<Model>& models;
  const std::vector<std::string>& sentences;
};

// What a model has that the one before it lacks.
std::string added_text(const std::vector<diagnosis::HistoryEntry>& entries, std::size_t k) {
  if (k == 0)
    return entries[0].effects.empty() ? "Nothing is known yet."
                                      : "It begins with " + joined(entries[0].effects, " + ") + ".";
  std::vector<std::string> added;
  const auto& before = entries[k - 1].effects;
  for (const auto& effect : entries[k].effects) {
    if (std::find(before.begin(), before.end(), effect) == before.end()) added.push_back(effect);
  }
  return added.empty() ? "No effect is added." : "Added: " + joined(added, " + ") + ".";
}

// One step after the other: the sentence, the residual vectors at one scale, the bar that falls.
void add_story(Page& page, const ModelPageInput& input, const Story& story) {
  std::optional<VectorScale> scale;
  for (std::size_t k = 0; k < story.models.size(); ++k) {
    const Residuals residuals =
        residuals_of(*input.machine, *input.data, as_it_stands(input, story.models[k]));
    if (!scale) scale = vector_scale(residuals);
    const std::string number = std::to_string(k);
    const std::string& name = story.entries[k].name;
    Section section{"Step " + number + (name == "step " + number ? "" : ": " + name),
                    {Paragraph{story.sentences[k]}},
                    true};
    section.items.emplace_back(
        vectors_figure(residuals, *scale, "vectors-" + number, "What is left at this step"));
    Figure falls = steps_figure(story.entries, k + 1);
    falls.id += "-" + number;
    section.items.emplace_back(std::move(falls));
    page.sections.push_back(std::move(section));
  }
}

// One figure a quantity, for what was measured.
void add_size(Page& page, const std::string& id, const std::string& label, double um, double urad) {
  if (std::isfinite(um)) page.facts.push_back({id + "_um", label, um_text(um), um});
  if (std::isfinite(urad)) page.facts.push_back({id + "_urad", label, short_number(urad, 4) + " µrad", urad});
}

std::string measured_text(double value, int digits) {
  return std::isfinite(value) ? short_number(value, digits) : "–";
}

// The readings that stand out most.
Table worst_table(const diagnosis::Evaluation& e) {
  constexpr std::size_t kShown = 10;
  Table table;
  table.id = "worst";
  table.title = "The worst readings";
  table.columns = {"file", "row", "run", "residual", "times its uncertainty"};
  table.numeric = {false, true, false, true, true};
  for (std::size_t k = 0; k < e.worst.size() && k < kShown; ++k) {
    const auto& w = e.worst[k];
    const bool length = w.quantity == diagnosis::Quantity::displacement;
    table.rows.push_back({w.file, std::to_string(w.row), w.run_id,
                          short_number(w.residual, 4) + (length ? " µm" : " µrad"),
                          short_number(std::abs(w.normalised), 3)});
  }
  return table;
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
  add_size(page, "rms", "rms residual", e.displacement.rms, e.rotation.rms);
  add_size(page, "p95", "95 % are below", e.displacement.p95, e.rotation.p95);
  add_size(page, "max", "largest residual", e.displacement.largest, e.rotation.largest);
  if (e.displacement.rms > 0.0)
    page.verdict += " It leaves " + um_text(e.displacement.rms) + " rms, at most " +
                    um_text(e.displacement.largest) + ".";
  if (!e.beyond.empty())
    page.verdict += " The model was not measured where these readings lie: " + e.beyond + ".";
  page.facts.insert(page.facts.end(), {{"chi2", "chi-square", short_number(e.chi2, 5), e.chi2},
                                       {"dof", "degrees of freedom", short_number(e.dof, 6), e.dof}});
  const Residuals residuals = residuals_of(*input.machine, *input.data, as_it_stands(input, model));
  Section first{"Residual",
                {vectors_figure(residuals, vector_scale(residuals), "vectors", "Residual vectors")}};
  first.items.emplace_back(worst_table(e));
  page.sections.push_back(std::move(first));
  if (!model.effects.empty()) page.sections.push_back(model_section(input, model));
  add_residual_sections(page, residuals, names_of(e.by_covariate));
  return page;
}

Page fit_page(const ModelPageInput& input, const diagnosis::Fit& f) {
  Page page = start(input, "Fit of " + f.model.name + " to " + input.machine->name, "", Tone::neutral);
  const double ratio = f.dof > 0.0 ? f.chi2 / f.dof : std::numeric_limits<double>::quiet_NaN();
  const std::size_t outliers = static_cast<std::size_t>(std::count(f.outlier.begin(), f.outlier.end(), true));
  std::size_t known = 0;
  for (const ModelEffect& effect : f.model.effects) {
    for (const ParameterValue& p : effect.parameters)
      if (p.sigma && std::abs(p.value) > 2.0 * *p.sigma) ++known;
  }
  page.tone = !f.converged ? Tone::bad : f.sigma_factor > 1.0 ? Tone::neutral : Tone::good;
  page.verdict =
      std::to_string(input.data->readings.size()) + " readings, " + std::to_string(f.parameter_count) +
      " parameters: " +
      (f.sigma_factor > 1.0
           ? "the readings scatter " + short_number(f.sigma_factor, 3) +
                 " times as much as their uncertainty says, so something is missing from the model "
                 "or the uncertainty is too small"
           : "the model meets the readings within their uncertainty") +
      " (chi-square over degrees of freedom " + short_number(ratio, 3) + "); " + std::to_string(known) +
      " parameters are more than two sigma from zero" + (f.converged ? "." : "; THE FIT DID NOT CONVERGE.");
  page.facts = {
      {"chi2", "chi-square", short_number(f.chi2, 5), f.chi2},
      {"dof", "degrees of freedom", short_number(f.dof, 6), f.dof},
      {"sigma_factor", "scatter over stated uncertainty", short_number(f.sigma_factor, 4), f.sigma_factor},
      {"outliers", "outliers", std::to_string(outliers), static_cast<double>(outliers)}};
  const Residuals residuals = residuals_of(*input.machine, *input.data, f);
  Section first{"What was fitted", {}};
  if (!f.model.effects.empty()) first.items.emplace_back(significance_figure(f.model));
  first.items.emplace_back(vectors_figure(residuals, vector_scale(residuals), "vectors", "What is left"));
  page.sections.push_back(std::move(first));
  if (!f.model.effects.empty()) page.sections.push_back(model_section(input, f.model));
  if (!f.null_directions.empty()) {
    Section blind{"What no reading sees", {}};
    for (const auto& direction : f.null_directions) blind.items.emplace_back(Paragraph{direction.words});
    page.sections.push_back(std::move(blind));
  }
  add_residual_sections(page, residuals, {});
  return page;
}

Page bare_model_page(const ModelPageInput& input, const Model& model, const std::string& title) {
  Page page = start(input, title,
                    std::to_string(model.effects.size()) +
                        " effects; without data the value of the new one is not known yet. Next: trunnion "
                        "model fit with measurements.",
                    Tone::neutral);
  page.sections.push_back({"The model", {model_table(model)}});
  return page;
}

Page diagnosis_page(const ModelPageInput& input, const Diagnosis& d) {
  const bool clear =
      d.verdict == diagnosis::Verdict::nothing_to_find || d.verdict == diagnosis::Verdict::named;
  Page page = start(input, "What the model of " + input.machine->name + " lacks", headline(d),
                    clear ? Tone::good : Tone::neutral);
  page.facts = {{"verdict", "verdict", verdict_words(d.verdict), std::nullopt},
                {"effects", "missing", d.effects.empty() ? "–" : joined(d.effects, " + "), std::nullopt},
                {"confidence", "confidence", short_number(100 * d.confidence, 3) + " %", d.confidence},
                {"chi2", "chi-square", short_number(d.chi2, 5), d.chi2},
                {"dof", "degrees of freedom", short_number(d.dof, 6), d.dof}};
  add_size(page, "rms", "rms residual", d.rms_um, d.rms_urad);
  add_size(page, "noise_floor", "noise floor", d.noise_floor_um, d.noise_floor_urad);
  page.facts.push_back({"next", "what to measure next", diagnosis::what_next(d), {}});
  std::optional<diagnosis::Added> added;
  if (!d.additions.empty())
    added = diagnosis::add_and_fit(*input.machine, *input.data, d.base.model, d.additions, &d);
  page.sections.push_back({"In words", {Paragraph{d.paragraph}}});
  if (added) page.sections.push_back({"The error falls", {steps_figure(steps_of(input, d, *added))}});
  const Residuals before = residuals_of(*input.machine, *input.data, d.base);
  const VectorScale scale = vector_scale(before);
  Section vectors{
      "Before and after",
      {vectors_figure(before, scale, "vectors-before", "Residual vectors, model as given (fitted)")}};
  if (added) {
    vectors.items.emplace_back(vectors_figure(residuals_of(*input.machine, *input.data, added->fit), scale,
                                              "vectors-after",
                                              "Residual vectors with " + joined(d.effects, " + ")));
  }
  page.sections.push_back(std::move(vectors));
  add_residual_sections(page, before, names_of(d.depends_on));
  const Model& model = added ? added->fit.model : d.base.model;
  if (!model.effects.empty()) page.sections.push_back(model_section(input, model));
  Section ranking{"The candidates", {ranking_table(*input.machine, input.data->context, d)}};
  if (auto figure = rivals_figure(d)) ranking.items.emplace_back(std::move(*figure));
  for (const auto& direction : d.null_directions) ranking.items.emplace_back(Paragraph{direction.words});
  page.sections.push_back(std::move(ranking));
  if (d.next) page.sections.push_back(next_section(*input.machine, d));
  return page;
}

Page history_page(const ModelPageInput& input, const std::vector<diagnosis::HistoryEntry>& entries,
                  const std::vector<Model>& models) {
  Page page = start(input, "How the error of " + input.machine->name + " fell", "", Tone::neutral);
  Table table;
  table.id = "steps";
  table.title = "Models";
  table.columns = {"model",
                   "parent",
                   "effects",
                   "rms / µm",
                   "rms / µrad",
                   "held out / µm",
                   "held out / µrad",
                   "noise floor / µm",
                   "noise floor / µrad",
                   "chi-square",
                   "dof"};
  table.numeric = {false, false, false, true, true, true, true, true, true, true, true};
  for (const auto& e : entries) {
    table.rows.push_back(
        {e.name, e.parent, joined(e.effects, " + "), measured_text(e.rms_um, 4), measured_text(e.rms_urad, 4),
         optional_text(e.heldout_um), optional_text(e.heldout_urad), measured_text(e.noise_floor_um, 3),
         measured_text(e.noise_floor_urad, 3), short_number(e.chi2, 5), short_number(e.dof, 6)});
  }
  if (input.data != nullptr && !entries.empty()) {
    const auto& first = entries.front();
    const auto& last = entries.back();
    const bool lengths = std::isfinite(last.rms_um);
    const auto error = [lengths](const diagnosis::HistoryEntry& e) {
      return lengths ? um_text(e.heldout_um.value_or(e.rms_um))
                     : short_number(e.heldout_urad.value_or(e.rms_urad), 4) + " µrad";
    };
    page.verdict =
        "From " + error(first) + " with " + first.name + " to " + error(last) + " with " + last.name +
        (last.heldout_um || last.heldout_urad ? " on held-out runs" : "") + "; the noise floor is " +
        (lengths ? um_text(last.noise_floor_um) : short_number(last.noise_floor_urad, 4) + " µrad") + ".";
    add_size(page, "rms", "last model: rms", last.rms_um, last.rms_urad);
    add_size(page, "noise_floor", "noise floor", last.noise_floor_um, last.noise_floor_urad);
    page.sections.push_back({"The error falls", {steps_figure(entries), std::move(table)}});
    std::vector<std::string> added;
    for (std::size_t k = 0; k < entries.size(); ++k) added.push_back(added_text(entries, k));
    add_story(page, input, {entries, models, added});
  } else {
    page.verdict = std::to_string(entries.size()) + " models; without data there is no error to show.";
    page.sections.push_back({"Models", {std::move(table)}});
  }
  return page;
}

Page improve_page(const ModelPageInput& input, const std::vector<diagnosis::ImproveStep>& steps) {
  TRUNNION_EXPECTS(!steps.empty());
  std::vector<diagnosis::HistoryEntry> entries;
  Table said{"verdicts",
             "What was said at each step",
             "",
             {"step", "verdict", "missing", "confidence / %"},
             {true, false, false, true},
             {},
             {}};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const auto& step = steps[k];
    diagnosis::HistoryEntry entry = step.error;
    entry.name = "step " + std::to_string(k);
    entry.parent = k == 0 ? "" : "step " + std::to_string(k - 1);
    entries.push_back(std::move(entry));
    const auto& d = step.diagnosis;
    said.rows.push_back({std::to_string(k), verdict_words(d.verdict),
                         d.effects.empty() ? "–" : joined(d.effects, " + "),
                         short_number(100 * d.confidence, 3)});
  }
  const auto& last = steps.back();
  Page page = history_page(input, entries, {});
  page.title = "How the model of " + input.machine->name + " was improved";
  page.verdict += " " + headline(last.diagnosis);
  const bool done = last.diagnosis.verdict == diagnosis::Verdict::nothing_to_find;
  page.tone = done ? Tone::good : Tone::neutral;
  page.facts.push_back({"next", "what to measure next", diagnosis::what_next(last.diagnosis), {}});
  page.sections.front().items.emplace_back(std::move(said));
  std::vector<Model> models;
  std::vector<std::string> sentences;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    models.push_back(steps[k].model);
    sentences.push_back(added_text(entries, k) + " " + steps[k].diagnosis.paragraph);
  }
  add_story(page, input, {entries, models, sentences});
  const Residuals after = residuals_of(*input.machine, *input.data, as_it_stands(input, last.model));
  if (!last.model.effects.empty()) page.sections.push_back(model_section(input, last.model));
  add_residual_sections(page, after, names_of(last.diagnosis.depends_on));
  if (last.diagnosis.next) page.sections.push_back(next_section(*input.machine, last.diagnosis));
  return page;
}

Page simulation_page(const ModelPageInput& input, const Model& truth, const std::string& verdict) {
  Page page = start(input, "Virtual measurements of " + input.machine->name, verdict, Tone::neutral);
  const Residuals readings = readings_of(*input.machine, *input.data);
  double squares = 0.0;
  for (const double v : readings.um) squares += v * v;
  const auto count = static_cast<double>(readings.um.size());
  const double rms = readings.um.empty() ? 0.0 : std::sqrt(squares / count);
  page.facts = {{"readings", "readings", std::to_string(readings.um.size()), count},
                {"rms_um", "rms reading", um_text(rms), rms}};
  Figure vectors = vectors_figure(readings, vector_scale(readings), "vectors", "Readings as vectors");
  std::get<SpacePlot>(vectors.plot).colour.label = "reading";
  BoxPlot by_run = residual_by_run(readings);
  by_run.y.label = "reading";
  Section first{"What the machine would show",
                {std::move(vectors),
                 Figure{"runs", "Readings by run",
                        "Box: the middle half; whiskers to 1.5 times its length; beyond: single readings.",
                        std::move(by_run)}}};
  page.sections.push_back(std::move(first));
  if (!truth.effects.empty()) {
    page.sections.push_back(model_section(input, truth));
    page.sections.back().title = "What it is made of";
  }
  Section against{"What the readings depend on", {}};
  for (Figure& figure : residual_against_covariates(readings, {}, "reading"))
    against.items.emplace_back(std::move(figure));
  if (!against.items.empty()) page.sections.push_back(std::move(against));
  return page;
}

}  // namespace trunnion::report
