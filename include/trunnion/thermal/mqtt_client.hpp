#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::thermal {

/// Where a broker is and what is wanted of it.
struct MqttBroker {
  std::string host;
  std::uint16_t port = 1883;
  std::string user, password;  // empty: none
  std::vector<std::string> topics;
  /// `HOST[:PORT]`. Fails with wrong_use.
  static Result<MqttBroker> parse(const std::string& address);
};

/// Receives messages from an MQTT broker (3.1.1) by libmosquitto, which is loaded when the first client
/// starts. It connects, and connects again, in a thread of its own; the messages wait until they are taken.
/// What a broker kept from before (retained) is left out: nobody knows how old it is.
class MqttClient {
 public:
  struct Message {
    std::string topic, payload;
  };
  static constexpr std::size_t kWaiting = 10000;  // messages; further ones are lost and counted

  /// Fails (io_failed) where the library is not installed, not where the broker is not there yet.
  static Result<MqttClient> start(const MqttBroker& broker);
  MqttClient(MqttClient&&) noexcept;
  MqttClient& operator=(MqttClient&&) noexcept;
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;
  ~MqttClient();

  /// Readable while messages wait.
  int descriptor() const;
  /// What came since the last call.
  std::vector<Message> take();
  bool connected() const;
  std::size_t lost() const;

 private:
  struct Connection;
  explicit MqttClient(std::unique_ptr<Connection> connection);
  std::unique_ptr<Connection> connection_;
};

}  // namespace trunnion::thermal
