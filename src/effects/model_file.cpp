#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/config/section.hpp"
#include "trunnion/effects/measured_tools.hpp"
#include "trunnion/effects/model.hpp"

#include "effects/formula.hpp"
#include "effects/model_checks.hpp"
#include "effects/table_effect.hpp"

namespace trunnion {
namespace {

using config::Section;
using Keys = std::vector<std::pair<std::string, std::string>>;

// Keys that choose a variant; they may stand in the effect or among its parameters.
constexpr std::array<std::string_view, 4> kVariantKeys = {"component", "axis", "sensor", "run"};

// Reads the [[effect]] tables of one file, which share the context.
class EffectReader {
 public:
  EffectReader(const Machine& machine, Model& model) : machine_(machine), model_(model) {}

  /// A table could not be read: the file is not wrong.
  bool unreadable() const { return unreadable_; }

  void read(Section& s) {
    const std::string id = s.text("id");
    if (id.empty()) return;
    const std::size_t errors = s.diagnostics().error_count();
    auto parameters = s.find_section("parameters");
    auto effect = id.starts_with("user:") ? formula(s, id, parameters)
                  : s.has("table")        ? table(s, id)
                                          : library(s, id, parameters);
    if (!effect) {
      if (s.diagnostics().error_count() == errors) s.error("id", effect.error().message);
      ask_for_all(s);
      return;
    }
    ModelEffect entry = model_effect(*effect);
    entry.where = s.where("id");
    entry.variant_given = variant_given_;
    read_parameters(s, parameters, entry);
    if (parameters) effects::check_sizes(*parameters, entry);
    read_sigma(s, entry);
    read_fixed(s, entry);
    if (const auto* evidence = s.raw("evidence", config::KeyType::table)) {
      if (const auto* t = evidence->as_table())
        entry.evidence = *t;
      else
        s.error("evidence", "'evidence' must be a table");
    }
    s.finish();
    check_twice(s, entry);
    if (s.diagnostics().error_count() == errors) effects::try_out(s, entry, machine_, model_.context);
    model_.effects.push_back(std::move(entry));
  }

 private:
  // After an error that makes the rest meaningless: no further complaints about this effect's keys.
  static void ask_for_all(Section& s) { static_cast<void>(s.keys("")); }

  Keys variant_keys(Section& s, std::optional<Section>& parameters) {
    Keys out;
    for (const std::string_view key : kVariantKeys) {
      auto text = s.find_text(key);
      if (!text && parameters) {
        const auto* value = parameters->raw(key, config::KeyType::text);
        if (value != nullptr && value->as_string() != nullptr) text = *value->as_string();
      }
      if (text) out.emplace_back(key, *text);
    }
    // component = "EZ" with axis = "X" is EZX.
    const auto axis = std::find_if(out.begin(), out.end(), [](const auto& e) { return e.first == "axis"; });
    if (axis == out.end()) return out;
    const std::string carrier = axis->second;
    out.erase(axis);
    for (auto& [key, value] : out) {
      if (key == "component" && value.size() == 2)
        value += carrier;
      else if (key == "component" && (value.size() < 2 || value.substr(2) != carrier))
        s.error("axis", "component " + value + " is not carried by axis " + carrier);
    }
    return out;
  }

  // Runs that the keys of a set-up tilt name: A_<run>_urad.
  void runs_of_tilts(Section& parameters) {
    for (const std::string& key : parameters.keys()) {
      if (key.size() < 3 || key[1] != '_' || unit_of_key(key) == Unit::none) continue;
      const std::string run = key.substr(2, key.rfind('_') - 2);
      auto& runs = model_.context.runs;
      const bool known = std::any_of(runs.begin(), runs.end(), [&](const RunInfo& r) { return r.id == run; });
      if (!known && key.rfind('_') > 2) runs.push_back({run, 0.0});
    }
  }

  Result<std::shared_ptr<const Effect>> library(Section& s, const std::string& id,
                                                std::optional<Section>& parameters) {
    const Keys variant = variant_keys(s, parameters);
    if (id == "setup_tilt" && parameters) runs_of_tilts(*parameters);
    auto effect = make_effect(machine_, model_.context, canonical_id(id), variant);
    variant_given_ = !variant.empty() || !effect || (*effect)->info().variant.empty();
    if (effect && !variant_given_ && parameters && !parameters->keys().empty()) {
      const auto& choice = (*effect)->info().variant.front();
      s.error("id", "effect '" + id + "' has values but does not say which " + choice.first +
                        " they belong to: write " + choice.first + " = \"" + choice.second + "\" or another");
    }
    return effect;
  }

  // component:EXX, location:C; squareness:COY and the like.
  static std::string canonical_id(const std::string& id) {
    const auto colon = id.find(':');
    return colon == std::string::npos ? id : id.substr(0, colon + 1) + canonical_symbol(id.substr(colon + 1));
  }

  Result<std::shared_ptr<const Effect>> formula(Section& s, const std::string& id,
                                                std::optional<Section>& parameters) {
    effects::FormulaSpec spec;
    variant_given_ = true;
    spec.id = id;
    const std::size_t errors = s.diagnostics().error_count();
    spec.joint = s.text("joint");
    spec.component = s.text("component");
    spec.expression = s.text("expression");
    spec.what = s.find_text("what").value_or("");
    auto range = s.find_section("range");
    if (range) check_range(*range, parameters);
    if (parameters) {
      for (const std::string& key : parameters->keys()) {
        effects::FormulaSpec::Key p{key, 0.0, std::nullopt};
        const double factor = unit_factor(unit_of_key(key));
        p.value = parameters->find_number(key).value_or(0.0) * factor;
        if (range) p.range = read_range(*range, key, factor);
        spec.parameters.push_back(std::move(p));
      }
    }
    if (s.diagnostics().error_count() > errors) return fail(ErrorCode::wrong_input, "");
    auto effect = effects::make_formula_effect(spec, machine_, model_.context);
    if (!effect) s.error(place_of(effect.error().message), effect.error().message);
    return effect;
  }

  static void check_range(Section& range, const std::optional<Section>& parameters) {
    for (const std::string& key : range.keys()) {
      if (!parameters || !parameters->has(key))
        range.error(key, "'range' names '" + key + "', which is none of the parameters");
    }
  }

  static std::string_view place_of(const std::string& message) {
    for (const std::string_view key : {"joint", "component"}) {
      if (message.starts_with("'" + std::string(key) + "'")) return key;
    }
    return message.starts_with("parameter") ? "parameters" : "expression";
  }

  static std::optional<std::array<double, 2>> read_range(Section& range, const std::string& key,
                                                         double factor) {
    if (!range.has(key)) return std::nullopt;
    const auto ends = range.find_numbers(key);
    if (!ends) return std::nullopt;
    if (ends->size() != 2 || !((*ends)[0] < (*ends)[1])) {
      range.error(key, "'" + key + "' must be two numbers, the smaller first");
      return std::nullopt;
    }
    return std::array{(*ends)[0] * factor, (*ends)[1] * factor};
  }

  Result<std::shared_ptr<const Effect>> table(Section& s, const std::string& id) {
    effects::TableSpec spec;
    variant_given_ = true;
    spec.component = id.starts_with("component:") ? id.substr(id.find(':') + 1) : "";
    if (spec.component.size() != 3 || spec.component[0] != 'E' ||
        std::string_view("XYZABC").find(spec.component[1]) == std::string_view::npos) {
      return fail(ErrorCode::wrong_input,
                  "a table belongs to a component error as \"component:EXX\", not to '" + id + "'");
    }
    spec.file = s.text("table");
    s.takes("interpolation", {"linear", "bilinear", "nurbs", "spline"});
    if (const auto method = s.find_text("interpolation")) {
      const auto known = interpolation_of(*method);
      if (!known)
        s.error("interpolation",
                "'interpolation' is \"" + *method + "\"; known are linear, bilinear, nurbs, spline");
      spec.interpolation.method = known.value_or(Interpolation::linear);
      spec.interpolation_given = known.has_value();
    }
    read_interpolation(s, spec);
    s.takes("outside", {"hold", "error"});
    const std::string outside = s.find_text("outside").value_or("hold");
    if (outside != "hold" && outside != "error")
      s.error("outside", "'outside' is \"" + outside + "\"; known are hold, error");
    spec.refuse_outside = outside == "error";
    const auto loaded = load(s, spec.file);
    if (!loaded) return tl::unexpected(loaded.error());
    auto effect = effects::TableEffect::make(spec, *loaded, machine_);
    if (!effect) return fail(ErrorCode::wrong_input, effect.error().message);
    return std::shared_ptr<const Effect>(*effect);
  }

  static void read_interpolation(Section& s, effects::TableSpec& spec) {
    if (const auto degree = s.find_numbers("degree")) {
      const bool whole = !degree->empty() && degree->size() <= 2 &&
                         std::all_of(degree->begin(), degree->end(),
                                     [](double d) { return d >= 1 && d <= 9 && d == std::floor(d); });
      if (!whole)
        s.error("degree", "'degree' must be one or two whole numbers from 1 to 9");
      else
        spec.interpolation.degree = {static_cast<int>(degree->front()), static_cast<int>(degree->back())};
    }
    if (const auto smoothing = s.find_number("smoothing")) {
      if (*smoothing < 0.0) s.error("smoothing", "'smoothing' must not be negative");
      spec.interpolation.smoothing = *smoothing;
    }
    spec.interpolation.weights = s.find_numbers("weights").value_or(std::vector<double>{});
  }

  Result<ErrorTable> load(Section& s, const std::string& file) {
    namespace fs = std::filesystem;
    const fs::path path =
        fs::path(file).is_absolute() ? fs::path(file) : fs::path(s.file()).parent_path() / file;
    const auto cached = tables_.find(path.string());
    if (cached != tables_.end()) return cached->second;
    auto table = load_error_table(path.string(), machine_, s.diagnostics());
    if (!table && table.error().code == ErrorCode::io_failed) {
      s.error("table", table.error().message);
      unreadable_ = true;
    }
    if (table) tables_.emplace(path.string(), *table);
    return table;
  }

  void read_parameters(Section& s, std::optional<Section>& parameters, ModelEffect& entry) {
    if (!parameters) return;
    Keys late;
    std::vector<std::pair<std::string, double>> derived;
    for (const std::string& key : parameters->keys()) {
      const bool chooses = std::find(kVariantKeys.begin(), kVariantKeys.end(), key) != kVariantKeys.end();
      const auto index = entry.find(key);
      if (chooses && !index) continue;
      const auto number = parameters->find_number(key);
      if (!number) continue;
      if (!index) {
        derived.emplace_back(key, *number * unit_factor(unit_of_key(key)));
        continue;
      }
      if (!check_unit(*parameters, key, entry, *index)) continue;
      ParameterValue& p = entry.parameters[*index];
      if (p.given) parameters->error(key, "'" + key + "' is given twice, under two spellings");
      p.value = *number * unit_factor(unit_of_key(key));
      p.given = true;
    }
    apply_derived(*parameters, derived, entry);
    static_cast<void>(s);
  }

  static bool check_unit(Section& at, const std::string& key, const ModelEffect& entry, std::size_t index) {
    const Parameter& p = entry.effect->info().parameters[index];
    if (p.unit == Unit::none || unit_of_key(key) != Unit::none) return true;
    at.error(key, "key '" + key + "' has no unit: write '" + p.key() + "'");
    return false;
  }

  static void apply_derived(Section& parameters, const std::vector<std::pair<std::string, double>>& derived,
                            ModelEffect& entry) {
    for (const auto& [key, value] : derived) {
      std::vector<double> values = entry.values();
      if (!entry.effect->set_derived(key, value, values)) {
        parameters.error(
            key, "unknown parameter '" + key + "' of '" + entry.id() + "'; it has " + known_keys(entry));
        continue;
      }
      for (std::size_t k = 0; k < values.size(); ++k) {
        if (values[k] == entry.parameters[k].value) continue;
        entry.parameters[k].value = values[k];
        entry.parameters[k].given = true;
      }
    }
  }

  static std::string known_keys(const ModelEffect& entry) {
    std::string out;
    for (const Parameter& p : entry.effect->info().parameters) out += (out.empty() ? "" : ", ") + p.key();
    for (const auto& d : entry.effect->derived(entry.values())) out += ", " + d.key;
    return out.empty() ? "none" : out;
  }

  static void read_sigma(Section& s, ModelEffect& entry) {
    bool any = false;
    if (auto sigma = s.find_section("sigma")) {
      for (const std::string& key : sigma->keys()) {
        const auto number = sigma->find_number(key);
        const auto index = entry.find(key);
        if (!index)
          sigma->error(
              key, "unknown parameter '" + key + "' of '" + entry.id() + "'; it has " + known_keys(entry));
        if (!index || !number || !check_unit(*sigma, key, entry, *index)) continue;
        if (*number <= 0.0) sigma->error(key, "'" + key + "' in [effect.sigma] must be above 0");
        entry.parameters[*index].sigma = *number * unit_factor(unit_of_key(key));
        any = true;
      }
    }
    const bool prior = s.flag_or("prior", false);
    if (prior && !any) s.error("prior", "'prior = true' needs values in [effect.sigma]");
    for (ParameterValue& p : entry.parameters) p.prior = prior && p.sigma && p.given;
  }

  static void read_fixed(Section& s, ModelEffect& entry) {
    for (const std::string& key : s.find_texts("fixed").value_or(std::vector<std::string>{})) {
      const auto index = entry.find(key);
      if (!index)
        s.error("fixed",
                "unknown parameter '" + key + "' of '" + entry.id() + "'; it has " + known_keys(entry));
      else
        entry.parameters[*index].fixed = true;
    }
  }

  void check_twice(Section& s, const ModelEffect& entry) const {
    const bool is_table = dynamic_cast<const effects::TableEffect*>(entry.effect.get()) != nullptr;
    for (const ModelEffect& other : model_.effects) {
      const bool other_table = dynamic_cast<const effects::TableEffect*>(other.effect.get()) != nullptr;
      if (other.id() != entry.id() || other_table != is_table) continue;
      if (other.effect->info().variant != entry.effect->info().variant) continue;
      s.error("id", "effect '" + entry.id() + "' stands twice; the first is in line " +
                        std::to_string(other.where.line));
    }
  }

  const Machine& machine_;
  Model& model_;
  bool variant_given_ = true;
  bool unreadable_ = false;
  std::map<std::string, ErrorTable> tables_;
};

// A table that holds a line beside a squareness, or a mean beside a location error, counts it twice unless it
// was meant so.
void note_doubles(const Model& model, Diagnostics& diagnostics) {
  const std::map<std::string, std::string> squareness = {{"component:EXY", "squareness:C0Y"},
                                                         {"component:EXZ", "squareness:B0Z"},
                                                         {"component:EYZ", "squareness:A0Z"}};
  constexpr double kWorthANote = 0.1 * kRadPerUrad;
  for (const ModelEffect& e : model.effects) {
    const auto* table = dynamic_cast<const effects::TableEffect*>(e.effect.get());
    const auto partner = squareness.find(e.id());
    if (table == nullptr || partner == squareness.end() ||
        std::abs(table->line_slope().value_or(0.0)) < kWorthANote)
      continue;
    const bool beside = std::any_of(model.effects.begin(), model.effects.end(),
                                    [&](const ModelEffect& o) { return o.id() == partner->second; });
    if (!beside) continue;
    diagnostics.note(model.file, e.where,
                     "table '" + table->spec().file + "' contains a line of " +
                         fixed_text(*table->line_slope() / kRadPerUrad, 1) + " urad beside " +
                         partner->second + ": the two add (`table import --remove-line` takes it out)");
  }
}

MeasuredRanges read_valid(Section& valid, const Machine& machine) {
  MeasuredRanges out;
  for (const std::string& key : valid.keys("^([XYZUVW]_mm|[ABC]_deg|tool_length_mm|T_.+_degC)$")) {
    const auto axis = std::find_if(machine.axes.begin(), machine.axes.end(),
                                   [&](const Axis& a) { return range_of_axis(a, 0.0, 0.0).key == key; });
    const bool of_axis = axis != machine.axes.end();
    if (!of_axis && key != kToolLengthKey && !(key.starts_with("T_") && key.ends_with("_degC"))) {
      valid.error(key, "'" + key +
                           "' is the range of no axis of this machine (X_mm, C_deg), of no temperature "
                           "(T_name_degC) and not that of the tools (tool_length_mm)");
      continue;
    }
    const auto ends = valid.find_numbers(key);  // an axis' in mm or rad
    if (!ends) continue;
    if (ends->size() != 2 || (*ends)[0] > (*ends)[1])
      valid.error(key, "'" + key + "' must be two numbers, the smaller first");
    else if (of_axis)
      out.push_back(range_of_axis(*axis, (*ends)[0], (*ends)[1]));
    else
      out.push_back({key, (*ends)[0], (*ends)[1]});
  }
  return out;
}

constexpr const char* kLagOfAllAxes = "lag_of_all_axes_ms";

void read_head(Section& root, const Machine& machine, Model& model) {
  if (auto s = root.find_section("model")) {
    model.name = s->find_text("name").value_or("");
    model.parent = s->find_text("parent");
    model.lag_of_all_axes_s = s->quantity_or(kLagOfAllAxes, 0.0);
    if (model.lag_of_all_axes_s < 0.0)
      s->error(kLagOfAllAxes,
               "'" + std::string(kLagOfAllAxes) + "' is below 0: no machine is ahead of its commands");
    if (auto valid = s->find_section("valid")) model.valid = read_valid(*valid, machine);
    s->finish();
  }
  if (auto s = root.find_section("setup")) {
    s->takes("translation", {"free", "fixed"});
    const std::string translation = s->find_text("translation").value_or("free");
    if (translation != "free" && translation != "fixed") {
      s->error("translation", "'translation' is \"" + translation + "\"; known are free, fixed");
    }
    model.setup_translation = translation == "fixed" ? SetupTranslation::fixed : SetupTranslation::free;
    s->finish();
  }
}

// The number as people wrote it: 15 digits where they give the same double back.
config::Value number_value(double internal, double factor) {
  const double printed = internal / factor;
  char text[32];
  std::snprintf(text, sizeof text, "%.15g", printed);
  const double rounded = std::strtod(text, nullptr);
  return {rounded * factor == internal ? rounded : printed, {}};
}

config::Value text_value(std::string text) {
  return {std::move(text), {}};
}

void add_interpolation(const effects::TableSpec& spec, config::Table& out) {
  const auto list = [](std::initializer_list<int> numbers) {
    config::Array array;
    for (const int n : numbers) array.push_back({static_cast<std::int64_t>(n), {}});
    return config::Value{std::move(array), {}};
  };
  const InterpolationOptions defaults;
  if (spec.interpolation.degree != defaults.degree) {
    out.emplace_back("degree", list({spec.interpolation.degree[0], spec.interpolation.degree[1]}));
  }
  if (spec.interpolation.smoothing != 0.0)
    out.emplace_back("smoothing", config::Value{spec.interpolation.smoothing, {}});
  if (spec.interpolation.weights.empty()) return;
  config::Array weights;
  for (const double w : spec.interpolation.weights) weights.push_back({w, {}});
  out.emplace_back("weights", config::Value{std::move(weights), {}});
}

// Where the searches of a formula's shape parameters end; the library knows its own.
void add_ranges(const ModelEffect& e, config::Table& out) {
  config::Table ranges;
  for (const Parameter& p : e.effect->info().parameters) {
    if (p.role != ParameterRole::shape) continue;
    const double factor = unit_factor(p.unit);
    ranges.emplace_back(
        p.key(), config::Value{config::Array{number_value(p.min, factor), number_value(p.max, factor)}, {}});
  }
  if (!ranges.empty()) out.emplace_back("range", config::Value{std::move(ranges), {}});
}

config::Value effect_value(const ModelEffect& e) {
  config::Table out;
  out.emplace_back("id", text_value(e.id()));
  if (e.variant_given) {
    for (const auto& [key, text] : e.effect->file_keys()) out.emplace_back(key, text_value(text));
  }
  if (const auto* table = dynamic_cast<const effects::TableEffect*>(e.effect.get()))
    add_interpolation(table->spec(), out);
  const bool formula = e.id().starts_with("user:");
  config::Table values, sigmas;
  config::Array fixed;
  bool prior = false;
  for (std::size_t k = 0; k < e.parameters.size(); ++k) {
    const Parameter& p = e.effect->info().parameters[k];
    const ParameterValue& v = e.parameters[k];
    const double factor = unit_factor(p.unit);
    // A formula's parameters exist by being listed; others are left out while nobody gave them a value.
    const double unset = p.role == ParameterRole::shape ? p.usual : 0.0;
    if (formula || v.given || v.value != unset) values.emplace_back(p.key(), number_value(v.value, factor));
    if (v.sigma) sigmas.emplace_back(p.key(), number_value(*v.sigma, factor));
    if (v.fixed) fixed.push_back(text_value(p.key()));
    prior = prior || v.prior;
  }
  if (formula) add_ranges(e, out);
  if (!fixed.empty()) out.emplace_back("fixed", config::Value{std::move(fixed), {}});
  if (prior) out.emplace_back("prior", config::Value{true, {}});
  if (!values.empty()) out.emplace_back("parameters", config::Value{std::move(values), {}});
  if (!sigmas.empty()) out.emplace_back("sigma", config::Value{std::move(sigmas), {}});
  if (!e.evidence.empty()) out.emplace_back("evidence", config::Value{e.evidence, {}});
  return {std::move(out), {}};
}

}  // namespace

Result<Model> parse_model(std::string_view toml, const std::string& file, const Machine& machine,
                          const EffectContext& context, Diagnostics& diagnostics) {
  const auto value = config::parse_toml(toml, file);
  if (!value) {
    diagnostics.error(file, value.error().where, value.error().message);
    return tl::unexpected(value.error());
  }
  const std::size_t errors = diagnostics.error_count();
  Model model;
  model.file = file;
  model.context = context;
  for (const Axis& axis : machine.axes) model.axes.push_back(axis.name);
  Section root(*value, "file", file, diagnostics);
  read_head(root, machine, model);
  EffectReader reader(machine, model);
  for (Section& s : root.sections("effect")) reader.read(s);
  root.finish();
  if (diagnostics.error_count() > errors) {
    Error error = diagnostics.first_error();
    if (reader.unreadable()) error.code = ErrorCode::io_failed;
    return tl::unexpected(std::move(error));
  }
  note_doubles(model, diagnostics);
  return model;
}

Result<Model> load_model(const std::string& path, const Machine& machine, const EffectContext& context,
                         Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_model(*text, path, machine, context, diagnostics);
}

std::string model_text(const Model& model) {
  config::Table head;
  head.emplace_back("name", text_value(model.name));
  if (model.parent) head.emplace_back("parent", text_value(*model.parent));
  if (model.lag_of_all_axes_s != 0.0)
    head.emplace_back(kLagOfAllAxes, number_value(model.lag_of_all_axes_s, unit_factor(Unit::ms)));
  if (!model.valid.empty()) {
    config::Table valid;
    for (const MeasuredRange& r : model.valid)
      valid.emplace_back(r.key, config::Value{config::Array{{r.low, {}}, {r.high, {}}}, {}});
    head.emplace_back("valid", config::Value{std::move(valid), {}});
  }
  config::Table root;
  root.emplace_back("model", config::Value{std::move(head), {}});
  if (model.setup_translation == SetupTranslation::fixed) {
    root.emplace_back("setup", config::Value{config::Table{{"translation", text_value("fixed")}}, {}});
  }
  config::Array effects;
  for (const ModelEffect& e : model.effects) effects.push_back(effect_value(e));
  if (!effects.empty()) root.emplace_back("effect", config::Value{std::move(effects), {}});
  return config::toml_text({std::move(root), {}});
}

}  // namespace trunnion
