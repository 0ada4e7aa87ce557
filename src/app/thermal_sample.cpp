// Simulated impeller days and their assessment: what the sample of the thermal paper is made of.
#include <memory>

#include "trunnion/base/files.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/thermal_report.hpp"
#include "trunnion/thermal/assess.hpp"

#include "app/file_roles.hpp"
#include "app/results.hpp"
#include "app/support.hpp"
#include "app/thermal_serve.hpp"

namespace trunnion::app {
namespace {

using namespace thermal;

struct ThermalSampleFlags {
  ImpellerDays days;
  bool no_hidden = false;
  std::string output;
  std::string truth;
  ResultOptions result;
};

ExitCode run_simulate(const ThermalSampleFlags& options) {
  ImpellerDays days = options.days;
  days.hidden_effects = !options.no_hidden;
  const SimulatedDays made = simulate(days);
  if (const ExitCode code = write_output(options.output, log_text(made.log, {" simulated impeller days"}));
      code != kDone)
    return code;
  if (!options.truth.empty()) {
    if (const ExitCode code = write_output(options.truth, truth_text(made)); code != kDone) return code;
  }
  const report::ResultText said{"Simulated impeller days", "Written to " + options.output + ".",
                                report::thermal_log_json(made.log), made_by()};
  return options.result.write(
      said.json, [&] { return report::log_page(said, made.log); }, "");
}

struct AssessOptions {
  std::string truth, offsets;
  ResultOptions result;
  double tolerance_mm = 0.1;
  double least_share = 0.0;
  bool per_blade = false;
};

ExitCode run_assess(const AssessOptions& options) {
  const auto truth = read_file(options.truth);
  if (!truth) return print_error(truth.error());
  const auto offsets = read_file(options.offsets);
  if (!offsets) return print_error(offsets.error());
  Diagnostics diagnostics;
  const auto blades = assess_files({*truth, options.truth}, {*offsets, options.offsets},
                                   options.per_blade ? Sending::per_blade : Sending::always, diagnostics);
  if (!blades) return print_failure(diagnostics, blades.error());
  if (const auto code = options.result.write(
          report::thermal_assess_json(*blades, options.tolerance_mm),
          {"Blades of " + options.truth,
           std::to_string(blades->size()) + " blades, with " + options.offsets + " and without.",
           {},
           {}},
          report::thermal_assess_page, report::thermal_assess_text(*blades, options.tolerance_mm));
      code != kDone)
    return code;
  const double after = share_within(*blades, &BladeResult::after_mm, options.tolerance_mm);
  return after >= options.least_share ? kDone : kCheckFailed;
}

}  // namespace

void add_thermal_sample_commands(CLI::App& thermal, int& exit) {
  auto making = std::make_shared<ThermalSampleFlags>();
  CLI::App* sub = thermal.add_subcommand(
      "simulate", "simulated temperature logs of days on which impellers are milled, with the true drift");
  sub->add_option("-o,--output", making->output, "temperature log to write")->required();
  sub->add_option("--truth", making->truth, "write the true drift to this file")->type_name(kFileToWrite);
  sub->add_option("--impellers", making->days.impellers, "number of impellers, one a day")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  sub->add_option("--blades", making->days.blades, "blades of an impeller; the drift is measured after each")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  sub->add_option("--seed", making->days.day_seed,
                  "random seed of the days (heat flows and gains are drawn for each day)")
      ->capture_default_str();
  sub->add_option("--machine-seed", making->days.machine_seed,
                  "random seed of the machine's own thermal behaviour")
      ->capture_default_str();
  sub->add_option("--gain", making->days.gain, "scale of all drifts")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_flag("--no-hidden", making->no_hidden, "without the effects that no sensor sees");
  making->result.add_to(*sub);
  sub->callback([making, &exit] { exit = run_simulate(*making); });

  auto assessing = std::make_shared<AssessOptions>();
  sub = thermal.add_subcommand("assess", "share of blades within a tolerance, with and without offsets");
  sub->add_option("truth", assessing->truth, "truth of thermal simulate")->required();
  sub->add_option("offsets", assessing->offsets, "offsets of thermal predict")->required();
  sub->add_option("--tolerance-mm", assessing->tolerance_mm,
                  "largest deviation of a blade that counts as within")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->add_flag("--per-blade", assessing->per_blade, "the offset is sent once, at the start of each blade");
  sub->add_option("--least-share", assessing->least_share, "exit code 1 when fewer blades are within")
      ->check(between(0.0, 1.0));
  assessing->result.add_to(*sub);
  sub->callback([assessing, &exit] { exit = run_assess(*assessing); });
}

}  // namespace trunnion::app
