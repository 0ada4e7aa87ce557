#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "trunnion/base/result.hpp"

namespace trunnion::thermal {

/// Takes lines over TCP on the loopback and answers each with one line, in order; one thread, poll. A line is
/// never dropped: a client that does not read its answers is not read from either until it does, unless they
/// are such as it need not read (`Answer::needed`): those are left out while many wait. A line longer than
/// kLongestLine is answered by the handler with what came so far cut off.
///
/// Clients are served in turn, one piece of what each has sent at a time. When the process has no descriptor
/// left, further clients wait until one goes. A line that begins with a method of HTTP is answered by the
/// handler as if it were empty and ends the connection: any web page on the same computer can send one.
class LineServer {
 public:
  /// Answer to one line (both without line end); an empty one sends nothing.
  struct Answer {
    std::string text;
    bool needed = true;  // false: to a protocol that knows no answers
    Answer(std::string words, bool read = true)
        : text(std::move(words)), needed(read) {}  // NOLINT: a text is one
  };
  using Handler = std::function<Answer(const std::string& line)>;
  /// Called after the lines that came together were handled and before their answers go out: makes lasting
  /// what was answered. When it gives false the answers are not sent and the client is closed.
  using Commit = std::function<bool()>;
  static constexpr std::size_t kLongestLine = 1U << 16U;
  static constexpr std::size_t kUnreadAnswers =
      1U << 16U;  // bytes that wait for a client before it is no longer read from

  /// Listens on 127.0.0.1; port 0 is any free one. Fails with io_failed.
  static Result<LineServer> listen(std::uint16_t port, Handler handler, Commit commit = {});
  LineServer(LineServer&& other) noexcept;
  LineServer& operator=(LineServer&&) = delete;
  LineServer(const LineServer&) = delete;
  LineServer& operator=(const LineServer&) = delete;
  ~LineServer();

  std::uint16_t port() const { return port_; }
  std::size_t clients() const { return clients_.size(); }
  /// Waits at most `timeout_ms` for something to do, or for one of `others` (descriptors of somebody else) to
  /// become readable, and does what is its own. Returns whether anything happened.
  bool step(int timeout_ms, std::span<const int> others = {});

 private:
  struct Client {
    std::string in, out;
    bool too_long = false;  // the rest of the line is being skipped
    bool closed = false;    // the peer sends no more, or nothing more is taken from it
  };
  LineServer(int descriptor, std::uint16_t port, Handler handler, Commit commit);
  void accept_clients();
  void receive(int descriptor, Client& client);
  void take_lines(Client& client);
  void take_line(const std::string& line, Client& client);
  bool send(int descriptor, Client& client);
  int listener_ = -1;
  bool no_descriptor_ = false;  // for another client
  std::uint16_t port_ = 0;
  Handler handler_;
  Commit commit_;
  std::map<int, Client> clients_;  // by descriptor
};

}  // namespace trunnion::thermal
