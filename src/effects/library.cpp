#include "trunnion/effects/library.hpp"

#include <algorithm>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/texts.hpp"

#include "effects/library_support.hpp"

namespace trunnion {
namespace effects {
void make_all(const LibraryBuilder& builder);  // generated: every file of library/
}

namespace {

using Keys = std::vector<std::pair<std::string, std::string>>;

std::vector<EffectFamily> build(const Machine& machine, const EffectContext& context, bool equivalents) {
  std::vector<EffectFamily> out;
  effects::make_all(effects::LibraryBuilder(machine, context, equivalents, out));
  return out;
}

// Sensors and runs that the request names become known to the context.
void extend(const Machine& machine, EffectContext& context, const std::string& id, const Keys& variant) {
  for (const auto& entry : variant) {
    const std::string &key = entry.first, &value = entry.second;
    if (key == "sensor") index_of(context.names.temperatures, value);
    const bool known = std::any_of(context.runs.begin(), context.runs.end(),
                                   [&](const RunInfo& r) { return r.id == value; });
    if (key == "run" && !known) context.runs.push_back({value, 0.0});
  }
  if (id == "ambient_drift") index_of(context.names.temperatures, machine.sensors.ambient);
  if (id.starts_with("screw_heating:")) {
    const auto sensor = machine.sensors.axes.find(id.substr(id.find(':') + 1));
    if (sensor != machine.sensors.axes.end()) index_of(context.names.temperatures, sensor->second);
  }
}

// Why the library has no such effect, with what it has of the same kind.
std::string unknown_id(const Machine& machine, const std::vector<EffectFamily>& library,
                       const std::string& id) {
  const std::string kind = id.substr(0, id.find(':'));
  std::vector<std::string> near;
  for (const EffectFamily& family : library) {
    if (family.id().substr(0, family.id().find(':')) == kind) near.push_back(family.id());
  }
  std::string text = "machine '" + machine.name + "' has no effect '" + id + "'";
  if (!near.empty()) return text + "; of this kind it has " + joined(near, ", ");
  if (kind == "screw_heating")
    return text + ": [thermal] axis_sensors of the machine file names no sensor for that axis";
  if (kind == "thermal_location")
    return text + ": there is no temperature sensor; name one with sensor = \"...\"";
  if (kind == "step" || kind == "setup_tilt") return text + ": it needs a run; name one with run = \"...\"";
  std::vector<std::string> all;
  all.reserve(library.size());
  for (const EffectFamily& family : library) all.push_back(family.id());
  return text + did_you_mean(id, all) + " (`trunnion model effects` lists them)";
}

bool matches(const Effect& effect, const Keys& variant) {
  return std::all_of(variant.begin(), variant.end(), [&](const auto& entry) {
    const auto& have = effect.info().variant;
    return std::find(have.begin(), have.end(), entry) != have.end();
  });
}

}  // namespace

std::vector<EffectFamily> effect_library(const Machine& machine, const EffectContext& context) {
  return build(machine, context, false);
}

Result<std::shared_ptr<const Effect>> make_effect(const Machine& machine, EffectContext& context,
                                                  const std::string& id, const Keys& variant) {
  extend(machine, context, id, variant);
  const auto library = build(machine, context, true);
  const auto family =
      std::find_if(library.begin(), library.end(), [&](const EffectFamily& f) { return f.id() == id; });
  if (family == library.end()) return fail(ErrorCode::wrong_input, unknown_id(machine, library, id));
  for (const auto& effect : family->variants) {
    if (matches(*effect, variant)) return effect;
  }
  std::vector<std::string> choices;
  for (const auto& effect : family->variants) {
    for (const auto& [key, value] : effect->info().variant) choices.push_back(key + " = \"" + value + "\"");
  }
  std::vector<std::string> given;
  for (const auto& [key, value] : variant) given.push_back(key + " = \"" + value + "\"");
  return fail(ErrorCode::wrong_input, "effect '" + id + "' has no " + joined(given, ", ") +
                                          (choices.empty() ? "" : "; choices: " + joined(choices, ", ")));
}

std::string canonical_symbol(std::string_view symbol) {
  std::string s(symbol);
  constexpr std::string_view kLetters = "XYZABC";
  const auto letter = [&](std::size_t i) { return kLetters.find(s[i]) != std::string_view::npos; };
  if (s.size() == 4 && s[0] == 'E') s.erase(0, 1);
  const bool location =
      s.size() == 3 && letter(0) && (s[1] == '0' || s[1] == 'O') && (letter(2) || s[2] == 'S');
  if (!location) return std::string(symbol);
  s[1] = '0';
  return s;
}

}  // namespace trunnion
