#include "trunnion/thermal/line_server.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace trunnion::thermal {
namespace {

tl::unexpected<Error> failure(const char* action, std::uint16_t port) {
  return fail(ErrorCode::io_failed,
              std::string("cannot ") + action + " 127.0.0.1:" + std::to_string(port) + ": " +
                  std::strerror(errno));  // NOLINT(concurrency-mt-unsafe): glibc's is per thread
}

// What a browser sends first, whatever the page asks it to send.
bool is_http(std::string_view line) {
  constexpr std::array<std::string_view, 9> kMethods = {"GET ",     "HEAD ",    "POST ",  "PUT ",  "DELETE ",
                                                        "CONNECT ", "OPTIONS ", "TRACE ", "PATCH "};
  return std::any_of(kMethods.begin(), kMethods.end(),
                     [&](std::string_view method) { return line.starts_with(method); });
}

}  // namespace

Result<LineServer> LineServer::listen(std::uint16_t port, Handler handler, Commit commit) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return failure("listen on", port);
  const int yes = 1;
  ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);  // never to the outside: there is no authentication
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);  // the socket interface's own way
  if (::bind(descriptor, generic, size) != 0 || ::listen(descriptor, SOMAXCONN) != 0 ||
      ::getsockname(descriptor, generic, &size) != 0) {
    auto error = failure("listen on", port);
    ::close(descriptor);
    return error;
  }
  return LineServer(descriptor, ntohs(address.sin_port), std::move(handler), std::move(commit));
}

LineServer::LineServer(int descriptor, std::uint16_t port, Handler handler, Commit commit)
    : listener_(descriptor), port_(port), handler_(std::move(handler)), commit_(std::move(commit)) {}

LineServer::LineServer(LineServer&& other) noexcept
    : listener_(std::exchange(other.listener_, -1)),
      no_descriptor_(other.no_descriptor_),
      port_(other.port_),
      handler_(std::move(other.handler_)),
      commit_(std::move(other.commit_)),
      clients_(std::exchange(other.clients_, {})) {}

LineServer::~LineServer() {
  for (const auto& [descriptor, client] : clients_) ::close(descriptor);
  if (listener_ >= 0) ::close(listener_);
}

bool LineServer::step(int timeout_ms, std::span<const int> others) {
  // A listener that cannot be answered would be ready without end; poll passes over a negative descriptor.
  std::vector<pollfd> waiting = {{no_descriptor_ ? -1 : listener_, POLLIN, 0}};
  for (const auto& [descriptor, client] : clients_) {
    short events = 0;
    if (!client.closed && client.out.size() < kUnreadAnswers) events = POLLIN;
    if (!client.out.empty()) events = static_cast<short>(events | POLLOUT);
    waiting.push_back({descriptor, events, 0});
  }
  const std::size_t own = waiting.size();
  for (const int other : others) waiting.push_back({other, POLLIN, 0});
  if (::poll(waiting.data(), waiting.size(), timeout_ms) <= 0) {
    no_descriptor_ = false;
    return false;
  }
  for (std::size_t i = 1; i < own; ++i) {
    if (waiting[i].revents == 0) continue;
    Client& client = clients_.at(waiting[i].fd);
    if ((waiting[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0 && !client.closed)
      receive(waiting[i].fd, client);
    const bool lasting = client.out.empty() || !commit_ || commit_();
    const bool alive = lasting && send(waiting[i].fd, client);
    if (alive && !(client.closed && client.out.empty())) continue;
    ::close(waiting[i].fd);
    clients_.erase(waiting[i].fd);
    no_descriptor_ = false;
  }
  if (waiting[0].revents != 0) accept_clients();
  return true;
}

void LineServer::accept_clients() {
  constexpr int kAtOnce = 64;  // before those that are there get their turn
  for (int i = 0; i < kAtOnce; ++i) {
    const int descriptor = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) {
      no_descriptor_ = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
      return;
    }
    clients_.emplace(descriptor, Client{});
  }
}

void LineServer::receive(int descriptor, Client& client) {
  std::array<char, 1 << 12> buffer;
  const ssize_t n = ::recv(descriptor, buffer.data(), buffer.size(), 0);
  if (n < 0 && (errno == EINTR || errno == EAGAIN)) return;
  if (n > 0) {
    client.in.append(buffer.data(), static_cast<std::size_t>(n));
    take_lines(client);
    return;
  }
  client.closed = true;
  // A last line without its end is a line too.
  if (!client.in.empty() && !client.too_long) {
    client.in += '\n';
    take_lines(client);
  }
}

void LineServer::take_lines(Client& client) {
  std::size_t begin = 0;
  for (std::size_t end = client.in.find('\n'); end != std::string::npos; end = client.in.find('\n', begin)) {
    std::string line = client.in.substr(begin, end - begin);
    begin = end + 1;
    if (std::exchange(client.too_long, false)) continue;  // it was answered when it grew too long
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") == std::string::npos) continue;
    if (is_http(line)) {
      take_line({}, client);
      client.closed = true;
      client.in.clear();
      return;
    }
    take_line(line, client);
  }
  client.in.erase(0, begin);
  if (client.in.size() <= kLongestLine) return;
  if (!client.too_long) take_line(is_http(client.in) ? std::string() : client.in, client);
  client.closed = client.closed || is_http(client.in);
  client.too_long = true;
  client.in.clear();
}

void LineServer::take_line(const std::string& line, Client& client) {
  const Answer answer = handler_(line);
  const bool many = client.out.size() > kUnreadAnswers / 2;
  if (answer.text.empty() || (many && !answer.needed)) return;
  client.out.append(answer.text).append("\n");
}

bool LineServer::send(int descriptor, Client& client) {
  while (!client.out.empty()) {
    const ssize_t n = ::send(descriptor, client.out.data(), client.out.size(), MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno == EAGAIN;
    client.out.erase(0, static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace trunnion::thermal
