// `trunnion thermal` as a user runs it: the service as a process that is killed, the split of a drift.
#include <arpa/inet.h>
#include <array>
#include <atomic>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/report/thermal_service.hpp"
#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

const std::string kProgram = test::binary_folder() + "/trunnion";

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "trunnion_thermal_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path = name;
  }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string file(const std::string& name) const { return (path / name).string(); }
  fs::path path;
};

std::string model_file_text() {
  thermal::ImpellerDays days;
  days.impellers = 4;
  days.step_s = 10.0;
  thermal::FitOptions options;
  options.method = thermal::Method::ridge;
  options.targets = {"dx", "dy"};
  Diagnostics diagnostics;
  auto result = thermal::fit_thermal(thermal::simulate(days).log, options, diagnostics);
  for (auto& channel : result->model.channels) channel.candidate.anchor = thermal::Anchor::update;
  return thermal::model_text(result->model);
}

/// A service process with its messages.
class Service {
 public:
  Service(const std::string& model, const std::string& journal) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDERR_FILENO);
      execl(kProgram.c_str(), "trunnion", "thermal", "serve", model.c_str(), "--port", "0", "--journal",
            journal.c_str(), "--idle-exit-s", "60", nullptr);
      _exit(127);
    }
    close(ends[1]);
    messages_ = ends[0];
    // "listening on 127.0.0.1:PORT"
    for (char c = 0; read(messages_, &c, 1) == 1;) {
      text_ += c;
      const auto at = text_.find("127.0.0.1:");
      if (c == '\n' && at != std::string::npos) {
        port_ = static_cast<std::uint16_t>(std::stoi(text_.substr(at + 10)));
        return;
      }
    }
  }
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  ~Service() {
    stop(SIGKILL);
    close(messages_);
  }
  std::uint16_t port() const { return port_; }
  const std::string& text() const { return text_; }
  int stop(int signal) {
    if (pid_ <= 0) return -1;
    kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
  int messages_ = -1;
  std::string text_;
  std::uint16_t port_ = 0;
};

class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("no connection");
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }
  void send(const std::string& line) const {
    const std::string text = line + "\n";
    std::string_view rest = text;
    while (!rest.empty()) {
      const ssize_t n = ::send(socket_, rest.data(), rest.size(), MSG_NOSIGNAL);
      if (n <= 0) return;
      rest.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  /// The next answer; empty when the service is gone.
  std::string answer() {
    for (;;) {
      if (const auto end = in_.find('\n'); end != std::string::npos) {
        std::string line = in_.substr(0, end);
        in_.erase(0, end + 1);
        return line;
      }
      std::array<char, 4096> buffer;
      const ssize_t n = recv(socket_, buffer.data(), buffer.size(), 0);
      if (n <= 0) return {};
      in_.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
  std::string ask(const std::string& line) {
    send(line);
    return answer();
  }

 private:
  int socket_;
  std::string in_;
};

std::string reading(int i) {
  json out;
  out["time_s"] = i;
  for (const char* name :
       {"spindle_front", "spindle_rear", "head", "column", "a_bearing", "c_bearing", "bed", "ambient"})
    out["T_degC"][name] = 20.0 + 0.01 * i;
  if (i % 50 == 0) out["measured_um"]["dx"] = 0.1 * i;
  return out.dump();
}

// Everything but the count of rejected lines, which a restart begins anew.
json state_of(Client& client) {
  return json::parse(client.ask(R"({"query": "offset"})"));
}

TEST(ThermalServe, KilledInTheMiddleItGoesOnWhereItWas) {
  const Folder folder;
  const std::string model = folder.file("thermal.toml");
  const std::string journal = folder.file("journal.txt");
  std::ofstream(model) << model_file_text();
  int answered = 0;
  {
    Service service(model, journal);
    Client client(service.port());
    Client burst(service.port());
    for (; answered < 200; ++answered) ASSERT_TRUE(json::parse(client.ask(reading(answered)))["ok"]);
    // In the middle of a burst of lines that no one waits for.
    std::string many;
    for (int i = 200; i < 1200; ++i) many += reading(i) + "\n";
    many.pop_back();
    burst.send(many);
    for (; !burst.answer().empty() && answered < 600; ++answered) {
    }
    service.stop(SIGKILL);
    while (!burst.answer().empty()) ++answered;
  }
  Service again(model, journal);
  Client client(again.port());
  const json state = state_of(client);
  EXPECT_GE(state["readings"], answered);  // none that was answered is lost
  // The state is the one of a service that was never killed.
  Diagnostics d;
  report::ThermalService reference(*thermal::load_model(model, d), {});
  for (int i = 0; i < state["readings"]; ++i) reference.handle(reading(i));
  EXPECT_EQ(state, json::parse(reference.handle(R"({"query": "offset"})")));
  // And it goes on.
  EXPECT_TRUE(json::parse(client.ask(reading(2000)))["ok"]);
  EXPECT_EQ(again.stop(SIGTERM), 0);
}

TEST(ThermalServe, ManyClientsBadLinesAndXml) {
  const Folder folder;
  const std::string model = folder.file("thermal.toml");
  std::ofstream(model) << model_file_text();
  Service service(model, folder.file("journal.txt"));
  std::vector<std::unique_ptr<Client>> clients;
  for (int k = 0; k < 50; ++k) clients.push_back(std::make_unique<Client>(service.port()));
  // All post at once, each a little late or early against the others: every reading is taken.
  for (int i = 0; i < 20; ++i) {
    for (std::size_t k = 0; k < clients.size(); ++k)
      clients[k]->send(reading(10 * i + static_cast<int>((7 * k) % 10)));
    for (auto& client : clients) ASSERT_TRUE(json::parse(client->answer())["ok"]);
  }
  EXPECT_EQ(state_of(*clients[0])["readings"], 1000);
  Client& client = *clients[1];
  for (const std::string& bad :
       {std::string("nonsense"), std::string("{\"time_s\": \"x\"}"), std::string("{\"time_s\": 1e400}"),
        std::string("[1,2]"), std::string("\xff\xfe{"), std::string("{\"T_degC\": {\"head\": 20}}"),
        std::string("{\"time_s\": 5, \"measured_um\": {\"nothing\": 1}}"), std::string(100000, 'x')}) {
    const auto answer = json::parse(client.ask(bad));
    EXPECT_FALSE(answer["ok"]) << bad.substr(0, 40);
  }
  EXPECT_THAT(client.ask("<reading time_s='1000'><T name='head'>21</T></reading>"), HasSubstr("<offset "));
  EXPECT_THAT(client.ask("<reading time_s='x'/>"), HasSubstr("<error>"));
  EXPECT_THAT(client.ask("<!DOCTYPE a [<!ENTITY x SYSTEM \"/etc/passwd\">]><reading>&x;</reading>"),
              HasSubstr("<error>"));
  EXPECT_EQ(state_of(client)["readings"], 1001);
  // A second service on the same journal would mix the readings.
  const Folder other;
  const std::string command = kProgram + " thermal serve " + model + " --port 0 --journal " +
                              folder.file("journal.txt") + " 2> " + other.file("err.txt");
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 4);
  EXPECT_THAT(read_file(other.file("err.txt")).value_or(""),
              HasSubstr("another service writes this journal"));
  EXPECT_EQ(service.stop(SIGINT), 0);
}

TEST(ThermalServe, AClientThatSendsBlankLinesWithoutPauseStopsNobody) {
  const Folder folder;
  const std::string model = folder.file("thermal.toml");
  std::ofstream(model) << model_file_text();
  Service service(model, folder.file("journal.txt"));
  std::atomic<bool> over = false;
  std::thread flood([&, port = service.port()] {
    const Client client(port);
    const std::string blank(1 << 16, '\n');
    while (!over) client.send(blank);
  });
  Client client(service.port());
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(json::parse(client.ask(reading(i)))["ok"]);
  // Nothing of a web page counts, and its connection ends.
  Client page(service.port());
  page.send("POST / HTTP/1.1\r\nContent-Type: text/plain\r\n\r\n{\"enabled\": false}");
  EXPECT_FALSE(json::parse(page.answer())["ok"]);
  EXPECT_EQ(page.answer(), "");
  EXPECT_EQ(state_of(client)["enabled"], true);
  EXPECT_EQ(service.stop(SIGTERM), 0);
  over = true;
  flood.join();
}

TEST(ThermalPredict, RefusesATimeThatIsNone) {
  const Folder folder;
  std::ofstream(folder.file("thermal.toml")) << model_file_text();
  const auto code_of = [&](const std::string& time_s) {
    std::ofstream(folder.file("log.csv"))
        << "time_s,T_spindle_front_degC,T_spindle_rear_degC,T_head_degC,T_column_degC,T_a_bearing_degC,"
           "T_c_bearing_degC,T_bed_degC,T_ambient_degC\n0,20,20,20,20,20,20,20,20\n"
        << time_s << ",21,21,21,21,21,21,21,21\n";
    const std::string command = kProgram + " thermal predict " + folder.file("thermal.toml") + " " +
                                folder.file("log.csv") + " > /dev/null 2> " + folder.file("err.txt");
    return WEXITSTATUS(std::system(command.c_str()));
  };
  EXPECT_EQ(code_of("60"), 0);
  EXPECT_EQ(code_of("9e15"), 0);
  EXPECT_EQ(code_of("1e19"), 3);
  EXPECT_THAT(read_file(folder.file("err.txt")).value_or(""), HasSubstr("log.csv:3:1: error: '1e19'"));
}

// A log that goes where no training run was says so: there the model is a guess.
TEST(ThermalPredict, TellsWhatLiesOutsideOfTheTraining) {
  const Folder folder;
  std::ofstream(folder.file("thermal.toml")) << model_file_text();
  const auto said_of = [&](double rise) {
    std::ofstream out(folder.file("log.csv"));
    out << "time_s,T_spindle_front_degC,T_spindle_rear_degC,T_head_degC,T_column_degC,T_a_bearing_degC,"
           "T_c_bearing_degC,T_bed_degC,T_ambient_degC\n";
    for (int i = 0; i <= 20; ++i) {
      out << 60 * i;
      for (int k = 0; k < 8; ++k) out << ',' << 20.0 + rise * i / 20.0;
      out << '\n';
    }
    out.close();
    const std::string command = kProgram + " thermal predict " + folder.file("thermal.toml") + " " +
                                folder.file("log.csv") + " > /dev/null 2> " + folder.file("err.txt");
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 0);
    return read_file(folder.file("err.txt")).value_or("");
  };
  EXPECT_THAT(said_of(0.5), testing::Not(HasSubstr("lie outside of what the model")));
  EXPECT_THAT(said_of(60.0), HasSubstr("lie outside of what the model of"));
}

// A sensor that was never read counted as at reference: what it asks for was left out of a program that was
// called verified. A column that the model does not need may be empty.
TEST(ThermalPost, RefusesALogWithoutAReadingOfASensorThatIsNeeded) {
  const Folder folder;
  std::ofstream(folder.file("thermal.toml")) << model_file_text();
  std::ofstream(folder.file("errors.toml"))
      << "[model]\nname = \"m\"\n[[effect]]\nid = \"ambient_drift\"\n[effect.parameters]\nX_um_per_K = "
         "2\nY_um_per_K = 1\nZ_um_per_K = 3\ntau_s = 600\n";
  std::ofstream(folder.file("part.cls"))
      << "PARTNO P\nLOADTL/1\nFEDRAT/MMPM,500\nRAPID\nGOTO/0,0,60\nGOTO/0,0,40\nGOTO/20,0,40\nFINI\n";
  const auto code_of = [&](const std::string& option, const std::string& ambient, const std::string& bed) {
    std::ofstream(folder.file("log.csv"))
        << "time_s,T_spindle_front_degC,T_spindle_rear_degC,T_head_degC,T_column_degC,T_a_bearing_degC,"
           "T_c_bearing_degC,T_bed_degC,T_ambient_degC\n0,20,20,20,20,20,20,"
        << bed << "," << ambient << "\n60,21,21,21,21,21,21," << bed << "," << ambient << "\n";
    const std::string command = kProgram + " post " + folder.file("part.cls") + " -m trunnion_offset " +
                                option + " --temperatures " + folder.file("log.csv") + " -o " +
                                folder.file("o.nc") + " > /dev/null 2> " + folder.file("err.txt");
    return WEXITSTATUS(std::system(command.c_str()));
  };
  const std::string model = "--model " + folder.file("errors.toml");
  EXPECT_EQ(code_of(model, "21", "21"), 0) << read_file(folder.file("err.txt")).value_or("");
  EXPECT_EQ(code_of(model, "21", ""), 0) << read_file(folder.file("err.txt")).value_or("");
  fs::remove(folder.file("o.nc"));
  EXPECT_EQ(code_of(model, "", "21"), 3);
  EXPECT_THAT(read_file(folder.file("err.txt")).value_or(""),
              HasSubstr("the log has no reading in column T_ambient_degC"));
  EXPECT_EQ(code_of("--thermal " + folder.file("thermal.toml"), "", "21"), 3);
  EXPECT_FALSE(fs::exists(folder.file("o.nc")));
}

// A channel of another name is asked for its offset, with the option that says it; nothing is written before.
TEST(ThermalFit, AsksWhichOffsetAChannelGives) {
  const Folder folder;
  thermal::ImpellerDays days;
  days.impellers = 3;
  days.step_s = 10.0;
  thermal::Log log = thermal::simulate(days).log;
  log.channels = {"ch1", "dy", "dz"};
  std::ofstream(folder.file("log.csv")) << thermal::log_text(log, {});
  const auto code_of = [&](const std::string& words) {
    const std::string command =
        "cd " + folder.path.string() + " && " + kProgram + " thermal " + words + " > out.txt 2> err.txt";
    return WEXITSTATUS(std::system(command.c_str()));
  };
  EXPECT_EQ(code_of("fit log.csv --target ch1,dy --method rises -o m.toml"), 3);
  EXPECT_THAT(read_file(folder.file("err.txt")).value_or(""), HasSubstr("--axes ch1=dx|dy|dz|none"));
  EXPECT_FALSE(fs::exists(folder.file("m.toml")));
  EXPECT_EQ(code_of("fit log.csv --target ch1,dy --method rises"), 0);  // no model, no offset
  EXPECT_EQ(code_of("fit log.csv --target ch1,dy --method rises -o m.toml --axes ch1=dy"), 3);
  EXPECT_EQ(code_of("fit log.csv --target ch1,dy --method rises -o m.toml --axes ch1=up"), 2);
  EXPECT_EQ(code_of("fit log.csv --target ch1,dy --method rises -o m.toml --axes ch1=dx"), 0);
  EXPECT_EQ(code_of("predict m.toml log.csv --measure-every-min 60"), 0);
  // A model of before, which does not say it.
  std::string text = read_file(folder.file("m.toml")).value();
  text.erase(text.find("axis = 'dx'"), 11);
  std::ofstream(folder.file("old.toml")) << text;
  EXPECT_EQ(code_of("predict old.toml log.csv"), 3);
  EXPECT_THAT(read_file(folder.file("err.txt")).value_or(""), HasSubstr("--axes ch1=dx|dy|dz|none"));
}

// Readings of X, Y and Z at poses of A = 0, from the exact chain: C's line moved by 20 um, the tool by 7 and
// -4 um; probed at A = C = 0 before.
std::string drift_csv(const std::vector<double>& c_deg) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  ChainErrors errors;
  errors.joint[*machine.axis("C")].trans_mm = Vec3(0.020, 0.0, 0.0);
  const auto d_P = [&](const JointVector& q) {
    return Vec3(forward(machine, q, machine.tool_vector(), errors).p - forward(machine, q).p);
  };
  std::string out = "run_id,X_mm,Y_mm,Z_mm,A_deg,C_deg,quantity,n_x,n_y,n_z,value,unit,u_random\n";
  for (const double c : c_deg) {
    JointVector q;
    q[*machine.axis("C")] = Angle::degrees(c).rad();
    const Vec3 d = part_in_machine(machine, q).R * (d_P(q) - d_P({})) + Vec3(0.007, -0.004, 0.0);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Vec3 n = Vec3::Unit(i);
      out += "warm,0,0,0,0," + fixed_text(c, 1) + ",displacement," + fixed_text(n.x(), 0) + "," +
             fixed_text(n.y(), 0) + "," + fixed_text(n.z(), 0) + "," + fixed_text(d[i] / kMmPerUm, 4) +
             ",um,1\n";
    }
  }
  return out;
}

TEST(ThermalSplit, TellsTheCAxisFromTheToolAtFourAnglesAndRefusesAtOne) {
  const Folder folder;
  std::ofstream(folder.file("four.csv")) << drift_csv({0, 90, 180, 270});
  std::ofstream(folder.file("one.csv")) << drift_csv({90});
  const auto run = [&](const std::string& data, const std::string& more = "--probed-at A=0,C=0") {
    const std::string command = "cd " + folder.path.string() + " && " + kProgram + " thermal split " + data +
                                " -m trunnion_offset " + more + " --json out.json > text.txt 2> err.txt";
    return WEXITSTATUS(std::system(command.c_str()));
  };
  const auto result = [&] { return json::parse(read_file(folder.file("out.json")).value_or("{}")); };
  EXPECT_EQ(run("four.csv"), 0) << read_file(folder.file("err.txt")).value_or("");
  EXPECT_NEAR(result()["parameters"]["X0C"]["value_um"], 20.0, 0.01);
  EXPECT_NEAR(result()["parameters"]["Y0C"]["value_um"], 0.0, 0.01);
  EXPECT_NEAR(result()["parameters"]["tool_x"]["value_um"], 7.0, 0.01);
  EXPECT_NEAR(result()["parameters"]["tool_y"]["value_um"], -4.0, 0.01);
  EXPECT_EQ(result()["rank"], 5);  // A was never tilted
  // Here each axis moves alone; in a model file C goes with A.
  EXPECT_THAT(read_file(folder.file("text.txt")).value_or(""),
              HasSubstr("its Y0C is Y0C minus Y0A of these"));
  EXPECT_EQ(run("one.csv"), 1);
  EXPECT_EQ(result()["rank"], 3);
  EXPECT_FALSE(result()["parameters"]["X0C"]["identifiable"]);
  EXPECT_FALSE(result()["parameters"]["X0C"].contains("value_um"));
  EXPECT_THAT(read_file(folder.file("err.txt")).value_or(""), HasSubstr("rank 3 of 7"));
  EXPECT_EQ(run("four.csv", "--rides"), 1);  // a common shift of all is never seen
  EXPECT_EQ(run("four.csv", "--probed-at Q=0"), 2);
  EXPECT_EQ(run("four.csv", "--probed-at A=0,C=0 --need Y0A"), 1);
  EXPECT_EQ(run("four.csv", "--probed-at A=0,C=0 --need nonsense"), 2);
  EXPECT_EQ(run("missing.csv"), 4);
  std::ofstream(folder.file("empty.csv")) << "";
  EXPECT_EQ(run("empty.csv"), 3);
}

}  // namespace
}  // namespace trunnion
