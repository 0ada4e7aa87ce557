#include "trunnion/report/diagnosis_json.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;
using namespace diagnosis;

ordered_json json_of(const config::Value& value);
ordered_json json_of(const config::Table& table) {
  ordered_json out = ordered_json::object();
  for (const auto& [key, value] : table) out[key] = json_of(value);
  return out;
}
ordered_json json_of(const config::Value& value) {
  if (const auto* table = value.as_table()) return json_of(*table);
  if (const auto* array = value.as_array()) {
    ordered_json out = ordered_json::array();
    for (const auto& item : *array) out.push_back(json_of(item));
    return out;
  }
  if (const auto* text = value.as_string()) return *text;
  if (const auto* flag = std::get_if<bool>(&value.data)) return *flag;
  if (const auto* whole = std::get_if<std::int64_t>(&value.data)) return *whole;
  return std::get<double>(value.data);
}

ordered_json optional(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json ranked(const RankedEffect& r) {
  ordered_json parameters = ordered_json::object();
  for (const auto& p : r.parameters) {
    parameters[p.key] = {{"value", p.value}, {"sigma", optional(p.sigma)}};
    if (!p.also.empty()) parameters[p.key]["also"] = p.also;
  }
  ordered_json rivals = ordered_json::array();
  for (const auto& rival : r.rivals) rivals.push_back({{"effect", rival.effect}, {"rho", rival.rho}});
  ordered_json variant = ordered_json::object();
  for (const auto& [key, value] : r.variant) variant[key] = value;
  return {{"effect", r.id},
          {"variant", variant},
          {"excited", r.excited},
          {"p_value", r.p_value},
          {"chi2_drop", r.chi2_drop},
          {"dof", r.dof},
          {"parameters", parameters},
          {"heldout_rms_before_um", optional(r.heldout_before_um)},
          {"heldout_rms_after_um", optional(r.heldout_after_um)},
          {"heldout_rms_before_urad", optional(r.heldout_before_urad)},
          {"heldout_rms_after_urad", optional(r.heldout_after_urad)},
          {"detectable_um", optional(r.detectable_um)},
          {"rivals", rivals}};
}

ordered_json dependences(const std::vector<Dependence>& all) {
  ordered_json out = ordered_json::array();
  for (const auto& d : all) out.push_back({{"covariate", d.covariate}, {"p_value", d.p_value}});
  return out;
}

ordered_json next_json(const NextMeasurement& next, const Machine& machine) {
  ordered_json runs = ordered_json::array();
  for (const PlanRun& run : next.runs) runs.push_back(json_of(plan_run_table(run, machine)));
  return {{"why", next.why},
          {"minutes", next.minutes},
          {"chance_of_wrong_name_before", next.wrong_before},
          {"chance_of_wrong_name_after", next.wrong_after},
          {"runs", runs}};
}

// The one number for both quantities.
double root_per_dof(double chi2, double dof) {
  return dof > 0.0 ? std::sqrt(chi2 / dof) : std::nan("");
}

ordered_json uneven_json(const std::optional<UnevenScatter>& scatter) {
  if (!scatter) return nullptr;
  return {{"depends_on", scatter->depends_on}, {"largest", scatter->largest}};
}

ordered_json bookkeeping_json(const std::vector<Bookkeeping>& all) {
  ordered_json out = ordered_json::array();
  for (const auto& b : all) {
    const Convention& c = b.convention;
    ordered_json one = {{"kind", std::string(text_of(c.kind))}};
    if (!b.axis.empty()) one["axis"] = b.axis;
    if (!b.axes.empty()) one["axes"] = b.axes;
    if (!b.components.empty()) one["components"] = b.components;
    if (!b.run.empty()) one["run"] = b.run;
    if (!b.file.empty()) one["file"] = b.file;
    if (!b.quantity.empty()) one["quantity"] = b.quantity;
    if (c.kind == ConventionKind::unit) {
      one["factor"] = c.factor;
      one["with_uncertainty"] = c.with_uncertainty;
      if (c.only_uncertainty) one["only_uncertainty"] = true;
    }
    if (c.kind == ConventionKind::tool_length) one["by_mm"] = -c.by_mm.z();  // + is longer
    if (c.kind == ConventionKind::tool_offset || c.kind == ConventionKind::ball_offset)
      one["by_mm"] = {c.by_mm.x(), c.by_mm.y(), c.by_mm.z()};
    if (c.kind == ConventionKind::time_shift) one["by_s"] = c.clock.by_s;
    for (const auto& [column, by] : b.by_column) one["by"][column] = by;
    one["chi2_before"] = b.chi2_before;
    one["chi2_after"] = b.chi2_after;
    one["dof"] = b.dof;
    one["what"] = b.words;
    out.push_back(std::move(one));
  }
  return out;
}

ordered_json harm_json(const std::optional<HeldOutHarm>& harm) {
  if (!harm) return nullptr;
  return {{"run", harm->run},
          {"effects", harm->effects},
          {"chi2_before", harm->chi2_before},
          {"chi2_after", harm->chi2_after}};
}

ordered_json effects_of(const Model& model) {
  ordered_json effects = ordered_json::array();
  for (const ModelEffect& effect : model.effects) {
    ordered_json parameters = ordered_json::object();
    const auto& info = effect.effect->info();
    for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
      const double unit = unit_factor(info.parameters[k].unit);
      const auto& p = effect.parameters[k];
      parameters[info.parameters[k].key()] = {
          {"value", p.value / unit},
          {"sigma", p.sigma ? ordered_json(*p.sigma / unit) : ordered_json(nullptr)},
          {"fixed", p.fixed}};
    }
    effects.push_back({{"id", effect.id()}, {"parameters", parameters}});
  }
  return effects;
}

ordered_json acting_json(const std::vector<ActingRange>& all) {
  ordered_json out = ordered_json::array();
  for (const ActingRange& range : all)
    out.push_back(
        {{"of", range.of}, {"unit", range.unit}, {"from", optional(range.from)}, {"to", optional(range.to)}});
  return out;
}

ordered_json formula_json(const std::optional<ProposedFormula>& formula) {
  if (!formula) return nullptr;
  return {{"what", formula->words},
          {"acts_in", acting_json(formula->acts_in)},
          {"model", model_text(formula->alone)},
          {"effects", effects_of(formula->alone)},
          {"explained", formula->explained()},
          {"chi2_before", formula->chi2_before},
          {"chi2_after", formula->chi2_after},
          {"dof_before", formula->dof_before},
          {"dof_after", formula->dof_after},
          {"heldout_rms_before_um", optional(formula->heldout_before_um)},
          {"heldout_rms_after_um", optional(formula->heldout_after_um)},
          {"heldout_rms_before_urad", optional(formula->heldout_before_urad)},
          {"heldout_rms_after_urad", optional(formula->heldout_after_urad)}};
}

ordered_json null_json(const std::vector<NullDirection>& all) {
  ordered_json out = ordered_json::array();
  for (const auto& n : all) out.push_back(n.words);
  return out;
}

ordered_json position(const JointVector& q, const Machine& machine) {
  ordered_json out = ordered_json::object();
  for (AxisId a = 0; a < machine.axes.size(); ++a) {
    const bool linear = machine.axes[a].kind == AxisKind::linear;
    out[machine.axes[a].name + (linear ? "_mm" : "_deg")] = linear ? q[a] : q[a] * kDegreePerRad;
  }
  return out;
}

std::string text_of_json(const ordered_json& json) {
  return json_text(json);
}

}  // namespace

std::string diagnosis_json(const Diagnosis& d, const Machine& machine) {
  ordered_json ranking = ordered_json::array();
  for (const auto& r : d.ranking) ranking.push_back(ranked(r));
  ordered_json out = {{"verdict", std::string(text_of(d.verdict))},
                      {"effects", d.effects},
                      {"sets", d.sets},
                      {"confidence", d.confidence},
                      {"paragraph", d.paragraph},
                      {"ranking", ranking},
                      {"residual",
                       {{"rms_um", optional(d.rms_um)},
                        {"rms_urad", optional(d.rms_urad)},
                        {"chi2", d.chi2},
                        {"dof", d.dof},
                        {"root_chi2_per_dof", optional(root_per_dof(d.chi2, d.dof))},
                        {"noise_floor_um", optional(d.noise_floor_um)},
                        {"noise_floor_urad", optional(d.noise_floor_urad)},
                        {"noise_factor", d.scatter.factor},
                        {"autocorrelation", d.scatter.autocorrelation},
                        {"uneven_scatter", uneven_json(d.scatter.uneven)},
                        {"outliers", d.outliers},
                        {"explained", d.explained},
                        {"depends_on", dependences(d.depends_on)},
                        {"after_adding_depends_on", dependences(d.leftover)}}},
                      {"data_problems", d.rows.problems},
                      {"bookkeeping", bookkeeping_json(d.bookkeeping)},
                      {"odd_runs", d.rows.odd_runs},
                      {"held_out_harm", harm_json(d.harm)},
                      {"formula", formula_json(d.formula)},
                      {"next_measurement", d.next ? next_json(*d.next, machine) : ordered_json(nullptr)},
                      {"null_directions", null_json(d.null_directions)}};
  return text_of_json(out);
}

std::string evaluation_json(const Evaluation& e, const Machine& machine) {
  ordered_json runs = ordered_json::array(), worst = ordered_json::array();
  for (const auto& r : e.runs)
    runs.push_back({{"run_id", r.run_id},
                    {"rms_um", optional(r.displacement.rms)},
                    {"max_um", optional(r.displacement.largest)},
                    {"rms_urad", optional(r.rotation.rms)},
                    {"max_urad", optional(r.rotation.largest)},
                    {"chi2", r.chi2},
                    {"readings", r.readings}});
  for (const auto& w : e.worst)
    worst.push_back({{"file", w.file},
                     {"row", w.row},
                     {"run_id", w.run_id},
                     {"q", position(w.q, machine)},
                     {w.quantity == Quantity::displacement ? "residual_um" : "residual_urad", w.residual},
                     {"normalised", w.normalised}});
  return text_of_json({{"rms_um", optional(e.displacement.rms)},
                       {"p95_um", optional(e.displacement.p95)},
                       {"max_um", optional(e.displacement.largest)},
                       {"rms_urad", optional(e.rotation.rms)},
                       {"p95_urad", optional(e.rotation.p95)},
                       {"max_urad", optional(e.rotation.largest)},
                       {"root_chi2_per_dof", optional(root_per_dof(e.chi2, e.dof))},
                       {"chi2", e.chi2},
                       {"dof", e.dof},
                       {"p_value", e.p_value},
                       {"replicate_p_value", optional(e.replicate_p)},
                       {"replicate_um", optional(e.replicate_um)},
                       {"verdict", e.verdict},
                       {"beyond_measured", e.beyond},
                       {"runs", runs},
                       {"worst", worst},
                       {"by_covariate", dependences(e.by_covariate)}});
}

std::string model_json(const Model& model) {
  return text_of_json({{"name", model.name}, {"effects", effects_of(model)}});
}

std::string fit_json(const Fit& f, const Dataset& data) {
  ordered_json setups = ordered_json::array();
  for (std::size_t r = 0; r < f.setup_P.size(); ++r)
    setups.push_back(
        {{"run_id", data.context.runs[r].id},
         {"setup_um",
          {f.setup_P[r].x() / kMmPerUm, f.setup_P[r].y() / kMmPerUm, f.setup_P[r].z() / kMmPerUm}}});
  std::size_t outliers = 0;
  for (const bool b : f.outlier) outliers += b ? 1 : 0;
  const auto common = [](const std::optional<double>& v, double unit) {
    return v ? ordered_json(*v / unit) : ordered_json(nullptr);
  };
  return text_of_json({{"chi2", f.chi2},
                       {"dof", f.dof},
                       {"converged", f.converged},
                       {"sigma_factor", f.sigma_factor},
                       {"parameters", f.parameter_count},
                       {"outliers", outliers},
                       {"u_common_um", common(f.common.displacement_mm, kMmPerUm)},
                       {"u_common_urad", common(f.common.rotation_rad, kRadPerUrad)},
                       {"effects", effects_of(f.model)},
                       {"setups", setups},
                       {"null_directions", null_json(f.null_directions)}});
}

std::string plan_json(const Diagnosis& diagnosis, const Machine& machine) {
  const std::string verdict(text_of(diagnosis.verdict));
  if (!diagnosis.next) {
    return text_of_json(
        {{"verdict", verdict}, {"why", diagnosis::what_next(diagnosis)}, {"runs", ordered_json::array()}});
  }
  ordered_json out = {{"verdict", verdict}};
  out.update(next_json(*diagnosis.next, machine));
  return text_of_json(out);
}

std::string imported_json(const std::string& file, const std::string& measurements) {
  Diagnostics none;  // our own text
  config::CsvRows rows(measurements, file, none);
  std::size_t count = 0;
  struct Range {
    double smallest = std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
  };
  std::vector<Range> ranges(rows.columns().size());
  for (; rows.next(); ++count) {
    for (std::size_t c = 0; c < ranges.size(); ++c) {
      const std::string field(rows.fields()[c]);
      char* end = nullptr;
      const double value = std::strtod(field.c_str(), &end);
      if (end == field.c_str() || *end != '\0' || !std::isfinite(value)) continue;
      ranges[c].smallest = std::min(ranges[c].smallest, value);
      ranges[c].largest = std::max(ranges[c].largest, value);
    }
  }
  ordered_json of_columns = ordered_json::array();
  for (std::size_t c = 0; c < ranges.size(); ++c) {
    const bool known = ranges[c].smallest <= ranges[c].largest;
    of_columns.push_back({{"column", rows.columns()[c]},
                          {"smallest", known ? ordered_json(ranges[c].smallest) : nullptr},
                          {"largest", known ? ordered_json(ranges[c].largest) : nullptr}});
  }
  return text_of_json({{"file", file}, {"columns", rows.columns()}, {"rows", count}, {"ranges", of_columns}});
}

std::string improve_json(const std::vector<ImproveStep>& steps) {
  ordered_json out = ordered_json::array();
  for (const auto& s : steps)
    out.push_back({{"model", s.model.name},
                   {"rms_um", optional(s.error.rms_um)},
                   {"rms_urad", optional(s.error.rms_urad)},
                   {"heldout_rms_um", optional(s.error.heldout_um)},
                   {"heldout_rms_urad", optional(s.error.heldout_urad)},
                   {"noise_floor_um", optional(s.error.noise_floor_um)},
                   {"noise_floor_urad", optional(s.error.noise_floor_urad)},
                   {"root_chi2_per_dof", optional(root_per_dof(s.diagnosis.chi2, s.diagnosis.dof))},
                   {"chi2", s.diagnosis.chi2},
                   {"dof", s.diagnosis.dof},
                   {"verdict", std::string(text_of(s.diagnosis.verdict))},
                   {"effects", s.diagnosis.effects},
                   {"confidence", s.diagnosis.confidence},
                   {"paragraph", s.diagnosis.paragraph}});
  return text_of_json({{"steps", out}});
}

std::string history_json(const std::vector<HistoryEntry>& entries) {
  ordered_json out = ordered_json::array();
  for (const auto& e : entries)
    out.push_back({{"name", e.name},
                   {"parent", e.parent},
                   {"effects", e.effects},
                   {"rms_um", optional(e.rms_um)},
                   {"rms_urad", optional(e.rms_urad)},
                   {"heldout_rms_um", optional(e.heldout_um)},
                   {"heldout_rms_urad", optional(e.heldout_urad)},
                   {"chi2", e.chi2},
                   {"dof", e.dof},
                   {"root_chi2_per_dof", optional(root_per_dof(e.chi2, e.dof))},
                   {"noise_floor_um", optional(e.noise_floor_um)},
                   {"noise_floor_urad", optional(e.noise_floor_urad)}});
  return text_of_json({{"steps", out}});
}

SimulationSummary summary_of(const Dataset& data, const Plan& plan, std::uint64_t seed) {
  double minutes = 0.0;
  for (const PlanRun& run : plan.runs) minutes += run.minutes;
  // Of all, then of each run; one a quantity.
  struct Sum {
    double squares = 0.0;
    std::size_t count = 0;
    ordered_json rms() const {
      return count == 0 ? ordered_json(nullptr)
                        : ordered_json(std::sqrt(squares / static_cast<double>(count)));
    }
  };
  struct Sums {
    Sum um, urad;
  };
  std::vector<Sums> sums(data.context.runs.size());
  Sums all;
  for (const Reading& reading : data.readings) {
    const bool length = reading.quantity == Quantity::displacement;
    const double value = reading.value / (length ? kMmPerUm : kRadPerUrad);
    const std::size_t run = data.run_of(reading);
    for (Sums* to : {&all, run < sums.size() ? &sums[run] : nullptr}) {
      if (to == nullptr) continue;
      Sum& sum = length ? to->um : to->urad;
      sum.squares += value * value;
      ++sum.count;
    }
  }
  ordered_json out = {
      {"readings", data.readings.size()}, {"minutes", minutes},         {"seed", seed},
      {"rms_um", all.um.rms()},           {"rms_urad", all.urad.rms()}, {"runs", ordered_json::array()}};
  for (std::size_t i = 0; i < sums.size(); ++i)
    out["runs"].push_back({{"run_id", data.context.runs[i].id},
                           {"readings", sums[i].um.count + sums[i].urad.count},
                           {"rms_um", sums[i].um.rms()},
                           {"rms_urad", sums[i].urad.rms()}});
  const std::string text = std::to_string(data.readings.size()) + " readings in " +
                           std::to_string(plan.runs.size()) + " runs, " + shortest_text(minutes) +
                           " min of machine time";
  return {text, json_text(out)};
}

}  // namespace trunnion::report
