#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/post/verify.hpp"

#include "app/against_options.hpp"
#include "app/options.hpp"
#include "app/results.hpp"

namespace trunnion::app {

/// While the program runs.
struct OfTheRun {
  std::string offsets;
  OffsetLimitOptions thermal_limits;  // which values at run time may not exceed
  std::string trace;
};

/// The command line of `verify`.
struct VerifyCommand {
  std::string nc_file;
  AgainstOptions against;
  std::string truth;
  OfTheRun of_run;
  MachineOptions machine;
  ResultOptions result;
  double tolerance_mm = 0.01;
  double rapid_tolerance_mm = 1.0;
  std::optional<double> axis_tolerance_deg;
  bool no_certify = false;
  std::optional<std::int64_t> work_offset;
  std::string smoothing = "off";
  PoleCliOptions pole;
  ToolCliOptions tools;

  /// The program, --against and all options that say how it is judged.
  void add_to(CLI::App& command);
};

/// Everything that a program is judged with, read from its files. `options` points into it.
struct VerifyInputs {
  MachineFiles files;
  std::optional<ModelEvaluator> truth;
  std::optional<post::ToolTable> tools;
  std::optional<thermal::OffsetTable> offsets;
  post::VerifyOptions options;
};

/// Reads the files that the command names, but for the program and its path.
Result<std::unique_ptr<VerifyInputs>> read_verify_inputs(VerifyCommand& command, Diagnostics& diagnostics);

}  // namespace trunnion::app
