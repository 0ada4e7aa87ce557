#include "trunnion/report/thermal_service.hpp"

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/largest_number.hpp"

namespace trunnion::report {

using nlohmann::ordered_json;
using namespace thermal;

// What a restart begins anew.
struct ThermalService::Live {
  double silent_s = 0.0;  // since a reading was accepted, by the service's own clock
  std::size_t lines_rejected = 0;
};

struct ThermalService::Answer {
  bool started = false;
  double time_s = 0.0;
  std::map<std::string, Estimate> channel;
  Vec3 deviation_mm = Vec3::Zero();
  Vec3 correction_mm = Vec3::Zero();
  double sigma_mm = 0.0;
  bool outside_training = false;
  bool stale = false;
  std::optional<Live> live;  // where it was asked for
  bool enabled = true;
  double clamp_mm = 0.0;
  bool clamped = false;
  bool slew_limited = false;
  std::size_t readings = 0;
  std::vector<std::string> rejected;  // sensors and channels whose value could not be true
};

namespace {

tl::unexpected<Error> wrong(const std::string& message) {
  return fail(ErrorCode::wrong_input, message);
}

// Within what its key can mean.
Result<double> bounded(double value, const std::string& key) {
  const double largest = key == "spindle_rpm"                            ? kFastestSpindle_rpm
                         : key == "feed_mm_min"                          ? kFastestFeed_mm_min
                         : key == "um" || key.starts_with("measured_um") ? kLargestDeviation_um
                                                                         : config::kLargestNumber;
  if (std::abs(value) <= largest) return value;
  return wrong("'" + key + "' is " + shortest_text(value) + ", beyond " + shortest_text(largest));
}

Result<double> number_of(const nlohmann::json& value, const std::string& key) {
  if (!value.is_number()) return wrong("'" + key + "' must be a number");
  return bounded(value.get<double>(), key);
}

Result<std::map<std::string, double>> numbers_of(const nlohmann::json& value, const std::string& key) {
  if (!value.is_object()) return wrong("'" + key + "' must be an object of numbers");
  std::map<std::string, double> out;
  for (const auto& [name, item] : value.items()) {
    // null: the logger has the sensor but no value.
    if (item.is_null()) continue;
    const auto number = number_of(item, key + "." + name);
    if (!number) return tl::unexpected(number.error());
    out[name] = *number;
  }
  return out;
}

Result<double> number_of(const std::string& text, const std::string& key) {
  const ParsedNumber number = parse_number(text);
  if (!number) return wrong("'" + key + "' is no number: '" + text + "'");
  return bounded(number.value, key);
}

template <class Answer>
std::string answer_json(const Answer& a) {
  ordered_json out;
  out["ok"] = true;
  out["readings"] = a.readings;
  out["enabled"] = a.enabled;
  if (a.started) out["time_s"] = a.time_s;
  constexpr const char* kAxes[] = {"dx", "dy", "dz"};
  for (Eigen::Index i = 0; i < 3; ++i) {
    out["deviation_um"][kAxes[i]] = a.deviation_mm[i] / kMmPerUm;
    out["correction_um"][kAxes[i]] = a.correction_mm[i] / kMmPerUm;
  }
  out["sigma_um"] = a.sigma_mm / kMmPerUm;
  out["clamp_um"] = a.clamp_mm / kMmPerUm;
  out["clamped"] = a.clamped;
  out["slew_limited"] = a.slew_limited;
  out["outside_training"] = a.outside_training;
  out["stale"] = a.stale;
  if (a.live) {
    out["silent_s"] = a.live->silent_s;
    out["lines_rejected"] = a.live->lines_rejected;
  }
  for (const auto& [name, e] : a.channel) {
    out["channels"][name] = {{"value_um", e.value_mm / kMmPerUm},
                             {"sigma_um", e.sigma_mm / kMmPerUm},
                             {"since_measured_s", e.since_measured_s}};
  }
  if (!a.rejected.empty()) out["rejected"] = a.rejected;
  return out.dump();
}

template <class Answer>
std::string xml_text(const Answer& a) {
  const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 3); };
  const auto word = [](bool flag) { return flag ? "1" : "0"; };
  std::string out = "<offset dx_um=\"" + um(a.correction_mm.x()) + "\" dy_um=\"" + um(a.correction_mm.y()) +
                    "\" dz_um=\"" + um(a.correction_mm.z()) + "\" sigma_um=\"" + um(a.sigma_mm) +
                    "\" clamp_um=\"" + um(a.clamp_mm) + "\" enabled=\"" + word(a.enabled) +
                    "\" outside_training=\"" + word(a.outside_training) + "\" stale=\"" + word(a.stale) +
                    "\" readings=\"" + std::to_string(a.readings) + "\"/>";
  return out;
}

std::string xml_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

}  // namespace

ThermalService::ThermalService(ThermalModel model, const OffsetLimits& limits)
    : model_(std::move(model)),
      limits_(limits),
      predictor_(model_, thermal::Readings::raw),
      follower_(limits) {
  start_run();
}

void ThermalService::start_run() {
  predictor_ = Predictor(model_, thermal::Readings::raw);
  follower_ = OffsetFollower(limits_);
  followed_s_.reset();
  temperature_degC_.assign(predictor_.sensors().size(), kNotRead);
}

Result<ThermalService::Message> ThermalService::parse_json(const std::string& line) {
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (json.is_discarded()) return wrong("this is no JSON");
  if (!json.is_object()) return wrong("a message must be an object");
  Message out;
  for (const auto& [key, value] : json.items()) {
    if (key == "time_s" || key == "spindle_rpm" || key == "feed_mm_min") {
      const auto number = number_of(value, key);
      if (!number) return tl::unexpected(number.error());
      (key == "time_s" ? out.time_s : key == "spindle_rpm" ? out.spindle_rpm : out.feed_mm_min) = *number;
    } else if (key == "T_degC" || key == "measured_um") {
      auto numbers = numbers_of(value, key);
      if (!numbers) return tl::unexpected(numbers.error());
      (key == "T_degC" ? out.temperature_degC : out.measured_um) = std::move(*numbers);
    } else if (key == "query") {
      out.query = true;
      out.live = value == "live";
    } else if (key == "run") {
      out.new_run = true;
    } else if (key == "enabled" && value.is_boolean()) {
      out.enabled = value.get<bool>();
    } else {
      return wrong("unknown key '" + key + "'");
    }
  }
  return out;
}

Result<ThermalService::Message> ThermalService::parse_xml(const std::string& line) {
  namespace pt = boost::property_tree;
  pt::ptree tree;
  try {
    std::istringstream stream(line);
    pt::read_xml(stream, tree, pt::xml_parser::no_comments | pt::xml_parser::trim_whitespace);
  } catch (const pt::xml_parser_error& e) {
    return wrong("this is no XML: " + e.message());
  }
  if (tree.size() != 1) return wrong("a message is one element");
  const auto& [name, element] = tree.front();
  Message out;
  out.query = name == "query";
  out.new_run = name == "run";
  if (name == "enabled") out.enabled = element.data() != "0" && element.data() != "false";
  if (name != "reading" && name != "measurement") {
    if (out.query || out.new_run || out.enabled) return out;
    return wrong("unknown element '" + name + "'");
  }
  for (const auto& [key, child] : element) {
    if (key == "<xmlattr>") {
      for (const auto& [attribute, value] : child) {
        const auto number = number_of(value.data(), attribute);
        if (!number) return tl::unexpected(number.error());
        if (attribute == "time_s")
          out.time_s = *number;
        else if (attribute == "spindle_rpm")
          out.spindle_rpm = *number;
        else if (attribute == "feed_mm_min")
          out.feed_mm_min = *number;
        else
          return wrong("unknown attribute '" + attribute + "'");
      }
      continue;
    }
    const bool temperature = key == "T";
    if (!temperature && key != "um") return wrong("unknown element '" + key + "'");
    const auto id = child.get_optional<std::string>(temperature ? "<xmlattr>.name" : "<xmlattr>.channel");
    const auto number = number_of(child.data(), key);
    if (!id) return wrong("element '" + key + "' needs its name");
    if (!number) return tl::unexpected(number.error());
    (temperature ? out.temperature_degC : out.measured_um)[*id] = *number;
  }
  return out;
}

// Loggers that post beside each other are a little late at times: their values count as of now.
constexpr double kLate_s = 60.0;
// After a longer pause the machine is in another state: that is another run.
constexpr double kLongestPause_s = 86400.0;

Result<void> ThermalService::check_reading(const Message& message) const {
  if (!message.time_s) return wrong("a reading needs 'time_s'");
  if (*message.time_s < 0.0) return wrong("'time_s' counts from the run's start and must not be below zero");
  if (predictor_.started() && !message.new_run) {
    const double ahead_s = *message.time_s - predictor_.time_s();
    const std::string last = " s; the last reading was at " + shortest_text(predictor_.time_s()) + " s (" +
                             R"({"run": "start"} begins a new run))";
    if (ahead_s <= -kLate_s) return wrong("'time_s' goes back to " + shortest_text(*message.time_s) + last);
    if (ahead_s > kLongestPause_s)
      return wrong("'time_s' jumps ahead to " + shortest_text(*message.time_s) + last);
  }
  for (const auto& measured : message.measured_um) {
    const std::string& name = measured.first;
    const bool known = std::any_of(model_.channels.begin(), model_.channels.end(),
                                   [&](const ChannelModel& c) { return c.channel == name; });
    if (!known) return wrong("the model has no channel '" + name + "'");
  }
  return {};
}

void ThermalService::take_reading(const Message& message, Answer& answer) {
  std::vector<double> temperature(predictor_.sensors().size(), kNotRead);
  for (std::size_t i = 0; i < temperature.size(); ++i) {
    const auto it = message.temperature_degC.find(predictor_.sensors()[i]);
    if (it == message.temperature_degC.end()) continue;
    if (!is_plausible(it->second))
      answer.rejected.push_back(it->first);
    else
      temperature[i] = it->second;
  }
  const double feed = message.feed_mm_min ? *message.feed_mm_min / kSecondsPerMinute : kNotRead;
  const double time_s =
      predictor_.started() ? std::max(*message.time_s, predictor_.time_s()) : *message.time_s;
  const auto read = predictor_.read(time_s, temperature, message.spindle_rpm.value_or(kNotRead), feed);
  TRUNNION_EXPECTS(read.has_value());
  heard_s_ = now_s_;
  for (std::size_t c = 0; c < model_.channels.size(); ++c) {
    const auto it = message.measured_um.find(model_.channels[c].channel);
    if (it == message.measured_um.end()) continue;
    if (!predictor_.measure(c, it->second * kMmPerUm)) answer.rejected.push_back(it->first);
  }
  ++readings_;
  changed_ = true;
}

Result<void> ThermalService::fill(Answer& answer) {
  answer.started = predictor_.started();
  answer.readings = readings_;
  answer.enabled = limits_.enabled;
  answer.clamp_mm = limits_.clamp_mm;
  if (!answer.started) return {};
  answer.time_s = predictor_.time_s();
  const bool silent = now_s_ - heard_s_ > kStale_s;
  for (std::size_t c = 0; c < model_.channels.size(); ++c) {
    const ChannelModel& channel = model_.channels[c];
    Estimate e = predictor_.estimate(c);
    if (!e.finite()) return wrong("the model of channel '" + channel.channel + "' gives no number here");
    e.stale = e.stale || silent;
    if (silent) e.sigma_mm = std::max(e.sigma_mm, channel.hold_last_rmse_mm);
    answer.channel[channel.channel] = e;
    answer.outside_training = answer.outside_training || e.outside_training();
    answer.stale = answer.stale || e.stale;
    const auto component = offset_component(channel);
    if (!component) continue;
    answer.deviation_mm[*component] = e.value_mm;
    answer.sigma_mm = std::max(answer.sigma_mm, e.sigma_mm);
  }
  const double dt = followed_s_ ? answer.time_s - *followed_s_ : 0.0;
  followed_s_ = answer.time_s;
  answer.correction_mm = -follower_.follow(answer.deviation_mm, dt);
  answer.clamped = follower_.clamped();
  answer.slew_limited = follower_.slew_limited();
  return {};
}

Result<ThermalService::Answer> ThermalService::act(const Message& message) {
  Answer answer;
  const bool reading = message.time_s || !message.temperature_degC.empty() || !message.measured_um.empty();
  if (reading) {
    if (auto checked = check_reading(message); !checked) return tl::unexpected(checked.error());
  } else if (!message.query && !message.new_run && !message.enabled) {
    return wrong("an empty message");
  }
  if (message.new_run) {
    start_run();
    changed_ = true;
  }
  if (message.enabled) {
    limits_.enabled = *message.enabled;
    // Switched on again, the correction starts from zero under the slew limit: the tool may be in a cut.
    follower_ = OffsetFollower(limits_);
    if (limits_.enabled && predictor_.started()) follower_.follow(Vec3::Zero(), 0.0);
    changed_ = true;
  }
  if (reading) take_reading(message, answer);
  if (message.live) answer.live = Live{std::max(0.0, now_s_ - heard_s_), rejected_};
  if (auto filled = fill(answer); !filled) return tl::unexpected(filled.error());
  return answer;
}

std::string ThermalService::handle(const std::string& line, double now_s) {
  now_s_ = now_s;
  changed_ = false;
  const auto first = line.find_first_not_of(" \t");
  const bool xml = first != std::string::npos && line[first] == '<';
  const auto message = xml ? parse_xml(line) : parse_json(line);
  const auto answer = message ? act(*message) : Result<Answer>(tl::unexpected(message.error()));
  if (answer) return xml ? xml_text(*answer) : answer_json(*answer);
  if (!xml) return refuse(answer.error().message);
  ++rejected_;
  return "<error>" + xml_escaped(answer.error().message) + "</error>";
}

std::string ThermalService::refuse(const std::string& why) {
  ++rejected_;
  // Bytes that are no UTF-8 must not throw here.
  return ordered_json{{"ok", false}, {"error", why}}.dump(-1, ' ', false,
                                                          nlohmann::json::error_handler_t::replace);
}

}  // namespace trunnion::report
