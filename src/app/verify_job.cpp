#include "app/verify_job.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <utility>

namespace trunnion::app {
namespace {

// Whether the header says that errors of the machine are compensated: a comment that begins so, as none of
// the CL file does. Of a file only: a pipe is read once.
bool compensates_errors(const std::string& nc_file, const nc::Controller::Comments& comments) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(nc_file, ec)) return false;
  constexpr std::size_t kHeader = 4096;
  std::string head(kHeader, '\0');
  std::ifstream file(nc_file, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  std::transform(head.begin(), head.end(), head.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string begins = comments.open + (comments.close.empty() ? " " : "");
  return head.find(begins + "errors compensated: ") != std::string::npos;
}

}  // namespace

void VerifyCommand::add_to(CLI::App& c) {
  c.add_option("program", nc_file, "NC file (- is standard input)")->required();
  against.add_to(c)->required();
  machine.add_to(c, true);
  c.add_option("--truth", truth,
               "model of the errors of the machine to evaluate on (default: the nominal machine)");
  c.add_option("--offsets", of_run.offsets,
               "thermal offsets (CSV) of the machine while the program runs (default: none, a cold machine)");
  of_run.thermal_limits.add_to(c);
  c.add_option("--trace", of_run.trace,
               "positions of the axes over time that the control recorded while it ran the program (CSV: "
               "time_s, X_mm, A_deg, ...): check the recorded motion, too");
  c.add_option("--tolerance-mm", tolerance_mm, "largest deviation of the tip from the CL path")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--rapid-tolerance-mm", rapid_tolerance_mm,
               "largest deviation of the tip from the straight line of a rapid")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--axis-tolerance-deg", axis_tolerance_deg,
               "largest angle of the tool axis off the shortest turn between two CL directions (default: "
               "axis_tolerance_deg of the machine file)")
      ->check(above_zero());
  c.add_flag("--no-certify", no_certify, "sample the deviations instead of proving a bound");
  c.add_option(
      "--work-offset", work_offset,
      "work offset that the program is to call: 1 (G54), 2, ... (default: SET/OFSETL of the CL file, else "
      "the machine file's)");
  add_smoothing(c, smoothing);
  pole.add_to(c);
  tools.add_to(c);
}

Result<std::unique_ptr<VerifyInputs>> read_verify_inputs(VerifyCommand& command, Diagnostics& diagnostics) {
  auto in = std::make_unique<VerifyInputs>();
  auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return tl::unexpected(files.error());
  in->files = std::move(*files);
  const Machine& machine = in->files.machine;
  if (command.truth.empty() && compensates_errors(command.nc_file, in->files.controller.comments)) {
    diagnostics.warning(
        command.nc_file, {},
        "its header names a model of the machine's errors; without --truth it is evaluated on "
        "the nominal machine");
  }
  if (const auto loaded = command.against.load(command.machine, diagnostics); !loaded)
    return tl::unexpected(loaded.error());
  auto truth = load_truth(command.truth, machine, in->options.lag_s, diagnostics);
  if (!truth) return tl::unexpected(truth.error());
  in->truth = std::move(*truth);
  auto tools = command.tools.load(diagnostics);
  if (!tools) return tl::unexpected(tools.error());
  in->tools = std::move(*tools);
  if (!command.of_run.offsets.empty()) {
    auto table = thermal::load_offsets(command.of_run.offsets, diagnostics);
    if (!table) return tl::unexpected(table.error());
    in->offsets = std::move(*table);
  }
  const auto smoothing = smoothing_of(command.smoothing);
  if (!smoothing) return tl::unexpected(smoothing.error());
  post::VerifyOptions& options = in->options;
  options.offset_limits = command.of_run.thermal_limits.resolve();
  options.offsets = in->offsets ? &*in->offsets : nullptr;
  options.tolerance_mm = command.tolerance_mm;
  options.rapid_tolerance_mm = command.rapid_tolerance_mm;
  options.axis_tolerance =
      command.axis_tolerance_deg ? Angle::degrees(*command.axis_tolerance_deg) : machine.axis_tolerance;
  options.certify = !command.no_certify;
  options.pole = command.pole.resolve();
  options.truth = in->truth ? &*in->truth : nullptr;
  options.work_offset = command.work_offset;
  options.smoothing_mm = *smoothing;
  options.tools = command.tools.resolve(in->tools);
  return in;
}

}  // namespace trunnion::app
