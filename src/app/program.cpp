#include "app/program.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sstream>
#include <string_view>
#include <unistd.h>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/failure.hpp"
#include "trunnion/base/printable.hpp"

#include "app/file_roles.hpp"
#include "app/options.hpp"
#include "app/options_without_effect.hpp"
#include "app/support.hpp"
#include "app/wrong_use.hpp"

namespace trunnion::app {
namespace {

// No name or text of an input acts on the terminal; the first "error:" or "warning:" is coloured where
// colours are wanted.
class PrintableText final : public spdlog::custom_flag_formatter {
 public:
  explicit PrintableText(bool colored) : colored_(colored) {}
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    std::string text = printable({message.payload.data(), message.payload.size()}, "\n\t");
    if (colored_ && message.level >= spdlog::level::warn) {
      const bool is_error = message.level >= spdlog::level::err;
      const std::string word = is_error ? "error:" : "warning:";
      if (const auto at = text.find(word); at != std::string::npos)
        text.replace(at, word.size(), (is_error ? "\x1b[1;31m" : "\x1b[1;33m") + word + "\x1b[0m");
    }
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableText>(colored_);
  }

 private:
  bool colored_;
};

// `auto`: on a terminal, unless the environment's NO_COLOR (no-color.org) holds anything.
bool wants_color(const std::string& color) {
  if (color != "auto") return color == "always";
  const char* no_color = std::getenv("NO_COLOR");  // NOLINT(concurrency-mt-unsafe)
  const char* terminal = std::getenv("TERM");      // NOLINT(concurrency-mt-unsafe)
  return ::isatty(STDERR_FILENO) == 1 && (no_color == nullptr || *no_color == '\0') && terminal != nullptr &&
         std::string_view(terminal) != "dumb";
}

// Messages and progress go to standard error; standard output is for results.
void set_up_log(bool quiet, bool verbose, bool colored) {
  auto logger = spdlog::stderr_logger_st("trunnion");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableText>('*', colored).set_pattern("%*");
  logger->set_formatter(std::move(formatter));
  logger->set_level(quiet ? spdlog::level::err : verbose ? spdlog::level::debug : spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

// The version, and what somebody must know who looks into a report of a fault.
std::string version_text() {
  const bool four = __builtin_cpu_supports("avx2") != 0;
  return std::string("trunnion ") + TRUNNION_VERSION + "\nbuilt by " + TRUNNION_BUILD +
         "\nmachines and controllers in " + postconfigs_folder() + "\nHTML pages with " + TRUNNION_PAGES +
         "\nthis processor calculates with " + (four ? "four numbers" : "two numbers") + " at a time";
}

struct Command {
  std::string_view name;
  void (*add)(CLI::App& root, int& exit);
};

// Each command stands in its own file; the order here is the order of the help.
constexpr std::array<Command, 14> kCommands = {{{"post", add_post_command},
                                                {"batch", add_batch_command},
                                                {"verify", add_verify_command},
                                                {"compare", add_compare_command},
                                                {"machine", add_machine_command},
                                                {"iso230", add_iso230_command},
                                                {"model", add_model_command},
                                                {"simulate", add_simulate_command},
                                                {"measurements", add_measurements_command},
                                                {"probe", add_probe_command},
                                                {"thermal", add_thermal_command},
                                                {"table", add_table_command},
                                                {"study", add_study_command},
                                                {"texts", add_texts_command}}};

// Where there is no doubt which command is called it is set up alone: all of them take as long as a small
// file.
void register_commands(CLI::App& root, int& exit, int argc, char** argv) {
  const auto called =
      std::find_if(argv + 1, argv + argc, [](std::string_view word) { return !word.starts_with('-'); });
  const auto command = called == argv + argc
                           ? kCommands.end()
                           : std::find_if(kCommands.begin(), kCommands.end(),
                                          [&](const Command& c) { return c.name == *called; });
  // The texts are those of all commands.
  if (command != kCommands.end() && command->name != "texts") return command->add(root, exit);
  for (const Command& c : kCommands) c.add(root, exit);
}

int run(int argc, char** argv) {
  CLI::App root{"Five-axis post-processor for dual-turntable machines.", "trunnion"};
  root.set_version_flag("--version", version_text);
  root.require_subcommand(1);
  root.fallthrough();
  root.failure_message(wrong_use_text);
  bool quiet = false;
  bool verbose = false;
  root.add_flag("-q,--quiet", quiet, "errors only");
  root.add_flag("-v,--verbose", verbose, "more detail");
  std::string color = "auto";
  root.add_option("--color", color, "colour of messages: on a terminal, unless NO_COLOR is set (auto)")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->capture_default_str();
  root.parse_complete_callback([&] {
    set_up_log(quiet, verbose, wants_color(color));
    check_options_together(root);
    warn_of_options_without_effect(root);
  });
  int exit = kDone;
  register_commands(root, exit, argc, argv);
  try {
    root.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    std::ostringstream out, messages;
    const int code = root.exit(e, out, messages);
    std::fputs(messages.str().c_str(), stderr);
    if (code != 0) return kWrongUse;
    // Help is asked for before the log is set up.
    if (spdlog::get("trunnion") == nullptr) set_up_log(quiet, verbose, wants_color(color));
    return write_output("-", out.str());
  }
  return exit;
}

// Says what an exception means that nobody nearer could answer.
int exit_code_of(const std::exception& exception) {
  if (const auto error = error_of(exception)) {
    std::fprintf(stderr, "%s\n", error->text().c_str());
    return exit_code(error->code);
  }
  std::fprintf(stderr,
               "trunnion: defect of the program: %s\nPlease report it with the command and the files.\n",
               exception.what());
  return kDefect;
}

// A second thread, or the library that runs it, can go no further: the system gave it no memory or no thread.
// Files that are not complete have no name yet.
[[noreturn]] void end_of_a_thread() {
  try {
    if (const auto current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::exception& e) {
    std::_Exit(exit_code_of(e));
  } catch (...) {
  }
  std::fprintf(stderr, "trunnion: defect of the program: ended without a reason\n");
  std::_Exit(kDefect);
}

}  // namespace

int run_program(int argc, char** argv) {
  // A closed pipe, a file beyond the limit of the shell: failed writes with a message, exit code 4.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  remember_command_line(argc, argv);
  std::set_terminate(end_of_a_thread);
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    return exit_code_of(e);
  }
}

}  // namespace trunnion::app
