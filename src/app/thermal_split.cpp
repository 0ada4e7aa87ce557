// Drift measured at several poses, split into shifts of the tool and of the rotary axes.
#include <algorithm>
#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/report/thermal_report.hpp"
#include "trunnion/thermal/location.hpp"

#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/options.hpp"
#include "app/thermal_serve.hpp"

namespace trunnion::app {
namespace {

using namespace thermal;

struct ThermalSplitOptions {
  std::vector<std::string> files;
  std::string machine;
  std::vector<std::string> probed_at;  // "A=0", "C=0"
  bool rides = false;
  std::vector<std::string> need;
  ResultOptions result;
};

Result<std::optional<JointVector>> datum_of(const ThermalSplitOptions& options, const Machine& machine) {
  if (options.rides) return std::optional<JointVector>{};
  if (options.probed_at.empty()) return machine.probed_at;
  JointVector q;
  for (const std::string& word : options.probed_at) {
    const auto equals = word.find('=');
    const auto axis = machine.axis(word.substr(0, equals));
    const ParsedNumber degrees = parse_number(
        equals == std::string::npos ? std::string_view() : std::string_view(word).substr(equals + 1));
    if (!axis || machine.axes[*axis].kind != AxisKind::rotary || !degrees)
      return fail(ErrorCode::wrong_use,
                  "--probed-at takes rotary axes with degrees, as A=0,C=0, not '" + word + "'");
    q[*axis] = Angle::degrees(degrees.value).rad();
  }
  return std::optional<JointVector>(q);
}

std::vector<DriftReading> readings_of(const diagnosis::Dataset& data, const Machine& machine) {
  std::vector<DriftReading> out;
  out.reserve(data.readings.size());
  for (const diagnosis::Reading& reading : data.readings) {
    if (reading.quantity != diagnosis::Quantity::displacement) continue;
    const JointVector q = data.track.state(reading.row).q;
    const bool in_part = reading.frame == diagnosis::SensitivityFrame::part;
    out.push_back({q, in_part ? Vec3(part_in_machine(machine, q).R * reading.n) : reading.n, reading.value,
                   reading.u_random});
  }
  return out;
}

// What the sample's question needs by default: the tool across its axis, and the axis that the part sits on.
std::vector<std::string> needed(const ThermalSplitOptions& options, const Machine& machine) {
  if (!options.need.empty()) return options.need;
  const auto rotary = machine.rotary_axes();
  std::vector<std::string> out = {"tool_x", "tool_y"};
  if (rotary.empty()) return out;
  const Axis& inner = machine.axes[rotary.back()];
  Eigen::Index along = 0;
  inner.direction.cwiseAbs().maxCoeff(&along);
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (i != along) out.push_back(std::string(1, "XYZ"[i]) + "0" + inner.name);
  }
  return out;
}

ExitCode run_split(const ThermalSplitOptions& options) {
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return static_cast<ExitCode>(exit);
  const auto data = read_data(options.files, *machine, exit);
  if (!data) return static_cast<ExitCode>(exit);
  const auto datum = datum_of(options, *machine);
  if (!datum) return print_error(datum.error());
  const auto split = split_drift(*machine, readings_of(*data, *machine), *datum);
  if (!split) return print_error(split.error());
  std::vector<std::string> refused;
  for (const std::string& name : needed(options, *machine)) {
    const DriftParameter* p = split->find(name);
    if (p == nullptr)
      return print_error({ErrorCode::wrong_use, "--need: there is no '" + name + "'", {}, {}});
    if (!p->identifiable) refused.push_back(name);
  }
  const std::string names = joined(refused, ", ");
  if (const ExitCode code = options.result.write(
          report::thermal_split_json(*split, refused),
          {"Drift of " + machine->name,
           refused.empty() ? "These poses tell apart what is asked for." : "Not told apart: " + names + ".",
           {},
           {}},
          report::thermal_split_page, report::thermal_split_text(*split));
      code != kDone)
    return code;
  if (refused.empty()) return kDone;
  spdlog::error("error: not told apart: {}; these poses have rank {} of {}", names, split->rank,
                split->parameters.size());
  return kCheckFailed;
}

}  // namespace

void add_thermal_split_command(CLI::App& thermal, int& exit) {
  auto options = std::make_shared<ThermalSplitOptions>();
  CLI::App* sub = thermal.add_subcommand(
      "split", "drift measured at several poses: how far the tool, the A axis and the C axis have moved");
  sub->add_option("data", options->files, "measurement files (CSV): displacements since the datum")
      ->required();
  sub->add_option("-m,--machine", options->machine,
                  "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  auto* probed =
      sub->add_option("--probed-at", options->probed_at,
                      "the datum was probed at this pose on the drifted machine: A=0,C=0 (default: "
                      "the machine file's [datum])")
          ->delimiter(',');
  sub->add_flag("--rides", options->rides, "zero was set on the cold machine and moves with the table")
      ->excludes(probed);
  sub->add_option("--need", options->need,
                  "exit code 1 unless the data separate these (tool_x, tool_y, X0C, Y0C)")
      ->delimiter(',');
  options->result.add_to(*sub);
  sub->callback([options, &exit] { exit = run_split(*options); });
}

}  // namespace trunnion::app
