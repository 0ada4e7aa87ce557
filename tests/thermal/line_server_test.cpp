#include "trunnion/thermal/line_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <string>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

namespace trunnion::thermal {
namespace {

// A client on the loopback that drives the server in the same thread.
class Client {
 public:
  explicit Client(LineServer& server) : server_(&server), descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(server.port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { ::close(descriptor_); }

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (n < 0 && errno != EAGAIN) return;  // the server has closed
      if (n > 0) bytes.remove_prefix(static_cast<std::size_t>(n));
      server_->step(10);
    }
  }
  /// Without giving the server a turn, as far as the connection takes it.
  void send_only(std::string_view bytes) const {
    static_cast<void>(::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }
  void finish() { ::shutdown(descriptor_, SHUT_WR); }
  /// Everything up to `lines` line ends or the end of the connection.
  std::string receive(std::size_t lines) {
    std::string out;
    for (int tries = 0;
         tries < 2000 && static_cast<std::size_t>(std::count(out.begin(), out.end(), '\n')) < lines;
         ++tries) {
      server_->step(5);
      char buffer[4096];
      const ssize_t n = ::recv(descriptor_, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n == 0) break;
      if (n > 0) out.append(buffer, static_cast<std::size_t>(n));
    }
    return out;
  }

 private:
  LineServer* server_;
  int descriptor_;
};

Result<LineServer> counting_server() {
  return LineServer::listen(0, [count = 0](const std::string& line) mutable {
    return std::to_string(++count) + ":" + std::to_string(line.size());
  });
}

TEST(LineServer, AnswersEachLineInOrder) {
  auto server = counting_server();
  ASSERT_TRUE(server) << server.error().text();
  Client client(*server);
  client.send("a\r\nbb");
  EXPECT_EQ(client.receive(1), "1:1\n");
  client.send("b\n\nlast");
  client.finish();
  EXPECT_EQ(client.receive(2), "2:3\n3:4\n");  // a last line without its end counts
}

TEST(LineServer, DropsNoLineOfManyClients) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  Client a(*server), b(*server);
  std::string burst;
  for (int i = 0; i < 20000; ++i) burst += "0123456789\n";
  a.send(burst);
  b.send(burst);
  const std::string from_a = a.receive(20000);
  const std::string from_b = b.receive(20000);
  EXPECT_EQ(std::count(from_a.begin(), from_a.end(), '\n'), 20000);
  EXPECT_EQ(std::count(from_b.begin(), from_b.end(), '\n'), 20000);
}

TEST(LineServer, CutsAnEndlessLineAndGoesOn) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  Client client(*server);
  client.send(std::string(3 * LineServer::kLongestLine, 'x'));
  client.send("\nok\n");
  const std::string answers = client.receive(2);
  EXPECT_EQ(answers.substr(answers.find('\n') + 1), "2:2\n");
}

// A browser posts a form of any web page to any port of its own computer.
TEST(LineServer, TakesNothingFromABrowser) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  for (const std::string method : {"POST", "GET", "PUT", "OPTIONS"}) {
    Client client(*server);
    client.send(method + " / HTTP/1.1\r\nHost: localhost\r\n\r\n{\"enabled\": false}\r\n");
    const std::string answer = client.receive(4);
    EXPECT_EQ(answer.substr(answer.find(':')), ":0\n") << method;  // one answer, to an empty line
  }
  Client late(*server);
  late.send("x\nPOST / HTTP/1.1\ny\n");
  const std::string answers = late.receive(3);
  EXPECT_EQ(std::count(answers.begin(), answers.end(), '\n'), 2);
  EXPECT_EQ(server->clients(), 0U);
  Client long_one(*server);
  long_one.send("POST /" + std::string(2 * LineServer::kLongestLine, 'x'));
  for (int i = 0; i < 50 && server->clients() > 0; ++i) server->step(1);
  EXPECT_EQ(server->clients(), 0U);
}

TEST(LineServer, ServesInTurnWhileOneSendsWithoutPause) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  Client flood(*server), other(*server);
  flood.send_only(std::string(1 << 20, '\n'));
  other.send_only("x\n");
  for (int i = 0; i < 3; ++i) server->step(10);
  EXPECT_EQ(other.receive(1), "1:1\n");
}

TEST(LineServer, WaitsQuietlyWhenNoDescriptorIsLeft) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  auto first = std::make_unique<Client>(*server);
  first->send("x\n");
  ASSERT_EQ(first->receive(1), "1:1\n");
  Client second(*server);
  second.send_only("y\n");
  // From here on the next descriptor is one too many.
  const int next = ::dup(0);
  ASSERT_GE(next, 0);
  ::close(next);
  rlimit few = before;
  few.rlim_cur = static_cast<rlim_t>(next);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  server->step(1);  // finds that out
  int busy = 0;
  for (int i = 0; i < 20; ++i) busy += server->step(1) ? 1 : 0;
  // Woken once more after each pause; before, every step came back at once.
  EXPECT_LE(busy, 10);
  EXPECT_EQ(server->clients(), 1U);
  first.reset();
  EXPECT_EQ(second.receive(1), "2:1\n");
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
}

TEST(LineServer, SurvivesClientsThatVanish) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  for (int i = 0; i < 50; ++i) {
    Client client(*server);
    client.send("half a li");
  }
  for (int i = 0; i < 100; ++i) server->step(1);
  EXPECT_EQ(server->clients(), 0U);
  Client client(*server);
  client.send("x\n");
  EXPECT_FALSE(client.receive(1).empty());
}

TEST(LineServer, APortThatIsTakenIsAnError) {
  auto server = counting_server();
  ASSERT_TRUE(server);
  const auto second = LineServer::listen(server->port(), [](const std::string&) { return std::string(); });
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::io_failed);
}

}  // namespace
}  // namespace trunnion::thermal
