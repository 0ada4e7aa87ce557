#include <atomic>
#include <csignal>
#include <memory>
#include <spdlog/spdlog.h>
#include <thread>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/post/batch.hpp"
#include "trunnion/report/batch_json.hpp"

#include "app/options.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

struct BatchCommand {
  std::vector<std::string> inputs;
  std::string folder;
  MachineOptions machine;
  PostCliOptions options;
  ResultOptions result;
  std::size_t threads = 0;
  std::string shard;
  bool dry_run = false;
  bool force = false;
};

std::atomic<bool> g_stop{false};  // set by SIGINT and SIGTERM: what has not begun is not run

Result<std::vector<post::BatchItem>> take_shard(const BatchCommand& command,
                                                std::vector<post::BatchItem> items) {
  if (command.shard.empty()) return items;
  const auto slash = command.shard.find('/');
  const auto index = parse_integer(command.shard.substr(0, slash));
  const auto count =
      slash == std::string::npos ? std::nullopt : parse_integer(command.shard.substr(slash + 1));
  if (!index || !count || *index < 1 || *index > *count) {
    return fail(ErrorCode::wrong_use, "--shard takes i/n with 1 <= i <= n, not '" + command.shard + "'");
  }
  return post::shard(items, *index, *count);
}

// Everything but the CL file that decides about an output.
Result<std::string> fingerprint(const BatchCommand& command, const Machine& machine,
                                const nc::Controller& controller, const std::optional<Model>& model) {
  std::string out = std::string("trunnion ") + TRUNNION_VERSION + "\n" + command.options.text();
  std::vector<std::string> files = {machine.file, controller.file};
  files.insert(files.end(), controller.bases.begin(), controller.bases.end());
  if (model) {
    files.push_back(command.options.model);
    const auto tables = table_files(*model);
    files.insert(files.end(), tables.begin(), tables.end());
  }
  for (const std::string& file : files) {
    const auto text = read_file(file);
    if (!text) return tl::unexpected(text.error());
    out += *text + "\n";
  }
  return out;
}

// Findings and the reason of every failure, file by file.
void print_failures(const std::vector<post::BatchResult>& results) {
  for (const post::BatchResult& r : results) {
    if (r.state != post::BatchState::failed) continue;
    if (r.outcome.error) {
      print_failure(r.outcome.diagnostics, *r.outcome.error);
    } else if (r.outcome.report && r.outcome.report->verification) {
      const post::VerifyReport& v = *r.outcome.report->verification;
      spdlog::error(
          "{}: error: verification failed: tip {:.6f} of {} mm, {} CL points missed, {} positions beyond "
          "limits",
          r.item.input, v.certified_tip_deviation_mm, v.tolerance_mm, v.points_missed, v.beyond_limits_count);
    }
  }
}

ExitCode run(const BatchCommand& command) {
  const auto options = command.options.resolve();
  if (!options) return print_error(options.error());
  if (!command.options.offsets.empty() || !command.options.thermal_model.empty()) {
    return print_error(
        {ErrorCode::wrong_use, "thermal offsets belong to one run of one program: use post", {}, {}});
  }
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const auto& [machine, controller] = *files;
  const auto model = command.options.load_errors(machine, diagnostics);
  if (!model) return print_failure(diagnostics, model.error());
  auto all = post::batch_items(command.inputs, command.folder, diagnostics);
  if (!all) return print_failure(diagnostics, all.error());
  const auto items = take_shard(command, std::move(*all));
  if (!items) return print_error(items.error());
  const auto mark = fingerprint(command, machine, controller, *model);
  if (!mark) return print_error(mark.error());
  print(diagnostics);
  post::BatchOptions batch;
  batch.post = *options;
  batch.accept_deviation = command.options.accept_deviation;
  batch.dry_run = command.dry_run;
  batch.force = command.force;
  batch.threads = command.threads;
  batch.fingerprint = *mark;
  g_stop = false;
  std::signal(SIGINT, [](int) { g_stop = true; });
  std::signal(SIGTERM, [](int) { g_stop = true; });
  std::vector<post::BatchResult> results;
  {
    ProgressLine progress(items->size(), "files");
    const std::vector<std::string> header = {
        std::string("trunnion ") + TRUNNION_VERSION + ", controller " + controller.name,
        "machine " + machine.name};
    results = post::run_batch(
        *items, machine, controller, *model ? &**model : nullptr, header, batch,
        [&](const post::BatchResult&) { progress.step(); }, g_stop);
  }
  print_failures(results);
  const report::BatchCounts counts = report::count(results);
  spdlog::info("{}", report::batch_table(results));
  const std::string verdict = std::to_string(counts.posted) + " posted and verified, " +
                              std::to_string(counts.skipped) + " unchanged, " +
                              std::to_string(counts.failed) + " failed, " + std::to_string(counts.not_run) +
                              " not run.";
  if (const auto code =
          command.result.write(report::batch_json(results), "Batch into " + command.folder, verdict, "");
      code != kDone)
    return code;
  return counts.failed + counts.not_run > 0 ? kCheckFailed : kDone;
}

}  // namespace

void add_batch_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<BatchCommand>();
  CLI::App* c = root.add_subcommand("batch", "post many CL files; unchanged ones are skipped");
  c->add_option("inputs", command->inputs, "CL files, folders with CL files, manifests (.toml)")->required();
  c->add_option("-o,--output", command->folder, "folder for the NC files")->required();
  command->machine.add_to(*c, true);
  c->add_option("-j,--threads", command->threads, "files at a time (all cores)")->check(CLI::PositiveNumber);
  c->add_option("--shard", command->shard, "i/n: only every n-th file, beginning with the i-th (array jobs)");
  c->add_flag("--dry-run", command->dry_run, "say what would be posted");
  c->add_flag("--force", command->force, "post unchanged files too");
  command->options.add_to(*c);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
