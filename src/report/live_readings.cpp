#include "trunnion/report/live_readings.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "trunnion/base/number_text.hpp"

namespace trunnion::report {

using nlohmann::ordered_json;

namespace {

bool names_item(std::string_view whole, std::string_view item) {
  if (!whole.ends_with(item)) return false;
  if (whole.size() == item.size()) return true;
  const char before = whole[whole.size() - item.size() - 1];
  return before == '/' || before == ':';
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// What stands for a value that is not there.
bool says_nothing(std::string_view text) {
  const std::string word = lower(text);
  return word.empty() || word == "unavailable" || word == "null" || word == "nan" || word == "-nan" ||
         word == "inf" || word == "-inf" || word == "infinity" || word == "-infinity";
}

// Python writes NaN and Infinity, which JSON does not have: null in their place, outside of strings.
std::string without_nan(const std::string& text) {
  std::string out;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = std::string_view(text).substr(i);
    if (text[i] == '"' && (i == 0 || text[i - 1] != '\\')) in_string = !in_string;
    std::size_t skip = 0;
    for (const std::string_view word : {"NaN", "-Infinity", "Infinity"}) {
      if (!in_string && skip == 0 && rest.starts_with(word)) skip = word.size();
    }
    if (skip == 0) {
      out += text[i];
      continue;
    }
    out += "null";
    i += skip - 1;
  }
  return out;
}

void add_items(const nlohmann::json& value, const std::string& name, std::vector<LiveValue>& out) {
  if (value.is_object()) {
    for (const auto& [key, item] : value.items()) add_items(item, name + "/" + key, out);
  } else if (value.is_number()) {
    out.push_back({name, shortest_text(value.get<double>())});
  } else if (value.is_string()) {
    out.push_back({name, value.get<std::string>()});
  } else {
    out.push_back({name, value.is_null() ? std::string() : value.dump()});
  }
}

}  // namespace

Result<LiveReadings> LiveReadings::create(const thermal::ThermalModel& model,
                                          const std::vector<std::string>& items) {
  LiveReadings out;
  const auto add = [&out](Kind kind, const std::string& name) {
    const bool known =
        std::any_of(out.inputs_.begin(), out.inputs_.end(), [&](const Input& i) { return i.name == name; });
    if (!known) out.inputs_.push_back({kind, name, name, 1.0});
  };
  for (const auto& channel : model.channels) {
    for (const std::string& sensor : channel.features.sensors) add(Kind::temperature, sensor);
  }
  add(Kind::spindle, "spindle_rpm");
  add(Kind::feed, "feed_mm_min");
  for (const auto& channel : model.channels) add(Kind::measured, channel.channel);
  add(Kind::time, "time_s");
  for (const std::string& text : items) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto input =
        std::find_if(out.inputs_.begin(), out.inputs_.end(), [&](const Input& i) { return i.name == name; });
    if (equals == std::string::npos || input == out.inputs_.end()) {
      std::string names;
      for (const Input& i : out.inputs_) names += (names.empty() ? "" : ", ") + i.name;
      return fail(ErrorCode::wrong_use,
                  "--item '" + text + "' is no NAME=ITEM[*FACTOR] with a NAME of this model: " + names);
    }
    out.has_time_ = out.has_time_ || input->kind == Kind::time;
    const auto star = text.rfind('*');
    const bool scaled = star != std::string::npos && star > equals;
    input->item = text.substr(equals + 1, scaled ? star - equals - 1 : std::string::npos);
    if (!scaled) continue;
    const auto factor = parse_number(std::string_view(text).substr(star + 1));
    if (!factor || factor.value == 0.0)
      return fail(ErrorCode::wrong_use, "--item '" + text + "': the factor is no number but 0");
    input->factor = factor.value;
  }
  for (const Input& input : out.inputs_) {
    if (input.item.empty()) return fail(ErrorCode::wrong_use, "--item '" + input.name + "=' names no item");
  }
  return out;
}

Result<LiveReadings::Values> LiveReadings::values_of(const std::vector<LiveValue>& live) {
  Values out;
  for (const LiveValue& value : live) {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const Input& input = inputs_[i];
      if (!names_item(value.item, input.item)) continue;
      out[i] = thermal::kNotRead;
      if (says_nothing(value.text)) continue;
      const auto number = parse_number(value.text);
      if (!number)
        return fail(ErrorCode::wrong_input,
                    "'" + value.item + "' is no number: '" + value.text.substr(0, 40) + "'");
      out[i] = number.value * input.factor;
    }
  }
  for (auto it = out.begin(); it != out.end();) {
    const bool measured = inputs_[it->first].kind == Kind::measured;
    const auto last = measured_.find(it->first);
    const bool again =
        measured && (std::isnan(it->second) || (last != measured_.end() && last->second == it->second));
    if (measured && !again) measured_[it->first] = it->second;
    it = again ? out.erase(it) : std::next(it);
  }
  return out;
}

std::string LiveReadings::line_of(const Values& values, double now_s) {
  ordered_json out;
  out["time_s"] = offset_s_ + now_s;
  bool any = false;
  for (const auto& [place, value] : values) {
    const Input& input = inputs_[place];
    if (input.kind == Kind::time && !std::isnan(value)) {
      source_time_s_ = value;
      continue;
    }
    any = true;
    // A null, too, is a reading: the source lives, its sensor does not.
    const ordered_json number = std::isnan(value) ? ordered_json() : ordered_json(value);
    if (input.kind == Kind::temperature)
      out["T_degC"][input.name] = number;
    else if (input.kind == Kind::measured)
      out["measured_um"][input.name] = number;
    else if (!std::isnan(value))
      out[input.name] = number;
  }
  if (!any) return {};
  if (has_time_) {
    if (!source_time_s_) return {};
    out["time_s"] = *source_time_s_;
  }
  return out.dump();
}

Result<std::string> LiveReadings::of_message(const std::string& topic, const std::string& payload,
                                             double now_s) {
  auto json = nlohmann::json::parse(payload, nullptr, false);
  if (json.is_discarded()) json = nlohmann::json::parse(without_nan(payload), nullptr, false);
  std::vector<LiveValue> live;
  if (json.is_discarded())
    live.push_back({topic, payload});  // no JSON is wrong only where it should have been a number
  else
    add_items(json, topic, live);
  const auto values = values_of(live);
  if (!values) return tl::unexpected(values.error());
  const bool cut_off = json.is_discarded() && payload.find('{') != std::string::npos;
  if (cut_off) return fail(ErrorCode::wrong_input, "this is no JSON");
  return line_of(*values, now_s);
}

Result<std::string> LiveReadings::of_shdr(const std::string& source, const ShdrLine& line, double now_s) {
  auto values = values_of(line.values);
  if (!values) return tl::unexpected(values.error());
  Held& held = held_[source];
  constexpr double kAgain_s = 10.0;
  if (values->empty() && now_s - held.said_s < kAgain_s) return std::string();
  for (const auto& [place, value] : *values) {
    if (inputs_[place].kind != Kind::measured) held.values[place] = value;
  }
  values->insert(held.values.begin(), held.values.end());
  held.said_s = now_s;
  return line_of(*values, now_s);
}

}  // namespace trunnion::report
