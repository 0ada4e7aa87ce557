#pragma once
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <spdlog/spdlog.h>
#include <stop_token>
#include <string>
#include <sys/ioctl.h>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "app/input_share.hpp"

namespace trunnion::app {

/// Columns of the terminal at standard error; 80 where it does not say.
inline std::size_t terminal_width() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

/// One line on standard error that is written over as work goes on: only on a terminal, and not with
/// `--quiet`. Safe from several threads.
class ProgressLine {
 public:
  ProgressLine(std::size_t total, std::string unit)
      : total_(total),
        unit_(std::move(unit)),
        on_(::isatty(STDERR_FILENO) == 1 && spdlog::should_log(spdlog::level::info)) {}
  ~ProgressLine() {
    if (on_) std::fputs("\r\x1b[K", stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void step() {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (!on_) return;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const double rate = static_cast<double>(done_) / std::max(seconds, 1e-3);
    const double left = static_cast<double>(total_ - done_) / rate;
    constexpr std::size_t kWidth = 30;
    const std::size_t full = kWidth * done_ / total_;
    const std::string bar = "[" + std::string(full, '#') + std::string(kWidth - full, '.') + "] ";
    const std::string figures =
        fmt::format("{}/{}  {:.1f} {}/s  {:.0f} s left", done_, total_, rate, unit_, left);
    // A line that does not fit cannot be written over.
    const std::size_t room = terminal_width() - 1;
    const std::string line = bar.size() + figures.size() <= room ? bar + figures : figures.substr(0, room);
    std::fprintf(stderr, "\r%s\x1b[K", line.c_str());
  }

 private:
  std::mutex mutex_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::string unit_;
  bool on_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The same for the work on one file: how much of it was read (a mark that runs to and fro where that is not
/// known) and the seconds so far, from half a second on. Nothing else may write to standard error while it
/// lives.
class Activity {
 public:
  explicit Activity(std::string what, std::string file = {}) {
    if (::isatty(STDERR_FILENO) != 1 || !spdlog::should_log(spdlog::level::info)) return;
    try {
      thread_ = std::jthread([what = std::move(what), file = std::move(file)](const std::stop_token& stop) {
        show(what, file, stop);
      });
    } catch (const std::system_error&) {  // no thread to be had: nothing is shown
    }
  }

 private:
  static void show(const std::string& what, const std::string& file, const std::stop_token& stop) {
    constexpr std::chrono::milliseconds kStep(100);
    constexpr int kWidth = 30;
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    bool shown = false;
    for (int step = 1; !wake.wait_for(lock, stop, kStep, [&] { return stop.stop_requested(); }); ++step) {
      if (step < 5) continue;
      const int at = step % (2 * kWidth - 2) < kWidth ? step % (2 * kWidth - 2)
                                                      : 2 * kWidth - 2 - step % (2 * kWidth - 2);
      std::string bar(kWidth, '.');
      std::string percent;
      if (const auto share = share_read(file)) {
        std::fill_n(bar.begin(), static_cast<int>(kWidth * *share), '#');
        percent = fmt::format(" {:.0f} %,", 100.0 * *share);
      } else {
        bar[static_cast<std::size_t>(at)] = '#';
      }
      std::fprintf(stderr, "\r[%s] %s,%s %d s\x1b[K", bar.c_str(), what.c_str(), percent.c_str(), step / 10);
      shown = true;
    }
    if (shown) std::fputs("\r\x1b[K", stderr);
  }
  std::jthread thread_;
};

/// How a filter program tells the control that called it how far it is: lines `FILTER_PROGRESS=42` on
/// standard error, the share of `file` that was read.
class FilterProgress {
 public:
  explicit FilterProgress(std::string file) {
    tell(0);
    try {
      thread_ = std::jthread([file = std::move(file)](const std::stop_token& stop) { watch(file, stop); });
    } catch (const std::system_error&) {  // no thread to be had: nothing is told
    }
  }

 private:
  static void tell(int percent) { std::fprintf(stderr, "FILTER_PROGRESS=%d\n", percent); }
  static void watch(const std::string& file, const std::stop_token& stop) {
    constexpr std::chrono::milliseconds kStep(100);
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    int told = 0;
    while (!wake.wait_for(lock, stop, kStep, [&] { return stop.stop_requested(); })) {
      const auto share = share_read(file);
      const int percent = share ? static_cast<int>(100.0 * *share) : told;
      if (percent > told) tell(told = percent);
    }
    if (told < 100) tell(100);
  }
  std::jthread thread_;
};

}  // namespace trunnion::app
