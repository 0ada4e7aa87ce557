#include "trunnion/base/shdr.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "trunnion/thermal/shdr_client.hpp"

namespace trunnion::thermal {
namespace {

using testing::HasSubstr;

std::string pairs_of(const std::string& line) {
  const auto read = parse_shdr_line(line);
  if (!read) return "error: " + read.error().message;
  std::string out;
  for (const auto& value : read->values) out += value.item + "=" + value.text + ";";
  return out;
}

// Lines as adapters of the public MTConnect agent's documentation write them.
TEST(Shdr, ReadsLinesOfAdapters) {
  EXPECT_EQ(pairs_of("2009-06-15T00:00:00.000000|power|ON|execution|ACTIVE"), "power=ON;execution=ACTIVE;");
  EXPECT_EQ(pairs_of("2012-02-21T23:59:33.460470Z|mill1:front|21.25\r"), "mill1:front=21.25;");
  EXPECT_EQ(pairs_of("|front|21.3"), "front=21.3;");  // the agent gives the time
  EXPECT_EQ(pairs_of("138.5| front | UNAVAILABLE "), "front=UNAVAILABLE;");
  EXPECT_EQ(pairs_of("-0.25|front|21.3"), "front=21.3;");  // its clock is 0 at a trigger
  EXPECT_EQ(pairs_of("2014-09-29T23:59:33.460470Z|servo|NORMAL||||"), "servo=NORMAL;");
  EXPECT_EQ(pairs_of("2012-02-21T23:59:33Z|@ASSET@|KSSP300R|CuttingTool|<CuttingTool/>"), "");
  EXPECT_EQ(pairs_of("2012-02-21T23:59:33Z|front|"), "front=;");
  EXPECT_EQ(parse_shdr_line("* PONG 10000")->heartbeat_s, 10.0);
  EXPECT_FALSE(parse_shdr_line("* device: mill")->heartbeat_s);
  EXPECT_THAT(pairs_of("front|21.3"), HasSubstr("error: a line of an adapter is time|item|value"));
  EXPECT_THAT(pairs_of("nonsense"), HasSubstr("error"));
}

TEST(Shdr, IsToldFromTheOtherProtocols) {
  EXPECT_TRUE(is_shdr("2009-06-15T00:00:00|power|ON"));
  EXPECT_TRUE(is_shdr("* PING"));
  EXPECT_FALSE(is_shdr(R"({"time_s": 1, "a|b": 2})"));
  EXPECT_FALSE(is_shdr("<query/>"));
  EXPECT_FALSE(is_shdr("nonsense"));
}

/// An adapter on the loopback.
class Adapter {
 public:
  explicit Adapter(std::uint16_t port = 0) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(port);
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof place;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&place), size) != 0 || ::listen(listener_, 4) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&place), &size) != 0)
      throw std::runtime_error("no listener");
    port_ = ntohs(place.sin_port);
  }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;
  ~Adapter() {
    end();
    ::close(listener_);
  }
  std::uint16_t port() const { return port_; }
  void accept() { client_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC); }
  void send(std::string_view text) const {
    static_cast<void>(::send(client_, text.data(), text.size(), MSG_NOSIGNAL));
  }
  std::string receive() const {
    char buffer[256];
    const ssize_t n = ::recv(client_, buffer, sizeof buffer, 0);
    return {buffer, static_cast<std::size_t>(std::max<ssize_t>(n, 0))};
  }
  void end() {
    if (client_ >= 0) ::close(client_);
    client_ = -1;
  }

 private:
  int listener_;
  int client_ = -1;
  std::uint16_t port_ = 0;
};

std::vector<std::string> lines_of(ShdrClient& client, double now_s, std::size_t wanted) {
  std::vector<std::string> out;
  for (int tries = 0; tries < 400 && out.size() < wanted; ++tries) {
    for (auto& line : client.step(now_s)) out.push_back(std::move(line));
    ::usleep(1000);
  }
  return out;
}

TEST(ShdrClient, AsksForALifeSignAndComesBack) {
  Adapter adapter;
  auto client = ShdrClient::create("127.0.0.1:" + std::to_string(adapter.port()));
  ASSERT_TRUE(client) << client.error().text();
  client->step(0.0);
  adapter.accept();
  while (!client->connected()) client->step(0.0);
  client->step(0.0);
  EXPECT_EQ(adapter.receive(), "* PING\n");
  adapter.send("* PONG 2000\n|front|21.");
  EXPECT_THAT(lines_of(*client, 0.1, 1), testing::ElementsAre("* PONG 2000"));
  client->expect_heartbeat(2.0);
  adapter.send("5\n|front|21.6\n");
  EXPECT_THAT(lines_of(*client, 0.2, 2), testing::ElementsAre("|front|21.5", "|front|21.6"));
  // An adapter that promised a sign of life each 2 s and is silent for 4 s is gone, whatever its connection
  // says.
  client->step(4.1);
  EXPECT_TRUE(client->connected());
  client->step(4.3);
  EXPECT_FALSE(client->connected());
  adapter.end();
  client->step(9.0);
  adapter.accept();
  while (!client->connected()) client->step(9.0);
  adapter.send("|front|22\n");
  EXPECT_THAT(lines_of(*client, 9.1, 1), testing::ElementsAre("|front|22"));
  adapter.end();
  for (int i = 0; i < 400 && client->connected(); ++i) {
    client->step(9.2);
    ::usleep(1000);
  }
  EXPECT_FALSE(client->connected());
}

TEST(ShdrClient, RefusesWhatIsNoAddress) {
  for (const char* text : {"", ":7878", "host:0", "host:70000", "host:x"})
    EXPECT_FALSE(ShdrClient::create(text)) << text;
  EXPECT_EQ(ShdrClient::create("127.0.0.1")->address(), "127.0.0.1:7878");
}

}  // namespace
}  // namespace trunnion::thermal
