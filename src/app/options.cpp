#include "app/options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <spdlog/spdlog.h>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/effects/axis_lags.hpp"
#include "trunnion/effects/model_values.hpp"
#include "trunnion/post/axes_of.hpp"
#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/model.hpp"
#include "trunnion/thermal/predictor.hpp"

#include "app/command_tree.hpp"

namespace trunnion::app {
namespace {

constexpr double kMostSmoothing_mm = 1.0;  // more would be no finish of any kind

namespace fs = std::filesystem;

// The folder of the program, or of the library that another program (Python) has loaded this code from.
fs::path own_folder() {
  std::error_code ec;
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&postconfigs_folder), &info) != 0 &&
      fs::path(info.dli_fname).extension() == ".so")
    return fs::canonical(info.dli_fname, ec).parent_path();
  const fs::path self = fs::read_symlink("/proc/self/exe", ec);
  return ec ? fs::path(".") : self.parent_path();
}

}  // namespace

std::string postconfigs_folder() {
  if (const char* given = std::getenv("TRUNNION_POSTCONFIGS")) return given;  // NOLINT(concurrency-mt-unsafe)
  std::error_code ec;
  const fs::path own = own_folder();
  const fs::path beside = own / "postconfigs";  // of a build folder: a link to the sources'
  if (fs::is_directory(beside, ec)) return beside.string();
  const fs::path installed = fs::path("share") / "trunnion" / "postconfigs";
  for (fs::path above = own.parent_path(); above.has_relative_path(); above = above.parent_path()) {
    if (fs::is_directory(above / installed, ec)) return (above / installed).string();
  }
  return (own / ".." / installed).lexically_normal().string();
}

void MachineOptions::add_to(CLI::App& command, bool with_controller) {
  command.add_option("-m,--machine", machine, "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  if (with_controller) {
    command
        .add_option("-c,--controller", controller,
                    "controller file, or the name of one in postconfigs/controllers (the machine file's, "
                    "else default.toml there)")
        ->type_name(kControllerName);
  }
}

std::vector<std::string> shipped_names(const std::string& kind) {
  std::vector<std::string> out;
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(postconfigs_folder() + "/" + kind, ec)) {
    if (entry.path().extension() == ".toml") out.push_back(entry.path().stem().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

Result<Machine> load_machine_or_named(const std::string& machine, Diagnostics& diagnostics) {
  std::error_code ec;
  if (machine.empty() || machine == "-" || machine.find_first_of("/.") != std::string::npos ||
      fs::exists(machine, ec))
    return load_machine(machine, diagnostics);
  const std::string folder = postconfigs_folder() + "/machines";
  const std::string shipped = folder + "/" + machine + ".toml";
  if (fs::exists(shipped, ec)) return load_machine(shipped, diagnostics);
  const auto names = shipped_names("machines");
  return fail(ErrorCode::io_failed, "no machine file '" + machine + "', and no machine of that name in " +
                                        folder + did_you_mean(machine, names) +
                                        (names.empty() ? "" : "; there are: " + joined(names, ", ")));
}

Result<Machine> load(const MachineOptions& options, Diagnostics& diagnostics) {
  return load_machine_or_named(options.machine, diagnostics);
}

Result<MachineFiles> load_with_controller(const MachineOptions& options, Diagnostics& diagnostics,
                                          bool rtcp) {
  auto machine = load(options, diagnostics);
  if (!machine) return tl::unexpected(machine.error());
  const std::string name =
      !options.controller.empty() ? options.controller : machine->controller.value_or("default");
  const std::string folder = postconfigs_folder() + "/controllers";
  const auto file = nc::find_controller(name, folder);
  if (!file) return tl::unexpected(file.error());
  auto controller = nc::load_controller(*file, diagnostics, folder);
  if (!controller) return tl::unexpected(controller.error());
  spdlog::debug("machine '{}' from {}", machine->name, machine->file);
  spdlog::debug("controller '{}' from {}{}", controller->name, controller->file,
                controller->bases.empty() ? "" : " on " + controller->bases.front());
  if (rtcp && controller->tcp.switches_kinematics && !machine->switchable_kinematics) {
    diagnostics.warning_once("kinematics", machine->file, {},
                             "--rtcp: the machine file does not say that the control can switch its "
                             "kinematics; taken as if it had [machine] switchable_kinematics = true");
    machine->switchable_kinematics = true;
  }
  auto on_machine = post::with_axes_of(*machine, std::move(*controller));
  return MachineFiles{std::move(*machine), std::move(on_machine)};
}

Result<std::optional<ModelEvaluator>> load_truth(const std::string& file, const Machine& machine,
                                                 JointVector& lag_s, Diagnostics& diagnostics) {
  if (file.empty()) return std::optional<ModelEvaluator>{};
  const auto model = load_model(file, machine, {}, diagnostics);
  if (!model) return tl::unexpected(model.error());
  warn_of_missing_sensors(*model, {}, diagnostics);
  if (!has_values(*model)) {
    diagnostics.warning(file, {}, "no effect has a value: the program is evaluated on the nominal machine");
    return std::optional<ModelEvaluator>{};
  }
  spdlog::debug("true errors: {} effects from {}", model->effects.size(), file);
  lag_s = axis_lags(*model);
  const Model at_place = without_servo_effects(*model);
  if (!has_values(at_place)) return std::optional<ModelEvaluator>{};
  return std::optional<ModelEvaluator>(ModelEvaluator(at_place));
}

void ClCliOptions::add_to(CLI::App& c) {
  c.add_option("--msys", msys,
               "points of an NX file: decide by the tool's direction (auto), convert them from the absolute "
               "system to MSYS (apply), use them as written (ignore)")
      ->check(CLI::IsMember({"auto", "apply", "ignore"}))
      ->capture_default_str();
  c.add_flag("--ignore-msys", ignore_msys, "the same as --msys ignore")->excludes("--msys");
  c.add_option(
       "--cl-units", units,
       "unit of length of a CL file without UNITS (default: mm; a file with feeds in inches is refused)")
      ->check(CLI::IsMember({"mm", "inch"}));
  c.add_option(
       "--cutter-compensation", cutter_compensation,
       "CUTCOM in the CL file: an error (refuse), or left out because the points are those of the tool's "
       "center (tool-center), or written for the control, which adds the wear in its register to them (wear)")
      ->check(CLI::IsMember({"refuse", "tool-center", "wear"}))
      ->capture_default_str();
}

void PoleCliOptions::add_to(CLI::App& c) {
  c.add_option(
       "--pole-tolerance-deg", tolerance_deg,
       "largest tilt of the tool axis near the pole, tip unchanged, so that the inner rotary axis turns "
       "less (0: none)")
      ->check(between(0.0, 10.0))
      ->capture_default_str();
  c.add_option("--pole-cone-deg", cone_deg, "only where the tool axis is within this angle of the pole")
      ->check(between(0.0, 30.0))
      ->capture_default_str();
  c.add_option("--pole-min-turn-deg", min_turn_deg,
               "only where the inner rotary axis would turn by more than this between two points")
      ->check(between(0.0, 180.0))
      ->capture_default_str();
}

path::PoleOptions PoleCliOptions::resolve() const {
  return {Angle::degrees(cone_deg), Angle::degrees(min_turn_deg), Angle::degrees(tolerance_deg)};
}

void OffsetLimitOptions::add_to(CLI::App& c) {
  c.add_option("--thermal-clamp-um", clamp_um, "largest thermal correction of an axis")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--thermal-slew-um-s", slew_um_s,
               "largest rate of change of the thermal correction of an axis")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--thermal-dead-band-um", dead_band_um,
               "smallest change of the thermal correction that is followed")
      ->check(between(0.0, kLargestOption))
      ->capture_default_str();
}

thermal::OffsetLimits OffsetLimitOptions::resolve() const {
  thermal::OffsetLimits out;
  out.clamp_mm = clamp_um * kMmPerUm;
  out.slew_mm_s = slew_um_s * kMmPerUm;
  out.dead_band_mm = dead_band_um * kMmPerUm;
  return out;
}

void ThermalOutputOptions::add_to(CLI::App& c) {
  c.add_option("--thermal-output", form,
               "how thermal offsets are written: as corrected axis values at every point (axis-values); as "
               "one shift for each operation, of the work offset (work-offset: G10 L2, TRANS) or in addition "
               "to it (local-shift: G52, TRANS); or read by the program from variables of the control at run "
               "time (variables: --offsets is then used for the verification only; with --thermal the "
               "program calculates them from the control's temperatures)")
      ->check(CLI::IsMember({"axis-values", "work-offset", "local-shift", "variables"}))
      ->capture_default_str();
  limits.add_to(c);
}

cl::ReaderOptions ClCliOptions::resolve() const {
  cl::ReaderOptions out;
  if (msys == "apply") out.frames = cl::ReaderOptions::Frames::apply;
  if (msys == "ignore" || ignore_msys) out.frames = cl::ReaderOptions::Frames::ignore;
  out.units_are_asked_for = !units.empty();
  if (!units.empty())
    out.units = units == "inch" ? cl::ReaderOptions::Units::inch : cl::ReaderOptions::Units::mm;
  if (cutter_compensation == "tool-center") {
    out.cutter_compensation = cl::ReaderOptions::CutterCompensation::tool_center;
  }
  if (cutter_compensation == "wear") out.cutter_compensation = cl::ReaderOptions::CutterCompensation::wear;
  return out;
}

std::string ClCliOptions::text() const {
  return (ignore_msys ? std::string("ignore") : msys) + " " + units + " " + cutter_compensation;
}

void PostCliOptions::add_to(CLI::App& c) {
  c.add_option("--tolerance-mm", tolerance_mm, "largest deviation of the tip from its programmed path")
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
  c.add_option("--nonlinear", nonlinear,
               "how the path is kept in tolerance: adaptive (fewest blocks), reinsert (points exactly on the "
               "path), subtract (no added points, ends shifted), none")
      ->check(CLI::IsMember({"none", "reinsert", "subtract", "adaptive"}))
      ->capture_default_str();
  c.add_option("--predictor", predictor,
               "how the nonlinear error between two points is predicted: one sine through the midpoint error "
               "(harmonic), 2 to 9 sines (harmonic2..9), parabola through the midpoint error (parabola), "
               "with a cubic from the end slopes (skew), from the midpoint error and both end slopes "
               "(quartic), the curve itself (exact). The tolerance is kept with each of them")
      ->capture_default_str();
  c.add_option(
       "--choice", choice,
       "choice among the rotary solutions: least axis time over all points between two rapids (global); or "
       "point by point, least root of the sum of squares of the rotary travels (combined), least largest "
       "travel (largest), least sum (sum), least travel of one axis (axis:NAME)")
      ->capture_default_str();
  c.add_option("--feed", feed,
               "inverse time or per minute; as-programmed, alone or after one of them "
               "(per-minute,as-programmed): keep the programmed F even where the accelerations of the axes "
               "in the machine file do not let it be reached")
      // Said with its words, not with all that can be made of them.
      ->check(CLI::IsMember({"inverse", "per-minute", "as-programmed", "inverse,as-programmed",
                             "per-minute,as-programmed"})
                  .description("{inverse,per-minute,as-programmed}"))
      ->capture_default_str();
  c.add_option("--default-feed-mm-min", default_feed_mm_min, "feed of motions before any FEDRAT")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--retract-mm", retract_mm,
               "retract distance from the part before the rotary axes turn back or change the solution")
      ->check(above_zero())
      ->capture_default_str();
  c.add_option("--model", model, "model of the machine's errors: compensated, and verified on that machine");
  auto* offsets_option =
      c.add_option("--offsets", offsets, "thermal offsets (CSV) over the program's time or by operation");
  auto* thermal_option =
      c.add_option("--thermal", thermal_model,
                   "thermal model of `thermal fit`: offsets are predicted from --temperatures");
  thermal_option->excludes(offsets_option);
  c.add_option("--temperatures", temperatures,
               "temperature log (CSV) of the run: for --thermal, and for the sensors of --model");
  thermal_output.add_to(c);
  c.add_option(
       "--arcs", arcs,
       "circles of the CL file: as circles of the control (G2, G3) where it can run them (native), or as "
       "straight moves (moves). Default: the choice of the controller file, moves in all supplied files")
      ->check(CLI::IsMember({"native", "moves"}));
  c.add_option("--cycles", cycles,
               "drilling cycles: as cycles of the control (native), or as straight moves (moves). Default: "
               "as for --arcs")
      ->check(CLI::IsMember({"native", "moves"}));
  c.add_flag("--tilted-plane", tilted_plane,
             "write motions of one tool axis (3+2) in a tilted plane of the control");
  c.add_flag("--rtcp", rtcp, "write part coordinates for the control's tool-centre-point control");
  c.add_flag("--no-geometric", no_geometric, "leave the geometric effects of the model out");
  c.add_flag("--no-thermal", no_thermal, "leave the thermal effects of the model out");
  c.add_flag("--one-sided", one_sided, "adaptive: inserted points stay on the programmed path");
  c.add_flag("--thin", thin, "drop programmed points that the tolerance does not need");
  c.add_flag("--move-programmed-points", move_programmed_points,
             "adaptive: programmed points may move by up to the tolerance");
  c.add_flag("--no-certify", no_certify, "sample the deviations instead of proving a bound");
  c.add_flag("--no-verify", no_verify, "skip the check of the written program");
  c.add_flag("--accept-deviation", accept_deviation,
             "write a program even if it misses the tolerance (it is marked; exit code 1)");
  pole.add_to(c);
  c.add_option("--largest-correction-mm", largest_correction_mm,
               "with --model: refuse a larger correction of the linear axes as a mistake")
      ->check(above_zero())
      ->capture_default_str();
  for (const post::PathStage& stage : post::path_stages())
    c.add_option("--" + stage.name, path_stages[stage.name], stage.help)
        ->check(between(stage.least, stage.most));
  add_smoothing(c, smoothing);
  c.add_option(
       "--work-offset", work_offset,
       "work offset that the program calls: 1 (G54), 2, ... (default: SET/OFSETL of the CL file, else the "
       "machine file's)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1000}));
  c.add_option(
      "--program-name", program.text,
      "program name, for controls that name programs (default: PARTNO, else the name of the output file)");
  c.add_option("--program-number", program.number,
               "program number (O), for controls that number programs (default: the digits of the program "
               "name, else 1)")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{99999999}));
  tools.add_to(c);
  reading.add_to(c);
}

Result<std::optional<double>> smoothing_of(const std::string& text) {
  if (text == "off") return std::nullopt;
  if (text == "control") return 0.0;
  const auto within = parse_number(text);
  if (within && within.value > 0.0 && within.value <= kMostSmoothing_mm) return within.value;
  return fail(ErrorCode::wrong_use, "--smoothing: '" + text + "' is neither off nor control nor mm, up to " +
                                        shortest_text(kMostSmoothing_mm));
}

void add_smoothing(CLI::App& c, std::string& smoothing) {
  c.add_option(
       "--smoothing", smoothing,
       "path smoothing of the control ([path_mode] continuous, continuous_within): off, control (the "
       "control's own setting), or by how many mm it may round corners, in addition to --tolerance-mm")
      ->capture_default_str();
}

Result<post::PostOptions> PostCliOptions::resolve() const {
  post::PostOptions out;
  out.tolerance_mm = tolerance_mm;
  out.rapid_tolerance_mm = rapid_tolerance_mm;
  if (axis_tolerance_deg) out.axis_tolerance = Angle::degrees(*axis_tolerance_deg);
  out.nonlinear.method = *path::method_from_text(nonlinear);
  const auto named = path::predictor_from_text(predictor);
  if (!named) return fail(ErrorCode::wrong_use, "--predictor: '" + predictor + "' is no predictor");
  out.nonlinear.predictor = *named;
  out.nonlinear.one_sided = one_sided;
  out.nonlinear.thin = thin;
  out.nonlinear.move_programmed_points = move_programmed_points;
  out.nonlinear.certify = !no_certify;
  if ((one_sided || move_programmed_points) && out.nonlinear.method != path::Method::adaptive) {
    return fail(ErrorCode::wrong_use, std::string(one_sided ? "--one-sided" : "--move-programmed-points") +
                                          " belongs to --nonlinear adaptive");
  }
  if (thermal_output.form != "axis-values") {
    if (offsets.empty() && thermal_model.empty())
      return fail(ErrorCode::wrong_use, "--thermal-output needs --offsets or --thermal");
    // A shift of the work offset turns with the plane in some controls and not in others.
    if (tilted_plane)
      return fail(ErrorCode::wrong_use,
                  "--thermal-output " + thermal_output.form + " excludes --tilted-plane");
  }
  using path::ChoiceMethod;
  if (choice.starts_with("axis:")) {
    out.choice = ChoiceMethod::axis;
    out.choice_axis = choice.substr(5);
  } else if (choice == "global" || choice == "combined" || choice == "largest" || choice == "sum") {
    out.choice = choice == "global"     ? ChoiceMethod::global
                 : choice == "combined" ? ChoiceMethod::combined
                 : choice == "largest"  ? ChoiceMethod::largest
                                        : ChoiceMethod::sum;
  } else {
    return fail(ErrorCode::wrong_use,
                "--choice: '" + choice + "' is none of global, combined, largest, sum, axis:NAME");
  }
  out.feed = rtcp                             ? post::FeedOutput::tip
             : feed.starts_with("per-minute") ? post::FeedOutput::per_minute
                                              : post::FeedOutput::inverse;
  out.feeds_within_reach = !feed.ends_with("as-programmed");
  out.rtcp = rtcp;
  out.tools = tools.resolve(std::nullopt);
  out.largest_correction_mm = largest_correction_mm;
  out.work_offset = work_offset;
  const auto within = smoothing_of(smoothing);
  if (!within) return tl::unexpected(within.error());
  out.smoothing_mm = *within;
  if (!program.text.empty()) out.program.text = program.text;
  out.program.number = program.number;
  out.tilted_plane = tilted_plane;
  for (const auto& [name, value] : path_stages) {
    if (value) out.path_stages.push_back({name, *value});
  }
  if (!arcs.empty()) out.native_arcs = arcs == "native";
  if (!cycles.empty()) out.native_cycles = cycles == "native";
  out.pole = pole.resolve();
  out.default_feed_mm_s = default_feed_mm_min / kSecondsPerMinute;
  out.retract.way_mm = retract_mm;
  out.verify = !no_verify;
  out.cl = reading.resolve();
  return out;
}

std::string PostCliOptions::errors_line(bool compensated) const {
  return compensated ? "errors compensated: " + model : "errors none compensated";
}

std::string PostCliOptions::tolerance_line() const {
  return "nonlinear error " + nonlinear + ", tolerance " + shortest_text(tolerance_mm) + " mm";
}

std::vector<std::string> PostCliOptions::stage_lines() const {
  std::vector<std::string> out;
  for (const auto& [name, value] : path_stages) {
    if (value) out.push_back("--" + name + " " + shortest_text(*value));
  }
  return out;
}

std::string PostCliOptions::text() const {
  const auto number = [](const std::optional<double>& v) { return v ? shortest_text(*v) : std::string("-"); };
  std::string out = shortest_text(tolerance_mm) + " " + shortest_text(rapid_tolerance_mm) + " " +
                    number(axis_tolerance_deg) + " " + nonlinear + " " + predictor + " " + choice + " " +
                    feed + " " + model + " " + offsets + " " + thermal_model + " " + temperatures + " " +
                    shortest_text(default_feed_mm_min) + " " + shortest_text(retract_mm) + " " +
                    thermal_output.form + " " + shortest_text(pole.cone_deg) + " " +
                    shortest_text(pole.min_turn_deg) + " " + shortest_text(pole.tolerance_deg);
  for (const double limit :
       {thermal_output.limits.clamp_um, thermal_output.limits.slew_um_s, thermal_output.limits.dead_band_um})
    out += " " + shortest_text(limit);
  for (const bool flag : {rtcp, tilted_plane, one_sided, thin, move_programmed_points, no_certify, no_verify,
                          accept_deviation, no_geometric, no_thermal}) {
    out += flag ? " 1" : " 0";
  }
  for (const std::string& line : stage_lines()) out += " " + line;
  out += " " + shortest_text(largest_correction_mm) + " offset " + std::to_string(work_offset.value_or(0)) +
         " smoothing " + smoothing + " program " + program.text + " " +
         std::to_string(program.number.value_or(0));
  return out + " arcs " + arcs + " cycles " + cycles + " " + tools.text() + " " + reading.text() + "\n";
}

void PostCliOptions::set_offset_output(post::PostJob& job) const {
  job.offset_output = thermal_output.form == "work-offset"   ? post::OffsetOutput::work_offset
                      : thermal_output.form == "local-shift" ? post::OffsetOutput::local_shift
                      : thermal_output.form == "variables"   ? post::OffsetOutput::variables
                                                             : post::OffsetOutput::axis_values;
  job.offset_limits = thermal_output.limits.resolve();
}

}  // namespace trunnion::app
