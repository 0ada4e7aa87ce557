#include "app/thermal_serve.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <spdlog/spdlog.h>
#include <sstream>
#include <sys/file.h>
#include <unistd.h>
#include <utility>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/thermal_service.hpp"
#include "trunnion/thermal/line_server.hpp"

#include "app/live_sources.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

volatile std::sig_atomic_t stop_asked = 0;  // the only thing a signal handler may touch

struct ThermalServeOptions {
  std::string model;
  std::uint16_t port = 0;
  std::optional<std::string> journal;
  double idle_exit_s = 0.0;
  double clamp_um = thermal::OffsetLimits{}.clamp_mm / kMmPerUm;
  double slew_um_s = thermal::OffsetLimits{}.slew_mm_s / kMmPerUm;
  double dead_band_um = thermal::OffsetLimits{}.dead_band_mm / kMmPerUm;
  LiveSourceOptions sources;
};

// Every accepted line, on the disk before its answer goes out: what was answered is never lost, not even when
// the power fails.
class Journal {
 public:
  static Result<Journal> open(const std::string& path) {
    // A line that a crash cut off must not swallow the next one.
    const auto before = std::filesystem::exists(path) ? read_file(path) : Result<std::string>("");
    if (!before) return tl::unexpected(before.error());
    Journal out;
    out.file_ = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
    if (out.file_ < 0)
      return fail(ErrorCode::io_failed, std::string("cannot write the journal: ") + std::strerror(errno),
                  path);
    // Two services would mix their readings.
    if (::flock(out.file_, LOCK_EX | LOCK_NB) != 0)
      return fail(ErrorCode::io_failed, "another service writes this journal", path);
    if (!before->empty() && before->back() != '\n' && !out.write(""))
      return fail(ErrorCode::io_failed, std::string("cannot write the journal: ") + std::strerror(errno),
                  path);
    return out;
  }
  Journal(Journal&& other) noexcept : file_(std::exchange(other.file_, -1)), waits_(other.waits_) {}
  Journal& operator=(Journal&&) = delete;
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal() {
    if (file_ >= 0) ::close(file_);
  }

  bool write(const std::string& line) {
    const std::string text = line + "\n";
    waits_ = true;
    for (std::string_view rest = text; !rest.empty();) {
      const ssize_t n = ::write(file_, rest.data(), rest.size());
      if (n < 0 && errno != EINTR) return false;
      if (n > 0) rest.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  bool sync() {
    if (!std::exchange(waits_, false)) return true;
    int code = ::fsync(file_);
    while (code != 0 && errno == EINTR) code = ::fsync(file_);
    return code == 0;
  }

 private:
  Journal() = default;
  int file_ = -1;
  bool waits_ = false;  // something was written since the last sync
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// How long ago the last line of a journal was written, s; 0 where there is none.
double age_of(const std::string& path) {
  std::error_code ec;
  const auto written = std::filesystem::last_write_time(path, ec);
  const auto now = std::filesystem::file_time_type::clock::now();
  return ec ? 0.0 : std::max(0.0, std::chrono::duration<double>(now - written).count());
}

// The state as it was when the service stopped; its readings are as old as the journal.
Result<void> replay(const std::string& path, double age_s, report::ThermalService& service) {
  if (!std::filesystem::exists(path)) return {};
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) service.handle(line, -age_s);
  }
  spdlog::info("{} readings replayed from {}, {} faulty lines left out", service.readings(), path,
               service.rejected());
  return {};
}

// The service, its journal and what is read beside its own protocol.
class LiveLoop {
 public:
  static Result<std::unique_ptr<LiveLoop>> open(const ThermalServeOptions& options,
                                                thermal::ThermalModel model, LiveSources sources) {
    thermal::OffsetLimits limits;
    limits.clamp_mm = options.clamp_um * kMmPerUm;
    limits.slew_mm_s = options.slew_um_s * kMmPerUm;
    limits.dead_band_mm = options.dead_band_um * kMmPerUm;
    std::unique_ptr<LiveLoop> out(new LiveLoop(std::move(model), limits, std::move(sources)));
    if (!options.journal) return out;
    const double age_s = age_of(*options.journal);
    auto opened = Journal::open(*options.journal);
    if (!opened) return tl::unexpected(opened.error());
    out->journal_.emplace(std::move(*opened));
    if (const auto replayed = replay(*options.journal, age_s, out->service_); !replayed)
      return tl::unexpected(replayed.error());
    // Sources that say no time go on behind the pause.
    if (const auto time_s = out->service_.time_s()) out->sources_.readings().set_clock(*time_s + age_s, 0.0);
    return out;
  }

  thermal::LineServer::Answer handle(const std::string& line) {
    if (!is_shdr(line)) return take(line);
    const auto parsed = parse_shdr_line(line);
    const auto reading =
        parsed ? sources_.readings().of_shdr("this port", *parsed, now_s()) : tl::unexpected(parsed.error());
    if (!reading) return {service_.refuse(reading.error().message), false};
    return {take(reading->empty() ? R"({"query": "offset"})" : *reading), false};
  }
  bool make_lasting() {
    failed_ = failed_ || (journal_ && !journal_->sync());
    return !failed_;
  }
  /// What the broker and the adapters sent.
  bool read_sources() {
    const bool any = sources_.step(now_s(), [this](const Result<std::string>& line) {
      if (line)
        take(*line);
      else
        service_.refuse(line.error().message);
    });
    make_lasting();
    return any;
  }
  std::vector<int> descriptors() const { return sources_.descriptors(); }
  const report::ThermalService& service() const { return service_; }
  bool failed() const { return failed_; }

 private:
  LiveLoop(thermal::ThermalModel model, const thermal::OffsetLimits& limits, LiveSources sources)
      : service_(std::move(model), limits), sources_(std::move(sources)) {}
  double now_s() const { return seconds_since(begin_); }
  std::string take(const std::string& line) {
    std::string answer = service_.handle(line, now_s());
    if (journal_ && service_.changed() && !journal_->write(line)) failed_ = true;
    return answer;
  }

  report::ThermalService service_;
  LiveSources sources_;
  std::optional<Journal> journal_;
  Clock::time_point begin_ = Clock::now();
  bool failed_ = false;  // the journal could not be written
};

ExitCode serve(const ThermalServeOptions& options) {
  Diagnostics diagnostics;
  auto model = thermal::load_model(options.model, diagnostics);
  if (!model) return print_failure(diagnostics, model.error());
  if (const auto said = thermal::check_axes(*model, options.model); !said) return print_error(said.error());
  print(diagnostics);
  auto sources = LiveSources::open(options.sources, *model);
  if (!sources) return print_error(sources.error());
  auto opened = LiveLoop::open(options, std::move(*model), std::move(*sources));
  if (!opened) return print_error(opened.error());
  LiveLoop& loop = **opened;
  auto server = thermal::LineServer::listen(
      options.port, [&](const std::string& line) { return loop.handle(line); },
      [&] { return loop.make_lasting(); });
  if (!server) return print_error(server.error());
  std::signal(SIGINT, [](int) { stop_asked = 1; });
  std::signal(SIGTERM, [](int) { stop_asked = 1; });
  spdlog::info("listening on 127.0.0.1:{}", server->port());
  auto last = Clock::now();
  while (stop_asked == 0 && !loop.failed()) {
    constexpr int kWake_ms = 200;
    const bool asked = server->step(kWake_ms, loop.descriptors()) || server->clients() > 0;
    if (loop.read_sources() || asked) last = Clock::now();
    if (options.idle_exit_s > 0.0 && seconds_since(last) > options.idle_exit_s) break;
  }
  spdlog::info("{} readings taken, {} lines rejected", loop.service().readings(), loop.service().rejected());
  return loop.failed() ? print_error({ErrorCode::io_failed, "cannot write the journal", *options.journal, {}})
                       : kDone;
}

}  // namespace

void add_thermal_serve_command(CLI::App& thermal, int& exit) {
  auto options = std::make_shared<ThermalServeOptions>();
  CLI::App* sub = thermal.add_subcommand("serve",
                                         "live loop on the loopback: readings in, corrections out (JSON "
                                         "lines, XML strings, MTConnect SHDR, MQTT)");
  sub->add_option("model", options->model, "thermal model")->required();
  sub->add_option("--port", options->port, "port on 127.0.0.1; 0 is any free one")->required();
  sub->add_option("--journal", options->journal,
                  "file of accepted lines: after a restart the service continues from it");
  sub->add_option("--idle-exit-s", options->idle_exit_s, "stop after so long without a client (0: never)")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--clamp-um", options->clamp_um, "largest correction")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--slew-um-s", options->slew_um_s, "largest rate of change of the correction")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--dead-band-um", options->dead_band_um, "smaller changes are not followed")
      ->check(between(0.0, kLargestOption))
      ->capture_default_str();
  LiveSourceOptions& sources = options->sources;
  sub->add_option("--mqtt", sources.mqtt, "broker to read from, HOST[:PORT]");
  sub->add_option("--topic", sources.topics, "its topics, as MQTT filters")->capture_default_str();
  sub->add_option("--mqtt-user", sources.mqtt_user,
                  "user of the broker; its password is read from the environment, TRUNNION_MQTT_PASSWORD");
  sub->add_option("--adapter", sources.adapters, "MTConnect adapter to read from, HOST[:PORT]");
  sub->add_option(
      "--item", sources.items,
      "NAME=ITEM[*FACTOR]: a sensor, spindle_rpm, feed_mm_min, a channel or time_s of the model takes this "
      "item of a topic or adapter (default: the item of its own name)");
  sub->callback([options, &exit] { exit = serve(*options); });
}

}  // namespace trunnion::app
