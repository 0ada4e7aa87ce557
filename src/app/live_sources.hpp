#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/report/live_readings.hpp"
#include "trunnion/thermal/mqtt_client.hpp"
#include "trunnion/thermal/shdr_client.hpp"

namespace trunnion::app {

/// What `thermal serve` reads beside its own protocol.
struct LiveSourceOptions {
  std::optional<std::string> mqtt;  // HOST[:PORT]
  std::string mqtt_user;            // its password: environment, TRUNNION_MQTT_PASSWORD
  std::vector<std::string> topics = {"#"};
  std::vector<std::string> adapters;  // HOST[:PORT] of MTConnect adapters
  std::vector<std::string> items;     // NAME=ITEM[*FACTOR]
};

/// The broker and the adapters: what they send becomes lines of the service's own protocol.
class LiveSources {
 public:
  /// Takes such a line; an error of what came instead.
  using Take = std::function<void(const Result<std::string>& line)>;
  static Result<LiveSources> open(const LiveSourceOptions& options, const thermal::ThermalModel& model);

  report::LiveReadings& readings() { return readings_; }
  /// What to poll for reading.
  std::vector<int> descriptors() const;
  /// Hands on what came; tells once of each source that is not there, or sends what is faulty. Gives whether
  /// anything came.
  bool step(double now_s, const Take& take);

 private:
  explicit LiveSources(report::LiveReadings readings) : readings_(std::move(readings)) {}
  void tell_state(const std::string& source, bool connected);
  void hand_on(const std::string& source, const Result<std::string>& line, const Take& take);
  report::LiveReadings readings_;
  std::optional<thermal::MqttClient> mqtt_;
  std::string broker_;
  std::vector<thermal::ShdrClient> adapters_;
  std::map<std::string, bool> connected_;   // by source, as it was told
  std::map<std::string, bool> was_faulty_;  // told of
};

}  // namespace trunnion::app
