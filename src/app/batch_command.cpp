#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <memory>
#include <set>
#include <spdlog/spdlog.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/post/batch.hpp"
#include "trunnion/report/batch_json.hpp"

#include "app/failed_checks.hpp"
#include "app/from_options.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

struct BatchCommand {
  std::vector<std::string> inputs;
  std::string folder;
  MachineOptions machine;
  PostCliOptions options;
  FromOptions from;
  ResultOptions result;
  std::size_t threads = 0;
  std::string shard;
  bool dry_run = false;
  bool force = false;
};

std::atomic<bool> g_stop{false};  // set by SIGINT and SIGTERM: what has not begun is not run

// The first signal lets the files that have begun end; a second one ends the program as without a handler.
void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;
};

std::optional<Shard> shard_of(const std::string& text) {
  const auto slash = text.find('/');
  const auto index = parse_integer(text.substr(0, slash));
  const auto count = slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
  if (!index || !count || *index < 1 || *index > *count) return std::nullopt;
  return Shard{static_cast<std::size_t>(*index), static_cast<std::size_t>(*count)};
}

CLI::Validator shard_words() {
  return CLI::Validator(
      [](const std::string& text) {
        return shard_of(text) ? std::string() : "takes i/n with 1 <= i <= n, not '" + text + "'";
      },
      "i/n");
}

// Everything but the CL files that is read.
std::vector<std::string> shared_files(const BatchCommand& command, const MachineFiles& files,
                                      const std::optional<Model>& model,
                                      const std::optional<MachineFiles>& from) {
  std::vector<std::string> out = {files.machine.file, files.controller.file};
  out.insert(out.end(), files.controller.bases.begin(), files.controller.bases.end());
  if (!command.options.model.empty()) out.push_back(command.options.model);
  if (model) {
    const auto tables = table_files(*model);
    out.insert(out.end(), tables.begin(), tables.end());
  }
  if (!command.options.tools.tools.empty()) out.push_back(command.options.tools.tools);
  if (from) {
    out.insert(out.end(), {from->machine.file, from->controller.file});
    out.insert(out.end(), from->controller.bases.begin(), from->controller.bases.end());
  }
  return out;
}

// This very program: what another build of the same version made may be what it was built again for.
std::string program_mark() {
  const auto program = read_file("/proc/self/exe");
  return std::string("trunnion ") + TRUNNION_VERSION + (program ? " " + post::content_hash(*program) : "");
}

// Everything but the CL file that decides about an output.
Result<std::string> fingerprint(const BatchCommand& command, const std::vector<std::string>& shared) {
  std::string out = program_mark() + "\n" + command.options.text() + command.from.text();
  for (const std::string& file : shared) {
    std::error_code ec;
    if (!std::filesystem::is_regular_file(file, ec)) {
      return fail(ErrorCode::wrong_use, "a batch looks for changes in this file: it cannot be a pipe", file);
    }
    const auto text = read_file(file);
    if (!text) return tl::unexpected(text.error());
    out += *text + "\n";
  }
  return out;
}

// No output over a file that the batch reads, no result over one that it reads or writes.
Result<void> keep_apart(const BatchCommand& command, const std::vector<post::BatchItem>& items,
                        const std::vector<std::string>& shared) {
  std::vector<std::string> taken = shared;
  taken.insert(taken.end(), command.inputs.begin(), command.inputs.end());
  std::set<std::string> read;
  for (const std::string& file : taken) read.insert(resolved_path(file));
  for (const post::BatchItem& item : items) {
    if (read.contains(resolved_path(item.output))) {
      return fail(ErrorCode::wrong_input,
                  "its program would overwrite " + item.output + ", which this command reads", item.input);
    }
    taken.push_back(item.input);
    taken.push_back(item.output);
  }
  return command.result.apart_from(taken);
}

Result<void> check_use(const BatchCommand& command) {
  const PostCliOptions& o = command.options;
  if (!o.offsets.empty() || !o.thermal_model.empty() || !o.temperatures.empty()) {
    return fail(ErrorCode::wrong_use,
                "thermal offsets and temperatures belong to one run of one program: use post");
  }
  if (command.folder.empty() || command.folder == "-")
    return fail(ErrorCode::wrong_use, "-o names the folder of the NC files, not '" + command.folder + "'");
  return {};
}

Result<void> make_folder(const std::string& folder) {
  std::error_code ec;
  std::filesystem::create_directories(folder, ec);
  if (ec) return fail(ErrorCode::io_failed, "cannot make the folder: " + ec.message(), folder);
  return {};
}

std::vector<std::string> header_lines(const BatchCommand& command, const MachineFiles& files,
                                      const Model* model) {
  return {std::string("trunnion ") + TRUNNION_VERSION + ", controller " + files.controller.name,
          "machine " + files.machine.name, command.options.errors_line(model != nullptr),
          command.options.tolerance_line()};
}

// What was found in a file, and why it failed.
void print_findings(const post::BatchResult& r) {
  std::error_code ec;
  if (r.state == post::BatchState::failed && !r.outcome.written &&
      std::filesystem::is_regular_file(r.item.output, ec)) {
    spdlog::warn("{}: warning: the program of an earlier run is still there", r.item.output);
  }
  if (r.outcome.error) {
    print_failure(r.outcome.diagnostics, *r.outcome.error);
    return;
  }
  print(r.outcome.diagnostics);
  if (r.outcome.passed || !r.outcome.report || !r.outcome.report->verification) return;
  for (const std::string& reason : failed_checks(*r.outcome.report->verification, r.item.input))
    spdlog::error("{}: error: {}", r.item.input, reason);
  if (r.outcome.written)
    spdlog::warn("{}: warning: written although the check failed, marked NOT WITHIN TOLERANCE",
                 r.item.output);
}

std::vector<post::BatchResult> post_all(const std::vector<post::BatchItem>& items, const post::PostJob& job,
                                        const post::BatchOptions& options) {
  g_stop = false;
  stop_on_signals();
  ProgressLine progress(items.size(), "files");
  return post::run_batch(
      items, job, options, [&](const post::BatchResult&) { progress.step(); }, g_stop);
}

ExitCode finish(const BatchCommand& command, const std::vector<post::BatchResult>& results) {
  for (const post::BatchResult& r : results) print_findings(r);
  Diagnostics of_all;
  post::warn_of_equal_numbers(results, of_all);
  print(of_all);
  spdlog::info("{}", report::batch_table(results));
  const std::string how = command.options.no_verify ? ", not verified (--no-verify)" : "";
  if (!how.empty()) spdlog::warn("warning: not verified");
  if (const auto code = command.result.write(
          report::batch_json(results),
          {"Batch into " + command.folder, report::batch_summary(results) + how + ".", {}, {}},
          report::batch_page, "");
      code != kDone)
    return code;
  const report::BatchCounts counts = report::count(results);
  if (counts.failed == 0) return counts.not_run > 0 ? kCheckFailed : kDone;
  ExitCode worst = kCheckFailed;
  for (const post::BatchResult& r : results)
    if (r.state == post::BatchState::failed && r.outcome.error)
      worst = std::max(worst, exit_code(r.outcome.error->code));
  return worst;
}

ExitCode run(const BatchCommand& command) {
  if (const auto use = check_use(command); !use) return print_error(use.error());
  auto options = command.options.resolve();
  if (!options) return print_error(options.error());
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics, command.options.rtcp);
  if (!files) return print_failure(diagnostics, files.error());
  if (const auto checked = post::check_options(*options, files->machine, files->controller); !checked)
    return print_error(checked.error());
  const auto from = command.from.load(command.machine, diagnostics);
  if (!from) return print_failure(diagnostics, from.error());
  const auto model = command.options.load_errors(files->machine, diagnostics);
  if (!model) return print_failure(diagnostics, model.error());
  const auto tools = command.options.tools.load(diagnostics);
  if (!tools) return print_failure(diagnostics, tools.error());
  options->tools = command.options.tools.resolve(*tools);
  auto items = post::batch_items(command.inputs, command.folder, diagnostics, command.from.is_asked());
  if (!items) return print_failure(diagnostics, items.error());
  const auto shared = shared_files(command, *files, *model, *from);
  if (const auto apart = keep_apart(command, *items, shared); !apart) return print_error(apart.error());
  const auto mark = fingerprint(command, shared);
  if (!mark) return print_error(mark.error());
  print(diagnostics);
  if (const auto part = shard_of(command.shard)) items = post::shard(*items, part->index, part->count);
  if (const auto folder = command.dry_run ? Result<void>() : make_folder(command.folder); !folder)
    return print_error(folder.error());
  post::BatchOptions batch;
  batch.post = *options;
  batch.accept_deviation = command.options.accept_deviation;
  batch.dry_run = command.dry_run;
  batch.force = command.force;
  batch.threads = command.threads;
  batch.fingerprint = *mark;
  post::PostJob job;
  job.machine = &files->machine;
  job.controller = &files->controller;
  job.model = *model ? &**model : nullptr;
  job.header = header_lines(command, *files, job.model);
  post::NcOrigin origin;
  if (*from) {
    origin = command.from.resolve(**from);
    job.from = &origin;
  }
  return finish(command, post_all(*items, job, batch));
}

}  // namespace

void add_batch_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<BatchCommand>();
  CLI::App* c = root.add_subcommand(
      "batch", "post many CL files (and NC programs: --from); unchanged ones are skipped");
  c->add_option(
       "inputs", command->inputs,
       "CL files, folders with CL files, with --from NC programs, too, known by their ending (.nc .ngc "
       ".tap .mpf .h ...), manifests (.toml: [[part]] file = \"...\" and, to name it, "
       "output = \"...\")")
      ->required();
  c->add_option("-o,--output", command->folder, "folder for the NC files")->required();
  command->machine.add_to(*c, true);
  c->add_option("-j,--threads", command->threads,
                "number of files posted at the same time (default: the number of cores)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{256}));
  c->add_option("--shard", command->shard, "only every n-th file, beginning with the i-th (array jobs)")
      ->check(shard_words());
  c->add_flag("--dry-run", command->dry_run, "say what would be posted");
  c->add_flag("--force", command->force, "post unchanged files too");
  command->from.add_to(*c);
  command->options.add_to(*c);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
