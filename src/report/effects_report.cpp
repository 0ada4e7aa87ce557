#include "trunnion/report/effects_report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

// In the printed unit, as few digits as tell it.
std::string amount(double internal, Unit unit) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", internal / unit_factor(unit));
  return text;
}

std::string unit_text(Unit unit) {
  std::string text(unit_suffix(unit));
  const auto per = text.find("_per_");
  if (per != std::string::npos) text.replace(per, 5, "/");
  std::replace(text.begin(), text.end(), '_', '/');
  return text;
}

std::string parameter_text(const Parameter& p) {
  const std::string unit = unit_text(p.unit);
  const std::string tail = unit.empty() ? "" : " " + unit;
  std::string out = p.key() + ": ";
  if (p.role == ParameterRole::linear) return out + "usually within +-" + amount(p.usual, p.unit) + tail;
  out += "searched from " + amount(p.min, p.unit) + " to " + amount(p.max, p.unit) + tail;
  if (p.integer) out += ", whole numbers";
  for (std::size_t i = 0; i < p.candidates.size(); ++i) {
    out += (i == 0 ? "; known " : ", ") + amount(p.candidates[i], p.unit);
  }
  return out;
}

std::string kind_of(const std::string& id) {
  return id.substr(0, id.find(':'));
}

void add_once(std::vector<std::string>& list, const std::string& text) {
  if (std::find(list.begin(), list.end(), text) == list.end()) list.push_back(text);
}

std::string choices_text(const EffectFamily& family) {
  std::string out;
  for (const auto& effect : family.variants) {
    for (const auto& [key, value] : effect->info().variant) out += (out.empty() ? key + ": " : ", ") + value;
  }
  return out;
}

// All effects of one kind: each with its sentence, then what they share.
std::string kind_text(const std::vector<const EffectFamily*>& families) {
  std::string out =
      kind_of(families.front()->id()) + "   (" + std::string(text_of(families.front()->info().kind)) + ")\n";
  std::vector<std::string> causes, remedies, parameters, choices;
  for (const EffectFamily* family : families) {
    const EffectInfo& info = family->info();
    out += "    " + info.id + "   " + info.what + ".\n";
    add_once(causes, info.cause);
    add_once(remedies, info.remedy);
    for (const Parameter& p : info.parameters) add_once(parameters, parameter_text(p));
    const std::string choice = choices_text(*family);
    if (!choice.empty()) add_once(choices, info.id + " has a choice of " + choice);
  }
  const auto block = [&out](const char* title, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) out += std::string("  ") + title + line + "\n";
  };
  block("cause:      ", causes);
  block("what to do: ", remedies);
  block("parameter   ", parameters);
  block("", choices);
  return out;
}

ordered_json parameter_json(const Parameter& p) {
  const double factor = unit_factor(p.unit);
  ordered_json out;
  out["key"] = p.key();
  out["unit"] = std::string(unit_suffix(p.unit));
  out["role"] = p.role == ParameterRole::linear ? "linear" : "shape";
  out["usual"] = p.usual / factor;
  if (p.role == ParameterRole::shape) {
    out["min"] = p.min / factor;
    out["max"] = p.max / factor;
    out["integer"] = p.integer;
    out["known"] = ordered_json::array();
    for (const double value : p.candidates) out["known"].push_back(value / factor);
  }
  return out;
}

}  // namespace

std::string effects_json(const std::vector<EffectFamily>& library) {
  ordered_json list = ordered_json::array();
  for (const EffectFamily& family : library) {
    const EffectInfo& info = family.info();
    ordered_json e;
    e["id"] = info.id;
    e["class"] = std::string(text_of(info.kind));
    e["switched_off_by"] = info.kind == EffectClass::geometric ? ordered_json("--no-geometric")
                           : info.kind == EffectClass::thermal ? ordered_json("--no-thermal")
                                                               : ordered_json(nullptr);
    e["what"] = info.what;
    e["cause"] = info.cause;
    e["remedy"] = info.remedy;
    e["contains"] = info.contains;
    e["parameters"] = ordered_json::array();
    for (const Parameter& p : info.parameters) e["parameters"].push_back(parameter_json(p));
    e["choices"] = ordered_json::array();
    for (const auto& effect : family.variants) {
      ordered_json choice = ordered_json::object();
      for (const auto& [key, value] : effect->info().variant) choice[key] = value;
      if (!choice.empty()) e["choices"].push_back(choice);
    }
    list.push_back(std::move(e));
  }
  return json_text(ordered_json{{"effects", list}});
}

std::string effects_text(const std::vector<EffectFamily>& library) {
  std::string out;
  for (std::size_t i = 0; i < library.size();) {
    std::vector<const EffectFamily*> same;
    for (; i < library.size() && (same.empty() || kind_of(library[i].id()) == kind_of(same.front()->id()));
         ++i) {
      same.push_back(&library[i]);
    }
    out += (out.empty() ? "" : "\n") + kind_text(same);
  }
  return out;
}

}  // namespace trunnion::report
