#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/effects/model.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/post/post.hpp"

#include "app/results.hpp"
#include "app/support.hpp"
#include "app/tool_options.hpp"

namespace trunnion::app {

/// Folder with `machines` and `controllers`: the environment's TRUNNION_POSTCONFIGS, else found from the
/// place of the program (or of the Python module): share/trunnion/postconfigs in a folder above it where it
/// is installed, postconfigs beside it in a build folder.
std::string postconfigs_folder();

/// Names of the files that ship in postconfigs/`kind` ("machines", "controllers"), sorted.
std::vector<std::string> shipped_names(const std::string& kind);

/// `-m` and `-c` of every command that knows a machine.
struct MachineOptions {
  std::string machine;
  std::string controller;
  void add_to(CLI::App& command, bool with_controller);
};

/// A machine file, by path or by the name of one that ships with the program.
Result<Machine> load_machine_or_named(const std::string& machine, Diagnostics& diagnostics);
/// The machine file, by path or by the name of one that ships with the program.
Result<Machine> load(const MachineOptions& options, Diagnostics& diagnostics);
/// A machine with its controller: the one that is given, else the machine's, else postconfigs' default.
struct MachineFiles {
  Machine machine;
  nc::Controller controller;
};
/// `rtcp`: a program under tool-centre-point control is asked for, so that the control must have it.
Result<MachineFiles> load_with_controller(const MachineOptions& options, Diagnostics& diagnostics,
                                          bool rtcp = false);
/// The errors of the machine to evaluate on; nothing for an empty `file`: the nominal machine.
/// `lag_s` gets by how much its axes follow their commands late: those are no errors at a place.
Result<std::optional<ModelEvaluator>> load_truth(const std::string& file, const Machine& machine,
                                                 JointVector& lag_s, Diagnostics& diagnostics);

/// How a CL file is read: shared by every command that reads one, so that a program is verified against what
/// was posted.
struct ClCliOptions {
  bool ignore_msys = false;
  std::string msys = "auto";
  std::string units;
  std::string cutter_compensation = "refuse";
  void add_to(CLI::App& command);
  cl::ReaderOptions resolve() const;
  /// The options as they stand, for "unchanged inputs are skipped".
  std::string text() const;
};

/// Warns, once, of sensors and states of `model` that `data` does not have.
void warn_of_missing_sensors(const Model& model, const EffectContext& data, Diagnostics& diagnostics);

/// The pole's cone: shared by `post`, `batch` and `verify`.
struct PoleCliOptions {
  double cone_deg = 5.0;
  double min_turn_deg = 10.0;
  double tolerance_deg = 0.0;
  void add_to(CLI::App& command);
  path::PoleOptions resolve() const;
};

/// `--smoothing` of `post`, `batch` and `verify`: PostOptions::smoothing_mm of its text; fails with
/// wrong_use.
void add_smoothing(CLI::App& command, std::string& smoothing);
Result<std::optional<double>> smoothing_of(const std::string& text);

/// Limits of thermal corrections: shared by `post`, `batch` and `verify`.
struct OffsetLimitOptions {
  double clamp_um = thermal::OffsetLimits{}.clamp_mm / kMmPerUm;
  double slew_um_s = thermal::OffsetLimits{}.slew_mm_s / kMmPerUm;
  double dead_band_um = thermal::OffsetLimits{}.dead_band_mm / kMmPerUm;
  void add_to(CLI::App& command);
  thermal::OffsetLimits resolve() const;
};

/// How thermal offsets are written.
struct ThermalOutputOptions {
  std::string form = "axis-values";
  OffsetLimitOptions limits;
  void add_to(CLI::App& command);
};

/// How a CL file is posted: the options that `post` and `batch` share.
struct PostCliOptions {
  double tolerance_mm = 0.01;
  double rapid_tolerance_mm = 1.0;
  std::optional<double> axis_tolerance_deg;
  std::string nonlinear = "adaptive";
  std::string predictor = "harmonic";
  std::string choice = "global";
  std::string feed = "inverse";
  std::string model;
  std::string offsets;
  std::string thermal_model;
  std::string temperatures;
  ThermalOutputOptions thermal_output;
  double default_feed_mm_min = 250.0;
  double retract_mm = 50.0;
  PoleCliOptions pole;
  std::string arcs;    // empty: as the controller file says
  std::string cycles;  // the same
  bool tilted_plane = false;
  bool rtcp = false;
  bool one_sided = false;
  bool thin = false;
  bool move_programmed_points = false;
  bool no_certify = false;
  bool no_verify = false;
  bool accept_deviation = false;
  bool no_geometric = false;
  bool no_thermal = false;
  std::map<std::string, std::optional<double>> path_stages;  // post::PathStage: by name
  double largest_correction_mm = 0.5;
  std::string smoothing = "off";
  std::optional<std::int64_t> work_offset;
  struct ProgramName {
    std::string text;
    std::optional<std::int64_t> number;
  } program;
  ToolCliOptions tools;
  ClCliOptions reading;

  void add_to(CLI::App& command);
  /// Without the tool file. Fails with wrong_use.
  Result<post::PostOptions> resolve() const;
  /// Lines of a program's header: what is compensated, and how its nonlinear error is held.
  std::string errors_line(bool compensated) const;
  std::string tolerance_line() const;
  std::vector<std::string> stage_lines() const;
  /// All values, for the fingerprint of a batch.
  std::string text() const;
  /// How thermal offsets are applied, and their limits.
  void set_offset_output(post::PostJob& job) const;
  /// Thermal offsets: of a file, or predicted from a thermal model and a temperature log; nothing without
  /// either.
  /// With `drift`: those that it means.
  Result<std::optional<thermal::OffsetTable>> load_offsets(
      Diagnostics& diagnostics, const std::optional<post::RunTimeDrift>& drift = std::nullopt) const;
  /// What the control is to calculate its offsets from (`--thermal-output variables` with `--thermal`);
  /// nothing otherwise. Without `--temperatures` it is verified with rises of some size.
  Result<std::optional<post::RunTimeDrift>> load_run_time_drift(Diagnostics& diagnostics) const;
  /// The model of the file with the classes that are switched off left out; nothing without `--model`.
  /// With `temperatures` the sensors of the model are read from `--temperatures`, where one that is missing
  /// is an error; without, or without the option, they count as at reference, which is warned about.
  Result<std::optional<Model>> load_errors(const Machine& machine, Diagnostics& diagnostics,
                                           std::optional<post::TemperatureHistory>* history = nullptr) const;
};

}  // namespace trunnion::app
