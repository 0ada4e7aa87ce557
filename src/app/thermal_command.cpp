#include <memory>
#include <optional>
#include <spdlog/spdlog.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/thermal_report.hpp"
#include "trunnion/thermal/import_log.hpp"
#include "trunnion/thermal/location.hpp"

#include "app/progress.hpp"
#include "app/results.hpp"
#include "app/support.hpp"
#include "app/thermal_serve.hpp"
#include "app/thermal_warnings.hpp"

namespace trunnion::app {
namespace {

using namespace thermal;

struct ThermalOptions {
  std::vector<std::string> logs;
  std::vector<std::string> targets;
  std::optional<double> measure_every_min;  // predict: as the model was validated
  double window_h = 3.0;
  std::string method = "auto";
  std::optional<std::string> output;
  ResultOptions result;
  std::vector<std::string> axes;  // channel=dx
  std::vector<std::string> keep;  // sensors whatever their readings are
  std::string model;
  std::string run;
  bool open_loop = false;
  std::string mapping = "chain";
};

double every_s(const ThermalOptions& options) {
  constexpr double kBlade_min = 30.0;
  return options.measure_every_min.value_or(kBlade_min) * kSecondsPerMinute;
}

struct Prepared {
  Log log;
  std::vector<SensorFault> faults;
};

// Logs for a fit: without the sensors that no model must lean on.
Result<Prepared> prepare_for_fit(const ThermalOptions& options, Diagnostics& diagnostics) {
  Prepared out;
  auto log = load_conditioned_logs(options.logs, diagnostics, out.faults);
  if (!log) return tl::unexpected(log.error());
  out.log = std::move(*log);
  for (const std::string& name : options.keep) {
    if (name != "all" && !out.log.sensor(name))
      return fail(ErrorCode::wrong_use, "--keep-sensors: the log has no sensor '" + name + "'", out.log.file);
  }
  auto usable = usable_for_fit(out.log, out.faults, options.keep, diagnostics);
  if (!usable) return tl::unexpected(usable.error());
  out.log = std::move(*usable);
  return out;
}

ExitCode run_screen(const ThermalOptions& options) {
  Diagnostics diagnostics;
  const auto prepared = prepare_for_fit(options, diagnostics);
  if (!prepared) return print_failure(diagnostics, prepared.error());
  print(diagnostics);
  const auto screens = [&] {
    const Activity activity("screening");
    return screen(prepared->log, options.targets, every_s(options));
  }();
  if (!screens) return print_error(screens.error());
  return options.result.write(report::thermal_screen_json(*screens, prepared->faults),
                              {"Which sensors follow the error: " + options.logs.front(), {}, {}, {}},
                              report::thermal_screen_page, report::thermal_screen_text(*screens));
}

Result<void> set_axes(const std::vector<std::string>& axes, ThermalModel& model) {
  for (const std::string& word : axes) {
    const auto equals = word.find('=');
    const std::string channel = word.substr(0, equals);
    const std::string axis = equals == std::string::npos ? "" : word.substr(equals + 1);
    const auto it = std::find_if(model.channels.begin(), model.channels.end(),
                                 [&](const ChannelModel& c) { return c.channel == channel; });
    if (it == model.channels.end())
      return fail(ErrorCode::wrong_use,
                  "--axes takes CHANNEL=dx, dy, dz or none of a target, not '" + word + "'");
    it->axis = axis;
    if (axis != "none" && !offset_component(*it))
      return fail(ErrorCode::wrong_use,
                  "--axes takes CHANNEL=dx, dy, dz or none of a target, not '" + word + "'");
  }
  return {};
}

// Before the fit, which takes a while: a model that is written says which offset each channel gives.
Result<void> check_said_axes(const ThermalOptions& options, const Log& log) {
  ThermalModel model;
  for (const std::string& target : options.targets.empty() ? log.channels : options.targets)
    model.channels.push_back({.channel = target, .axis = axis_of_name(target)});
  if (auto set = set_axes(options.axes, model); !set) return set;
  return options.output ? check_axes(model, log.file) : Result<void>{};
}

ExitCode run_fit(const ThermalOptions& options) {
  Diagnostics diagnostics;
  const auto prepared = prepare_for_fit(options, diagnostics);
  if (!prepared) return print_failure(diagnostics, prepared.error());
  if (const auto said = check_said_axes(options, prepared->log); !said)
    return print_failure(diagnostics, said.error());
  thermal::FitOptions fit;
  fit.targets = options.targets;
  fit.measure_every_s = every_s(options);
  fit.window_s = options.window_h * kSecondsPerMinute * kSecondsPerMinute;
  fit.name = prepared->log.file;
  if (options.method != "auto") fit.method = method_of_name(options.method);
  std::optional<ProgressLine> progress;
  fit.progress = [&progress](std::size_t total) {
    if (!progress) progress.emplace(total, "fits");
    progress->step();
  };
  auto result = fit_thermal(prepared->log, fit, diagnostics);
  progress.reset();
  if (!result) return print_failure(diagnostics, result.error());
  print(diagnostics);
  result->model.files = options.logs;
  if (const auto set = set_axes(options.axes, result->model); !set) return print_error(set.error());
  if (options.output) {
    if (const ExitCode code = write_output(*options.output, model_text(result->model)); code != kDone)
      return code;
  }
  const std::string json = report::thermal_fit_json(*result, fit, prepared->faults);
  // A model on standard output stands there alone.
  return options.result.write(
      json, [&] { return report::thermal_fit_page(*result, prepared->log, json, made_by()); },
      options.output == "-" ? "" : report::thermal_fit_text(*result, fit));
}

ExitCode run_predict(const ThermalOptions& options) {
  Diagnostics diagnostics;
  auto model = load_model(options.model, diagnostics);
  if (!model) return print_failure(diagnostics, model.error());
  if (const auto said = check_axes(*model, options.model); !said) return print_error(said.error());
  if (options.measure_every_min) model->measure_every_s = *options.measure_every_min * kSecondsPerMinute;
  std::vector<SensorFault> faults;
  auto log = load_conditioned_logs(options.logs, diagnostics, faults);
  if (!log) return print_failure(diagnostics, log.error());
  *log = without_stuck(*model, *log, faults);
  std::vector<RunPrediction> runs;
  for (std::size_t i = 0; i < log->runs.size(); ++i) {
    if (!options.run.empty() && log->runs[i].id != options.run) continue;
    auto run = predict(*model, *log, i, options.open_loop ? UseMeasurements::no : UseMeasurements::yes);
    if (!run) return print_failure(diagnostics, run.error());
    warn_of_prediction(*model, *log, log->runs[i], *run, diagnostics);
    runs.push_back(std::move(*run));
  }
  print(diagnostics);
  if (runs.empty())
    return print_error({ErrorCode::wrong_input, "the log has no run '" + options.run + "'", log->file, {}});
  const bool paper = options.mapping == "paper";
  if (paper) spdlog::warn("warning: --mapping paper: {}", paper_mapping_warning);
  const std::string text =
      paper ? paper_angles_text(*model, runs, {std::string(" ") + paper_mapping_warning})
            : prediction_text(
                  *model, runs,
                  {" deviation of the tool relative to the part, machine axes; model " + options.model});
  if (const ExitCode code = write_output(options.output.value_or("-"), text); code != kDone) return code;
  const std::string json = report::thermal_predict_json(*model, runs);
  return options.result.write(
      json, [&] { return report::thermal_prediction_page(*model, *log, runs, json, made_by()); });
}

struct ImportWords {
  std::string file;
  std::string output = "-";
  ImportOptions options;
  ResultOptions result;
};

ExitCode run_import(const ImportWords& words) {
  Diagnostics diagnostics;
  const auto text = read_file(words.file);
  if (!text) return print_error(text.error());
  const auto log = import_log(*text, words.file, words.options, diagnostics);
  if (!log) return print_failure(diagnostics, log.error());
  print(diagnostics);
  spdlog::info("{} runs, {} sensors, {} channels", log->runs.size(), log->sensors.size(),
               log->channels.size());
  if (const auto code = write_output(words.output, log_text(*log, {" imported from " + words.file}));
      code != kDone)
    return code;
  const report::ResultText said{"Log " + words.file, "Imported into " + words.output + ".",
                                report::thermal_log_json(*log), made_by()};
  return words.result.write(
      said.json, [&] { return report::log_page(said, *log); }, "");
}

void add_import(CLI::App& command, int& exit) {
  auto words = std::make_shared<ImportWords>();
  CLI::App* sub = command.add_subcommand(
      "import",
      "another program's log into a temperature log; names of sensors end in _C, of channels in _um");
  sub->add_option("file", words->file, "log to read: a table of numbers with a header")->required();
  sub->add_option("-o,--output", words->output, "log to write (- is standard output)")->default_str("-");
  sub->add_option(
      "--time", words->options.time_column,
      "column of the time, numbers or dates (default: time_s, time, timestamp, datetime, date or zeit)");
  sub->add_option("--step-s", words->options.step_s, "time between rows, for a file without time")
      ->check(CLI::PositiveNumber);
  sub->add_option("--sensor", words->options.sensors,
                  "columns of temperatures in degC, as shell patterns: 'PT*'")
      ->delimiter(',');
  sub->add_option("--delimiter", words->options.delimiter,
                  "character between fields (default: tab, ; | or comma, as in the header)");
  sub->add_option("--skip-lines", words->options.skip_lines, "lines before the header");
  sub->add_flag("--part", words->options.part, "accept a file with only temperatures or only displacements");
  sub->add_option("--seconds-per-count", words->options.seconds_per_count,
                  "seconds per count of the column of --time (default: the unit in its name, as in time_ms; "
                  "else seconds)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--run", words->options.run_column, "column whose value names the run");
  sub->add_option("--speed", words->options.speed_column, "column of the spindle speed")
      ->capture_default_str();
  sub->add_flag("--run-starts-with-spindle", words->options.run_starts_with_spindle,
                "a run begins whenever the speed rises from zero");
  sub->add_option("--channel", words->options.channels, "columns of displacements, as shell patterns")
      ->delimiter(',');
  sub->add_option("--um-per-count", words->options.um_per_count,
                  "um per count of the --channel columns whose names end in neither _um nor _mm")
      ->check(CLI::PositiveNumber);
  words->result.add_to(*sub);
  sub->callback([words, &exit] { exit = run_import(*words); });
}

void add_log_options(CLI::App& sub, ThermalOptions& options) {
  sub.add_option("log", options.logs, "temperature logs; the same run_id in several files is joined")
      ->required();
  sub.add_option("--target", options.targets, "measured channels, without _um (default: all)")
      ->delimiter(',');
  sub.add_option("--measure-every-min", options.measure_every_min,
                 "interval of the measurements within a run (default: 30)")
      ->check(CLI::PositiveNumber);
  sub.add_option("--keep-sensors", options.keep,
                 "sensors that are never rejected as faulty: their names, or all")
      ->delimiter(',');
  options.result.add_to(sub);
}

}  // namespace

void add_thermal_command(CLI::App& root, int& exit) {
  CLI::App* command = root.add_subcommand("thermal", "thermal errors: from temperature logs to offsets");
  command->require_subcommand(1);

  auto screening = std::make_shared<ThermalOptions>();
  CLI::App* sub = command->add_subcommand(
      "screen",
      "which sensors matter: by p values, as in the thermal paper, and by the error on runs left out");
  add_log_options(*sub, *screening);
  sub->callback([screening, &exit] { exit = run_screen(*screening); });

  auto fitting = std::make_shared<ThermalOptions>();
  sub = command->add_subcommand("fit",
                                "fit a model, and compare its error on runs left out with no correction and "
                                "with the last measured value");
  add_log_options(*sub, *fitting);
  sub->add_option(
         "--method", fitting->method,
         "ols: temperatures with p < 0.05; rises, ridge: temperature rises, without and with their lags; "
         "svr, svr_all: support vectors on the temperatures with p < 0.05, on all; lag: lags of spindle "
         "speed and feed; combined: ridge and lag together; gp: Gaussian process on the inputs of both; "
         "mean: of ridge, combined and gp; auto: the one with the least error on runs left out")
      ->check(
          CLI::IsMember({"auto", "ols", "rises", "ridge", "svr", "svr_all", "gp", "lag", "combined", "mean"}))
      ->capture_default_str();
  sub->add_option("--window-h", fitting->window_h, "first hours of a run, reported separately")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_option("--axes", fitting->axes,
                  "which offset a channel gives: ch3=dy,ch5=dz,ch1=none (not needed for channels named x, y, "
                  "z, dx, dy, dz)")
      ->delimiter(',');
  sub->add_option("-o,--output", fitting->output, "thermal model to write");
  sub->callback([fitting, &exit] { exit = run_fit(*fitting); });

  auto predicting = std::make_shared<ThermalOptions>();
  sub = command->add_subcommand("predict", "offsets over time, with sigma");
  sub->add_option("model", predicting->model, "thermal model")->required();
  sub->add_option("log", predicting->logs, "temperature logs")->required();
  sub->add_option("-o,--output", predicting->output, "offsets to write (- is standard output)")
      ->default_str("-");
  sub->add_option("--run", predicting->run, "predict only this run of the log");
  sub->add_option("--measure-every-min", predicting->measure_every_min,
                  "interval at which measurements of the log are used (default: that of the validation)")
      ->check(CLI::PositiveNumber);
  sub->add_flag("--open-loop", predicting->open_loop, "do not use the measurements of the log");
  sub->add_option(
         "--mapping", predicting->mapping,
         "offsets as X, Y, Z of the chain, or the thermal paper's table angles (no physical ground: for "
         "comparison only, post does not take them)")
      ->check(CLI::IsMember({"chain", "paper"}))
      ->capture_default_str();
  predicting->result.add_to(*sub);
  sub->callback([predicting, &exit] { exit = run_predict(*predicting); });

  add_import(*command, exit);
  add_thermal_split_command(*command, exit);
  add_thermal_serve_command(*command, exit);
  add_thermal_sample_commands(*command, exit);
}

}  // namespace trunnion::app
