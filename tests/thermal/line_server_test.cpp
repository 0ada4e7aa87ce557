#include "trunnion/thermal/line_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <string>
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
      if (n > 0) bytes.remove_prefix(static_cast<std::size_t>(n));
      server_->step(10);
    }
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
