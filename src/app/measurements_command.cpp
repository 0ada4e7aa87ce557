#include <memory>

#include "trunnion/base/files.hpp"
#include "trunnion/diagnosis/import.hpp"
#include "trunnion/diagnosis/measurement_template.hpp"
#include "trunnion/report/diagnosis_json.hpp"

#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/results.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

struct MeasurementsOptions {
  std::string file, out;
  diagnosis::MapImport map;
  diagnosis::LogImport log;
  ResultOptions result;
};

template <class Import>
int run(const MeasurementsOptions& options, const Import& import) {
  if (const auto apart = options.result.apart_from(options.out); !apart) return print_error(apart.error());
  const auto text = read_file(options.file);
  if (!text) return print_error(text.error());
  Diagnostics diagnostics;
  const auto imported = import(*text, diagnostics);
  if (!imported) return print_failure(diagnostics, imported.error());
  print(diagnostics);
  if (const auto code = write_output(options.out, *imported); code != kDone) return code;
  return options.result.write(report::imported_json(options.file, *imported),
                              "Measurements of " + options.file, "In the measurement format: " + options.out,
                              "");
}

struct TemplateOptions {
  std::string kind, machine, out;
  ResultOptions result;
};

int run_template(const TemplateOptions& options) {
  if (const auto apart = options.result.apart_from(options.out); !apart) return print_error(apart.error());
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return exit;
  const auto text = diagnosis::measurement_template(*machine, options.kind);
  if (!text) return print_error(text.error());
  if (const auto code = write_output(options.out, *text); code != kDone) return code;
  return options.result.write(
      report::imported_json(options.kind, *text), "A file to fill in: " + options.kind,
      "Poses of machine '" + machine->name + "', no readings yet: " + options.out, "");
}

void add_template(CLI::App& measurements, int& exit) {
  auto* command = measurements.add_subcommand(
      "template", "measurement file with the poses of a campaign, for readings to be filled in");
  auto options = std::make_shared<TemplateOptions>();
  command->add_option("kind", options->kind, "laser, rtest, ballbar or probe")
      ->required()
      ->check(CLI::IsMember(diagnosis::template_kinds()));
  command->add_option("-m,--machine", options->machine, "machine file (TOML)")
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

}  // namespace

void add_measurements_command(CLI::App& root, int& exit) {
  auto* measurements =
      root.add_subcommand("measurements", "measurement files: a form to fill in, other people's formats");
  measurements->require_subcommand(1);
  add_template(*measurements, exit);
  auto* import = measurements->add_subcommand("import", "read another format");
  import->require_subcommand(1);
  auto options = std::make_shared<MeasurementsOptions>();

  auto* map =
      import->add_subcommand("map", "two-dimensional map: x, y, error along X, error along Y (mm, um)");
  add_files(*map, *options);
  map->add_option("--u-random-um", options->map.u_random_um, "standard uncertainty of one reading");
  map->add_option("--parts", options->map.parts, "runs that the points are dealt to, for held-out tests");
  map->callback([options, &exit] {
    exit = run(*options, [&](const std::string& text, Diagnostics& d) {
      return diagnosis::import_map(text, options->file, options->map, d);
    });
  });

  auto* log = import->add_subcommand("log", "temperature log with a displacement channel");
  add_files(*log, *options);
  log->add_option("--channel", options->log.channel, "column of the displacement, um")->required();
  log->add_option("--direction", options->log.direction, "X, Y or Z: direction of sensitivity")
      ->check(CLI::IsMember({"X", "Y", "Z"}));
  log->add_option("--u-random-um", options->log.u_random_um, "standard uncertainty of one reading");
  log->add_option("--step-s", options->log.step_s, "time between rows where the file has none");
  log->add_option("--every", options->log.every, "keep each n-th reading; the others stay as state");
  log->callback([options, &exit] {
    exit = run(*options, [&](const std::string& text, Diagnostics& d) {
      return diagnosis::import_log(text, options->file, options->log, d);
    });
  });
}

}  // namespace trunnion::app
