#pragma once
#include <cstdint>
#include <string>
#include <sys/socket.h>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::thermal {

/// Reads the lines of an MTConnect adapter as an agent does: it connects, sends `* PING`, and connects again
/// when the connection ends or the heartbeat that the adapter promised does not come. Never waits.
class ShdrClient {
 public:
  /// `address` is HOST:PORT (7878 where the port is left out). Fails (wrong_use) on an address that is none.
  static Result<ShdrClient> create(const std::string& address);
  ShdrClient(ShdrClient&& other) noexcept;
  ShdrClient& operator=(ShdrClient&&) = delete;
  ShdrClient(const ShdrClient&) = delete;
  ShdrClient& operator=(const ShdrClient&) = delete;
  ~ShdrClient();

  const std::string& address() const { return address_; }
  /// What to poll for reading; below zero while there is no connection.
  int descriptor() const { return descriptor_; }
  bool connected() const { return connected_; }
  /// Does what is due and gives the whole lines that came. @param now_s  of a clock that never goes back
  std::vector<std::string> step(double now_s);
  /// The adapter has said how often it answers a PING, s.
  void expect_heartbeat(double interval_s) { heartbeat_s_ = interval_s; }

 private:
  ShdrClient() = default;
  void connect(double now_s);
  void disconnect();
  void ping(double now_s);
  std::vector<std::string> receive(double now_s);
  static constexpr std::size_t kLongestLine = 1U << 16U;
  std::string address_;
  sockaddr_storage place_{};
  socklen_t place_size_ = 0;
  int descriptor_ = -1;
  bool connected_ = false;
  double tried_s_ = -1e9;   // the last attempt to connect
  double pinged_s_ = -1e9;  // the last PING
  double heard_s_ = 0.0;    // the last byte
  double heartbeat_s_ = 0.0;
  std::string in_;
};

}  // namespace trunnion::thermal
