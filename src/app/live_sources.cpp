#include "app/live_sources.hpp"

#include <cstdlib>
#include <spdlog/spdlog.h>

namespace trunnion::app {

Result<LiveSources> LiveSources::open(const LiveSourceOptions& options, const thermal::ThermalModel& model) {
  auto readings = report::LiveReadings::create(model, options.items);
  if (!readings) return tl::unexpected(readings.error());
  LiveSources out(std::move(*readings));
  for (const std::string& address : options.adapters) {
    auto client = thermal::ShdrClient::create(address);
    if (!client) return tl::unexpected(client.error());
    out.adapters_.push_back(std::move(*client));
  }
  if (!options.mqtt) return out;
  auto broker = thermal::MqttBroker::parse(*options.mqtt);
  if (!broker) return tl::unexpected(broker.error());
  broker->topics = options.topics;
  broker->user = options.mqtt_user;
  // Not an option: every user of the computer sees the command line of a program.
  if (const char* const password = std::getenv("TRUNNION_MQTT_PASSWORD"))  // NOLINT(concurrency-mt-unsafe)
    broker->password = password;
  auto client = thermal::MqttClient::start(*broker);
  if (!client) return tl::unexpected(client.error());
  out.mqtt_.emplace(std::move(*client));
  out.broker_ = "broker " + *options.mqtt;
  return out;
}

std::vector<int> LiveSources::descriptors() const {
  std::vector<int> out;
  if (mqtt_) out.push_back(mqtt_->descriptor());
  for (const auto& adapter : adapters_) {
    if (adapter.connected()) out.push_back(adapter.descriptor());
  }
  return out;
}

void LiveSources::tell_state(const std::string& source, bool connected) {
  const auto [known, fresh] = connected_.try_emplace(source, false);
  if (known->second == connected) return;
  known->second = connected;
  if (connected)
    spdlog::info("{}: connected", source);
  else
    spdlog::warn("{}: the connection is lost; it is tried again", source);
}

void LiveSources::hand_on(const std::string& source, const Result<std::string>& line, const Take& take) {
  if (!line && was_faulty_.try_emplace(source, true).second)
    spdlog::warn("{}: {} (told once; faulty lines are left out and counted)", source, line.error().message);
  if (!line || !line->empty()) take(line);
}

bool LiveSources::step(double now_s, const Take& take) {
  bool any = false;
  if (mqtt_) {
    tell_state(broker_, mqtt_->connected());
    for (const auto& message : mqtt_->take()) {
      any = true;
      hand_on(broker_ + ", " + message.topic, readings_.of_message(message.topic, message.payload, now_s),
              take);
    }
  }
  for (auto& adapter : adapters_) {
    const std::string source = "adapter " + adapter.address();
    for (const std::string& text : adapter.step(now_s)) {
      any = true;
      const auto line = parse_shdr_line(text);
      if (line && line->heartbeat_s) adapter.expect_heartbeat(*line->heartbeat_s);
      hand_on(source, line ? readings_.of_shdr(source, *line, now_s) : tl::unexpected(line.error()), take);
    }
    tell_state(source, adapter.connected());
    if (!adapter.connected()) readings_.forget(source);
  }
  return any;
}

}  // namespace trunnion::app
