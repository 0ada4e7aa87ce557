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

ExitCode serve(const ThermalServeOptions& options) {
  Diagnostics diagnostics;
  auto model = thermal::load_model(options.model, diagnostics);
  if (!model) return print_failure(diagnostics, model.error());
  if (const auto said = thermal::check_axes(*model, options.model); !said) return print_error(said.error());
  print(diagnostics);
  thermal::OffsetLimits limits;
  limits.clamp_mm = options.clamp_um * kMmPerUm;
  limits.slew_mm_s = options.slew_um_s * kMmPerUm;
  limits.dead_band_mm = options.dead_band_um * kMmPerUm;
  report::ThermalService service(std::move(*model), limits);
  std::optional<Journal> journal;
  if (options.journal) {
    const double age_s = age_of(*options.journal);
    auto opened = Journal::open(*options.journal);
    if (!opened) return print_error(opened.error());
    journal.emplace(std::move(*opened));
    if (const auto replayed = replay(*options.journal, age_s, service); !replayed)
      return print_error(replayed.error());
  }
  const auto begin = Clock::now();
  bool journal_failed = false;
  auto server = thermal::LineServer::listen(
      options.port,
      [&](const std::string& line) {
        std::string answer = service.handle(line, seconds_since(begin));
        if (journal && service.changed() && !journal->write(line)) journal_failed = true;
        return answer;
      },
      [&] {
        if (journal && (journal_failed || !journal->sync())) journal_failed = true;
        return !journal_failed;
      });
  if (!server) return print_error(server.error());
  std::signal(SIGINT, [](int) { stop_asked = 1; });
  std::signal(SIGTERM, [](int) { stop_asked = 1; });
  spdlog::info("listening on 127.0.0.1:{}", server->port());
  auto last = Clock::now();
  while (stop_asked == 0 && !journal_failed) {
    constexpr int kWake_ms = 200;
    if (server->step(kWake_ms) || server->clients() > 0) last = Clock::now();
    if (options.idle_exit_s > 0.0 && seconds_since(last) > options.idle_exit_s) break;
  }
  spdlog::info("{} readings taken, {} lines rejected", service.readings(), service.rejected());
  return journal_failed
             ? print_error({ErrorCode::io_failed, "cannot write the journal", *options.journal, {}})
             : kDone;
}

}  // namespace

void add_thermal_serve_command(CLI::App& thermal, int& exit) {
  auto options = std::make_shared<ThermalServeOptions>();
  CLI::App* sub = thermal.add_subcommand(
      "serve", "live loop on the loopback: readings in, corrections out (JSON lines, XML strings)");
  sub->add_option("model", options->model, "thermal model")->required();
  sub->add_option("--port", options->port, "port on 127.0.0.1; 0 is any free one")->required();
  sub->add_option("--journal", options->journal,
                  "file of accepted lines: the service goes on from it after a restart");
  sub->add_option("--idle-exit-s", options->idle_exit_s, "stop after so long without a client (0: never)");
  sub->add_option("--clamp-um", options->clamp_um, "largest correction")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--slew-um-s", options->slew_um_s, "fastest change")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--dead-band-um", options->dead_band_um, "smaller changes are not followed")
      ->check(between(0.0, kLargestOption))
      ->capture_default_str();
  sub->callback([options, &exit] { exit = serve(*options); });
}

}  // namespace trunnion::app
