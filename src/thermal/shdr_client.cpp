#include "trunnion/thermal/shdr_client.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <netdb.h>
#include <poll.h>
#include <string_view>
#include <unistd.h>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::thermal {
namespace {

constexpr double kRetry_s = 5.0;
constexpr double kPing_s = 10.0;

}  // namespace

Result<ShdrClient> ShdrClient::create(const std::string& address) {
  const auto colon = address.rfind(':');
  const std::string host = address.substr(0, colon);
  const std::string port = colon == std::string::npos ? "7878" : address.substr(colon + 1);
  const auto number = parse_integer(port);
  if (host.empty() || !number || *number == 0 || *number > 65535)
    return fail(ErrorCode::wrong_use, "'" + address + "' is no HOST:PORT of an adapter");
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); code != 0)
    return fail(ErrorCode::wrong_use, "'" + address + "': " + ::gai_strerror(code));
  ShdrClient out;
  out.address_ = host + ":" + port;
  std::memcpy(&out.place_, found->ai_addr, found->ai_addrlen);
  out.place_size_ = found->ai_addrlen;
  ::freeaddrinfo(found);
  return out;
}

ShdrClient::ShdrClient(ShdrClient&& other) noexcept
    : address_(std::move(other.address_)),
      place_(other.place_),
      place_size_(other.place_size_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      connected_(other.connected_),
      tried_s_(other.tried_s_),
      pinged_s_(other.pinged_s_),
      heard_s_(other.heard_s_),
      heartbeat_s_(other.heartbeat_s_),
      in_(std::move(other.in_)) {}

ShdrClient::~ShdrClient() {
  disconnect();
}

void ShdrClient::disconnect() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  connected_ = false;
  heartbeat_s_ = 0.0;
  in_.clear();
}

void ShdrClient::connect(double now_s) {
  if (descriptor_ < 0) {
    if (now_s - tried_s_ < kRetry_s) return;
    tried_s_ = now_s;
    descriptor_ = ::socket(place_.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (descriptor_ < 0) return;
    const auto* const generic = reinterpret_cast<const sockaddr*>(&place_);  // the socket interface's own way
    if (::connect(descriptor_, generic, place_size_) != 0 && errno != EINPROGRESS) return disconnect();
  }
  pollfd waiting{descriptor_, POLLOUT, 0};
  if (::poll(&waiting, 1, 0) <= 0) {
    if (now_s - tried_s_ > kRetry_s) disconnect();
    return;
  }
  int code = 0;
  socklen_t size = sizeof code;
  ::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &code, &size);
  if (code != 0) return disconnect();
  connected_ = true;
  heard_s_ = now_s;
  pinged_s_ = now_s - kPing_s;
}

void ShdrClient::ping(double now_s) {
  if (now_s - pinged_s_ < (heartbeat_s_ > 0.0 ? std::min(heartbeat_s_, kPing_s) : kPing_s)) return;
  pinged_s_ = now_s;
  constexpr std::string_view kPing = "* PING\n";
  // An adapter that does not even take these few bytes is not read from for long: it is connected to anew.
  if (::send(descriptor_, kPing.data(), kPing.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(kPing.size()))
    disconnect();
}

std::vector<std::string> ShdrClient::receive(double now_s) {
  std::vector<std::string> lines;
  std::array<char, 1 << 12> buffer;
  constexpr int kAtOnce = 64;  // pieces, before others get their turn
  for (int i = 0; i < kAtOnce; ++i) {
    const ssize_t n = ::recv(descriptor_, buffer.data(), buffer.size(), 0);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (n <= 0) {
      disconnect();
      break;
    }
    heard_s_ = now_s;
    in_.append(buffer.data(), static_cast<std::size_t>(n));
    std::size_t begin = 0;
    for (auto end = in_.find('\n'); end != std::string::npos; end = in_.find('\n', begin)) {
      lines.push_back(in_.substr(begin, end - begin));
      begin = end + 1;
    }
    in_.erase(0, begin);
    if (in_.size() > kLongestLine) in_.clear();  // what follows is cut, and told as a faulty line
  }
  return lines;
}

std::vector<std::string> ShdrClient::step(double now_s) {
  if (!connected_) connect(now_s);
  if (!connected_) return {};
  ping(now_s);
  if (!connected_) return {};
  auto lines = receive(now_s);
  // Twice the promised interval without a byte is what agents take for the end.
  if (connected_ && heartbeat_s_ > 0.0 && now_s - heard_s_ > 2.0 * heartbeat_s_) disconnect();
  return lines;
}

}  // namespace trunnion::thermal
