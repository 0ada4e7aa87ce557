#include "trunnion/thermal/mqtt_client.hpp"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <mosquitto.h>
#include <mutex>
#include <sys/eventfd.h>
#include <type_traits>
#include <unistd.h>
#include <utility>

#include "trunnion/base/loaded_library.hpp"
#include "trunnion/base/number_text.hpp"

namespace trunnion::thermal {
namespace {

// libmosquitto by its C interface, loaded by the first client: no other command needs it.
struct MosquittoLibrary {
  decltype(&mosquitto_lib_init) init = nullptr;
  decltype(&mosquitto_new) create = nullptr;
  decltype(&mosquitto_destroy) destroy = nullptr;
  decltype(&mosquitto_username_pw_set) set_user = nullptr;
  decltype(&mosquitto_connect_callback_set) on_connect = nullptr;
  decltype(&mosquitto_disconnect_callback_set) on_disconnect = nullptr;
  decltype(&mosquitto_message_callback_set) on_message = nullptr;
  decltype(&mosquitto_reconnect_delay_set) set_delay = nullptr;
  decltype(&mosquitto_connect_async) connect = nullptr;
  decltype(&mosquitto_subscribe) subscribe = nullptr;
  decltype(&mosquitto_disconnect) disconnect = nullptr;
  decltype(&mosquitto_loop_start) start = nullptr;
  decltype(&mosquitto_loop_stop) stop = nullptr;
  std::string error;

  MosquittoLibrary() {
    LoadedLibrary file("libmosquitto.so.1");
    file.find(init, "mosquitto_lib_init");
    file.find(create, "mosquitto_new");
    file.find(destroy, "mosquitto_destroy");
    file.find(set_user, "mosquitto_username_pw_set");
    file.find(on_connect, "mosquitto_connect_callback_set");
    file.find(on_disconnect, "mosquitto_disconnect_callback_set");
    file.find(on_message, "mosquitto_message_callback_set");
    file.find(set_delay, "mosquitto_reconnect_delay_set");
    file.find(connect, "mosquitto_connect_async");
    file.find(subscribe, "mosquitto_subscribe");
    file.find(disconnect, "mosquitto_disconnect");
    file.find(start, "mosquitto_loop_start");
    file.find(stop, "mosquitto_loop_stop");
    error = file.error();
    if (error.empty()) init();
  }
};

const MosquittoLibrary& mosquitto_library() {
  static const MosquittoLibrary loaded;
  return loaded;
}

}  // namespace

Result<MqttBroker> MqttBroker::parse(const std::string& address) {
  MqttBroker out;
  const auto colon = address.rfind(':');
  out.host = address.substr(0, colon);
  if (colon != std::string::npos) {
    const auto number = parse_integer(address.substr(colon + 1));
    if (!number || *number == 0 || *number > 65535) out.host.clear();
    out.port = static_cast<std::uint16_t>(number.value_or(0));
  }
  if (out.host.empty()) return fail(ErrorCode::wrong_use, "'" + address + "' is no HOST:PORT of a broker");
  return out;
}

struct MqttClient::Connection {
  MqttBroker broker;
  mosquitto* client = nullptr;
  int wake = -1;
  std::atomic<bool> connected = false;
  std::mutex mutex;  // of what stands below
  std::vector<Message> waiting;
  std::size_t lost = 0;

  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    const MosquittoLibrary& library = mosquitto_library();
    if (client != nullptr) {
      library.disconnect(client);
      library.stop(client, true);
      library.destroy(client);
    }
    if (wake >= 0) ::close(wake);
  }

  static void on_connect(mosquitto* client, void* object, int code) {
    auto& self = *static_cast<Connection*>(object);
    self.connected = code == 0;
    if (code != 0) return;
    for (const std::string& topic : self.broker.topics)
      mosquitto_library().subscribe(client, nullptr, topic.c_str(), 0);
  }
  static void on_disconnect(mosquitto* /*client*/, void* object, int /*code*/) {
    static_cast<Connection*>(object)->connected = false;
  }
  static void on_message(mosquitto* /*client*/, void* object, const mosquitto_message* message) {
    if (message->retain) return;
    auto& self = *static_cast<Connection*>(object);
    const std::lock_guard lock(self.mutex);
    if (self.waiting.size() >= kWaiting) {
      ++self.lost;
      return;
    }
    const auto* const bytes = static_cast<const char*>(message->payload);
    const auto size = static_cast<std::size_t>(message->payloadlen);
    self.waiting.push_back({message->topic, size > 0 ? std::string(bytes, size) : std::string()});
    const std::uint64_t one = 1;
    static_cast<void>(!::write(self.wake, &one, sizeof one));
  }
};

MqttClient::MqttClient(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
MqttClient::MqttClient(MqttClient&&) noexcept = default;
MqttClient& MqttClient::operator=(MqttClient&&) noexcept = default;
MqttClient::~MqttClient() = default;

Result<MqttClient> MqttClient::start(const MqttBroker& broker) {
  const MosquittoLibrary& library = mosquitto_library();
  if (!library.error.empty())
    return fail(ErrorCode::io_failed, "MQTT needs libmosquitto, which cannot be loaded: " + library.error);
  auto out = std::make_unique<Connection>();
  out->broker = broker;
  out->wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  out->client = library.create(nullptr, true, out.get());
  if (out->wake < 0 || out->client == nullptr)
    return fail(ErrorCode::io_failed, "no room for an MQTT client");
  library.on_connect(out->client, Connection::on_connect);
  library.on_disconnect(out->client, Connection::on_disconnect);
  library.on_message(out->client, Connection::on_message);
  if (!broker.user.empty())
    library.set_user(out->client, broker.user.c_str(),
                     broker.password.empty() ? nullptr : broker.password.c_str());
  constexpr unsigned kSoonest_s = 1, kLatest_s = 10;
  library.set_delay(out->client, kSoonest_s, kLatest_s, true);
  constexpr int kKeepAlive_s = 15;  // a broker that is silent for half as long again is gone
  // A broker that is not there yet is tried again by the thread.
  library.connect(out->client, broker.host.c_str(), broker.port, kKeepAlive_s);
  if (library.start(out->client) != MOSQ_ERR_SUCCESS)
    return fail(ErrorCode::io_failed, "no thread for an MQTT client");
  return MqttClient(std::move(out));
}

int MqttClient::descriptor() const {
  return connection_->wake;
}

std::vector<MqttClient::Message> MqttClient::take() {
  std::uint64_t count = 0;
  static_cast<void>(!::read(connection_->wake, &count, sizeof count));
  const std::lock_guard lock(connection_->mutex);
  return std::exchange(connection_->waiting, {});
}

bool MqttClient::connected() const {
  return connection_->connected;
}

std::size_t MqttClient::lost() const {
  const std::lock_guard lock(connection_->mutex);
  return connection_->lost;
}

}  // namespace trunnion::thermal
