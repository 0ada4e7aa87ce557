#include <memory>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/diagnosis/import.hpp"
#include "trunnion/diagnosis/measurement_template.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/trace/measurements.hpp"

#include "app/against_options.hpp"
#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/options.hpp"
#include "app/results.hpp"
#include "app/standard_plan_command.hpp"
#include "app/support.hpp"
#include "app/trace_plan.hpp"

namespace trunnion::app {
namespace {

struct MeasurementsOptions {
  std::string file, out, machine;
  diagnosis::MapImport map;
  diagnosis::LogImport log;
  diagnosis::StageImport stage;
  diagnosis::PointingImport pointing;
  ResultOptions result;
};

// A trace, and the program that ran.
struct TraceImport {
  std::string file, out;
  MachineOptions machine;
  std::string model_out;
  std::string columns, items;
  double period_s = 0.001;
  std::string program;
  AgainstOptions against;
  double tolerance_mm = 0.01;
  std::string smoothing = "off";
  trace::AsMeasurements how;
  ToolCliOptions tools;
  ResultOptions result;
};

ExitCode write_page(const ResultOptions& result, const report::ResultText& said, const std::string& csv,
                    const Machine* machine = nullptr) {
  return result.write(
      said.json, [&] { return report::measurements_page(said, csv, machine); }, "");
}

std::vector<std::string> listed_names(const std::string& list) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    out.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

// As measurements of the machine while it ran the program.
Result<trace::TraceMeasurements> measured(TraceImport& command, const trace::Trace& trace,
                                          const MachineFiles& files, Diagnostics& diagnostics) {
  const auto tools = command.tools.load(diagnostics);
  if (!tools) return tl::unexpected(tools.error());
  const auto smoothing = smoothing_of(command.smoothing);
  if (!smoothing) return tl::unexpected(smoothing.error());
  post::VerifyOptions options;
  options.tolerance_mm = command.tolerance_mm;
  options.axis_tolerance = files.machine.axis_tolerance;
  options.smoothing_mm = *smoothing;
  options.tools = command.tools.resolve(*tools);
  options.collect = true;
  if (const auto loaded = command.against.load(command.machine, diagnostics); !loaded)
    return tl::unexpected(loaded.error());
  auto path = command.against.open();
  if (!path) return tl::unexpected(path.error());
  auto program = cl::open_source(command.program);
  if (!program) return tl::unexpected(program.error());
  const auto report = post::verify(std::move(*path), {std::move(*program), command.program},
                                   {files.machine, files.controller, options}, diagnostics);
  if (!report) return tl::unexpected(report.error());
  const auto plan = plan_of({command.against, files, options, *report});
  if (!plan) return tl::unexpected(plan.error());
  return trace::measurements_of(trace, files.machine, *plan, command.how);
}

Result<trace::Trace> read_trace(const TraceImport& command, std::string_view text, const Machine& machine,
                                Diagnostics& diagnostics) {
  if (!command.columns.empty())
    return trace::parse_list(text, command.file, machine, {listed_names(command.columns), command.period_s},
                             diagnostics);
  if (command.items.empty()) return trace::parse_trace(text, command.file, machine, diagnostics);
  trace::ShdrImport how;
  for (const std::string& item : listed_names(command.items)) {
    const std::size_t at = item.find('=');
    if (at == std::string::npos || at == 0)
      return fail(ErrorCode::wrong_use, "--items are KEY=COLUMN with commas, not '" + item + "'");
    how.items.push_back({item.substr(0, at), item.substr(at + 1)});
  }
  return trace::parse_shdr(text, command.file, machine, how, diagnostics);
}

// Files to be written: the trace or its measurements; and a model to begin with, if that is asked for.
struct TraceFiles {
  std::string text, model;
};

// What a trace says beside its readings, as a model that effects are added to.
std::string first_model(const trace::TraceMeasurements& measured, const Machine& machine) {
  Model model;
  model.name = "trace";
  for (const Axis& axis : machine.axes) model.axes.push_back(axis.name);
  model.lag_of_all_axes_s = measured.lag_of_all_axes_s;
  return model_text(model);
}

void tell_lag(const TraceImport& command, const trace::TraceMeasurements& measured,
              Diagnostics& diagnostics) {
  if (measured.lag_of_all_axes_s == 0.0) return;
  const double ms = unit_factor(Unit::ms);
  diagnostics.note(command.file, {},
                   "all axes follow with a common delay of " +
                       fixed_text(measured.lag_of_all_axes_s / ms, 2) + " +/- " +
                       fixed_text(measured.sigma_s / ms, 2) +
                       " ms (corners and curves are cut inside); it is removed from the readings" +
                       (command.model_out.empty()
                            ? "; --model-out writes a model with it, so that `post --model` compensates it"
                            : ", and written to the model of --model-out"));
}

Result<TraceFiles> import_trace(TraceImport& command, Diagnostics& diagnostics) {
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return tl::unexpected(files.error());
  const auto text = read_file(command.file);
  if (!text) return tl::unexpected(text.error());
  const auto trace = read_trace(command, *text, files->machine, diagnostics);
  if (!trace) return tl::unexpected(trace.error());
  if (command.program.empty())
    return TraceFiles{trace::trace_text(*trace, files->machine, {"trace " + command.file}), ""};
  auto found = measured(command, *trace, *files, diagnostics);
  if (!found) return tl::unexpected(found.error());
  tell_lag(command, *found, diagnostics);
  return TraceFiles{std::move(found->text),
                    command.model_out.empty() ? "" : first_model(*found, files->machine)};
}

ExitCode run_trace(TraceImport& command) {
  if (command.program.empty() != command.against.file.empty())
    return print_error({ErrorCode::wrong_use, "--program and --against go together", "", {}});
  if (command.program.empty() && !command.model_out.empty())
    return print_error({ErrorCode::wrong_use, "--model-out needs --program and --against", "", {}});
  if (command.program == "-" || command.against.file == "-")
    return print_error({ErrorCode::wrong_use, "--program and --against are files, not -", "", {}});
  Diagnostics diagnostics;
  const auto imported = import_trace(command, diagnostics);
  if (!imported) return print_failure(diagnostics, imported.error());
  print(diagnostics);
  if (const auto code = write_output(command.out, imported->text); code != kDone) return code;
  if (!command.model_out.empty()) {
    if (const auto code = write_output(command.model_out, imported->model); code != kDone) return code;
  }
  return write_page(command.result,
                    {"Trace " + command.file, "Written to " + command.out + ".",
                     report::imported_json(command.file, imported->text), made_by()},
                    imported->text);
}

template <class Import>
int run(const MeasurementsOptions& options, const Import& import) {
  const auto text = read_file(options.file);
  if (!text) return print_error(text.error());
  Diagnostics diagnostics;
  const auto imported = import(*text, diagnostics);
  if (!imported) return print_failure(diagnostics, imported.error());
  print(diagnostics);
  if (const auto code = write_output(options.out, *imported); code != kDone) return code;
  return write_page(options.result,
                    {"Measurements of " + options.file, "In the measurement format: " + options.out + ".",
                     report::imported_json(options.file, *imported), made_by()},
                    *imported);
}

// Of a format whose directions follow from the machine.
template <class Import>
int run_on_machine(const MeasurementsOptions& options, const Import& import) {
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return exit;
  return run(options, [&](const std::string& text, Diagnostics& d) { return import(text, *machine, d); });
}

struct TemplateOptions {
  std::string kind, machine, out;
  ResultOptions result;
};

int run_template(const TemplateOptions& options) {
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return exit;
  const auto text = diagnosis::measurement_template(*machine, options.kind);
  if (!text) return print_error(text.error());
  if (const auto code = write_output(options.out, *text); code != kDone) return code;
  return write_page(
      options.result,
      {"A file to fill in: " + options.kind, "Poses of machine '" + machine->name + "': " + options.out + ".",
       report::imported_json(options.kind, *text), made_by()},
      *text, &*machine);
}

void add_template(CLI::App& measurements, int& exit) {
  auto* command = measurements.add_subcommand(
      "template", "measurement file with the poses of a campaign, for readings to be filled in");
  auto options = std::make_shared<TemplateOptions>();
  command->add_option("kind", options->kind, "laser, rtest, ballbar or probe")
      ->required()
      ->check(CLI::IsMember(diagnosis::template_kinds()));
  command
      ->add_option("-m,--machine", options->machine,
                   "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  command->add_option("-o,--output", options->out, "measurement file to write")->required();
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run_template(*options); });
}

void add_files(CLI::App& command, MeasurementsOptions& options) {
  command.add_option("file", options.file, "file to read")->required();
  command.add_option("-o,--output", options.out, "measurement file to write")->required();
  options.result.add_to(command);
}

void add_uncertainty(CLI::App& command, double& u_um) {
  command.add_option("--u-random-um", u_um, "standard uncertainty of one reading")
      ->check(above_zero())
      ->capture_default_str();
}

void add_parts(CLI::App& command, std::size_t& parts) {
  command
      .add_option("--parts", parts,
                  "number of runs that the readings are split into, so that runs can be left out in tests")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

void add_machine(CLI::App& command, MeasurementsOptions& options) {
  command
      .add_option("-m,--machine", options.machine, "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
}

void add_stage(CLI::App& import, const std::shared_ptr<MeasurementsOptions>& options, int& exit) {
  auto* command = import.add_subcommand(
      "stage", "two axes of a stage read by two lasers, as Aerotech's programs write it (.dat)");
  add_files(*command, *options);
  add_machine(*command, *options);
  command
      ->add_option("--axes", options->stage.axes,
                   "the file's first and second axis, as in X,Y (default: as the file names them)")
      ->delimiter(',')
      ->expected(2);
  add_uncertainty(*command, options->stage.u_random_um);
  add_parts(*command, options->stage.parts);
  command->callback([options, &exit] {
    exit = run_on_machine(*options, [&](const std::string& text, const Machine& machine, Diagnostics& d) {
      return diagnosis::import_stage(text, options->file, machine, options->stage, d);
    });
  });
}

void add_pointing(CLI::App& import, const std::shared_ptr<MeasurementsOptions>& options, int& exit) {
  auto* command = import.add_subcommand(
      "pointing",
      "stars that a mount in azimuth and altitude was pointed at, as TPOINT reads them (degrees)");
  add_files(*command, *options);
  add_machine(*command, *options);
  command->add_option("--azimuth", options->pointing.azimuth, "axis of the azimuth")->capture_default_str();
  command->add_option("--altitude", options->pointing.altitude, "axis whose position is 90 deg less altitude")
      ->capture_default_str();
  command
      ->add_option("--u-random-urad", options->pointing.u_random_urad, "standard uncertainty of one reading")
      ->check(above_zero())
      ->capture_default_str();
  add_parts(*command, options->pointing.parts);
  command->callback([options, &exit] {
    exit = run_on_machine(*options, [&](const std::string& text, const Machine& machine, Diagnostics& d) {
      return diagnosis::import_pointing(text, options->file, machine, options->pointing, d);
    });
  });
}

}  // namespace

void add_measurements_command(CLI::App& root, int& exit) {
  auto* measurements =
      root.add_subcommand("measurements", "measurement files: a form to fill in, other people's formats");
  measurements->require_subcommand(1);
  add_template(*measurements, exit);
  add_standard_plan_command(*measurements, exit);
  auto* import = measurements->add_subcommand("import", "read another format");
  import->require_subcommand(1);
  auto options = std::make_shared<MeasurementsOptions>();

  auto* map =
      import->add_subcommand("map", "two-dimensional map: x, y, error along X, error along Y (mm, um)");
  add_files(*map, *options);
  add_uncertainty(*map, options->map.u_random_um);
  add_parts(*map, options->map.parts);
  map->callback([options, &exit] {
    exit = run(*options, [&](const std::string& text, Diagnostics& d) {
      return diagnosis::import_map(text, options->file, options->map, d);
    });
  });

  add_stage(*import, options, exit);
  add_pointing(*import, options, exit);

  auto traced = std::make_shared<TraceImport>();
  auto* trace = import->add_subcommand(
      "trace",
      "positions of the axes that a control recorded: as a trace for verify --trace, or as measurements");
  trace->add_option("file", traced->file, "file to read")->required();
  trace->add_option("-o,--output", traced->out, "trace (CSV), or measurement file with --program, to write")
      ->required();
  traced->machine.add_to(*trace, true);
  trace
      ->add_option(
          "--columns", traced->columns,
          "names of the fields of a list without a header, in their order, with commas: time_s, time_ms "
          "or sample, X_mm ... C_deg, block, - for a field that is left out (default: the file is CSV with a "
          "header)")
      ->excludes(
          trace->add_option("--items", traced->items,
                            "the file is what an MTConnect adapter sends (SHDR): its keys and what they are, "
                            "Xact=X_mm,...,Cact=C_deg,line=block"));
  trace
      ->add_option("--period-s", traced->period_s,
                   "time between samples, for a trace that numbers its samples")
      ->check(above_zero())
      ->capture_default_str();
  trace->add_option("--program", traced->program,
                    "NC program that ran: readings of tip and rotation, actual minus commanded");
  traced->against.add_to(*trace);
  trace->add_option(
      "--model-out", traced->model_out,
      "write a model (TOML) with the common delay of all axes, which is removed from the readings");
  trace
      ->add_option("--tolerance-mm", traced->tolerance_mm,
                   "tolerance of the CL path that the program was made with")
      ->check(above_zero())
      ->capture_default_str();
  add_smoothing(*trace, traced->smoothing);
  trace
      ->add_option("--rows", traced->how.most_rows,
                   "number of samples used, about: most evenly over the trace, the others where axes reverse")
      ->check(CLI::Range(std::size_t{10}, std::size_t{1000000}))
      ->capture_default_str();
  traced->tools.add_to(*trace);
  traced->result.add_to(*trace);
  trace->callback([traced, &exit] { exit = run_trace(*traced); });

  auto* log = import->add_subcommand("log", "temperature log with a displacement channel");
  add_files(*log, *options);
  log->add_option("--channel", options->log.channel, "column of the displacement, um")->required();
  log->add_option("--direction", options->log.direction, "direction of sensitivity")
      ->check(CLI::IsMember({"X", "Y", "Z"}))
      ->capture_default_str();
  add_uncertainty(*log, options->log.u_random_um);
  log->add_option("--step-s", options->log.step_s, "time between rows, for a file without time")
      ->check(above_zero())
      ->capture_default_str();
  log->add_option("--every", options->log.every,
                  "keep every n-th reading; the other rows keep only their state (temperatures, speed)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  log->callback([options, &exit] {
    exit = run(*options, [&](const std::string& text, Diagnostics& d) {
      return diagnosis::import_log(text, options->file, options->log, d);
    });
  });
}

}  // namespace trunnion::app
