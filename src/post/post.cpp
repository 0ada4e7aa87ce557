#include "trunnion/post/post.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/effects/axis_lags.hpp"

#include "post/program.hpp"

namespace trunnion::post {
namespace {

constexpr std::size_t kVerdictLength = 56;  // below the shortest comment that a controller file allows

// Servo drives follow within some ms; what is more is a wrong unit, or two clocks.
constexpr double kMostLag_s = 0.05;

std::string padded(const std::string& text) {
  std::string out(kVerdictLength, '.');
  out.replace(0, std::min(text.size(), out.size()), text, 0, out.size());
  return out;
}

// Names and values, and what else drops, moves or tilts the points of the file.
Result<void> check_stages(const PostOptions& options) {
  const auto refuse = [](const std::string& why) { return fail(ErrorCode::wrong_use, why); };
  for (const PathStageAtWork& asked : options.path_stages) {
    const auto all = path_stages();
    const auto stage =
        std::find_if(all.begin(), all.end(), [&](const PathStage& s) { return s.name == asked.name; });
    const std::string option = "--" + asked.name;
    if (stage == all.end()) return refuse(option + ": there is no such stage of the path");
    if (!(asked.value >= stage->least && asked.value <= stage->most))
      return refuse(option + ": " + shortest_text(asked.value) + " is not between " +
                    shortest_text(stage->least) + " and " + shortest_text(stage->most));
    const std::string adds = ", and " + option + " adds some: one of the two";
    if (options.nonlinear.thin) return refuse("--thin drops points" + adds);
    if (options.nonlinear.move_programmed_points)
      return refuse("--move-programmed-points moves points" + adds);
    if (options.pole.tolerance.rad() > 0.0)
      return refuse("--pole-tolerance-deg tilts the tool at points" + adds);
  }
  return {};
}

}  // namespace

std::string verdict_placeholder() {
  return padded("VERIFICATION PENDING ");
}

std::string tools_placeholder() {
  return padded("GAUGE LENGTHS PENDING ");
}

std::string tools_text(const std::vector<LoadedTool>& tools) {
  const auto more = [](std::size_t count) { return " AND " + std::to_string(count) + " MORE "; };
  std::string out = tools.size() > 1 ? "GAUGE LENGTHS" : "GAUGE LENGTH";
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const LoadedTool& tool = tools[i];
    std::string text = i == 0 ? " " : ", ";
    text += tool.number ? "T" + std::to_string(*tool.number) + " " : "";
    text += gauge_text(tool.length_mm);
    if (tool.number && tool.length_register != *tool.number)
      text += " REGISTER " + std::to_string(tool.length_register);
    if (!tool.number) text += ", NO TOOL IS LOADED";
    const std::size_t left = tools.size() - i;
    const std::size_t room = left > 1 ? more(left - 1).size() : 1;
    if (out.size() + text.size() + room > kVerdictLength) {
      out += more(left);
      break;
    }
    out += text;
  }
  return padded(out + (out.ends_with(' ') ? "" : " "));
}

std::string verdict_text(const PostReport& report) {
  if (!report.verification) return padded("NOT VERIFIED ");
  const VerifyReport& v = *report.verification;
  return padded((v.passed() ? "WITHIN TOLERANCE: " : "NOT WITHIN TOLERANCE: ") +
                fixed_text(v.largest_deviation_mm(), 6) + " OF " + fixed_text(v.tolerance_mm, 6) + " MM ");
}

Result<void> check_options(const PostOptions& options, const Machine& machine,
                           const nc::Controller& controller) {
  const auto refuse = [](const std::string& why) { return fail(ErrorCode::wrong_use, why); };
  if (options.rtcp && !controller.has_tcp())
    return refuse("--rtcp: the control '" + controller.name + "' has no tool-centre-point control");
  if (options.tilted_plane && options.rtcp)
    return refuse("--tilted-plane and --rtcp: a program is written in one of the two");
  if (options.rtcp && (options.nonlinear.thin || options.nonlinear.move_programmed_points)) {
    return refuse(std::string(options.nonlinear.thin ? "--thin" : "--move-programmed-points") +
                  " and --rtcp: under tool-centre-point control every programmed point stays where it is");
  }
  if (auto checked = check_stages(options); !checked) return checked;
  if (machine.output_point == OutputPoint::spindle && controller.length.automatic) {
    return refuse(
        "the machine file asks for words of the spindle's gauge point ([output] point), and the control '" +
        controller.name + "' adds the length of every tool that it loads: it needs point = \"tip\"");
  }
  if (machine.output_point == OutputPoint::spindle && (options.rtcp || options.tilted_plane)) {
    return refuse(std::string(options.rtcp ? "--rtcp" : "--tilted-plane") +
                  ": the control needs the tool's length for it, and the machine file asks for words of the "
                  "spindle's gauge point, with length compensation off ([output] point): it needs point = "
                  "\"tip\"");
  }
  if (options.tilted_plane && !controller.has_tilted_plane())
    return refuse("--tilted-plane: the control '" + controller.name + "' has no tilted plane");
  const auto has_axis = [&](const Axis& axis) {
    return axis.kind == AxisKind::rotary && axis.name == options.choice_axis;
  };
  if (options.choice == path::ChoiceMethod::axis &&
      std::none_of(machine.axes.begin(), machine.axes.end(), has_axis)) {
    return refuse("--choice: the machine has no rotary axis '" + options.choice_axis + "'");
  }
  return {};
}

Result<PostReport> post(std::unique_ptr<cl::TextSource> source, const PostJob& job,
                        const PostOptions& options, const TextSink& sink, Diagnostics& diagnostics) {
  if (auto checked = check_options(options, *job.machine, *job.controller); !checked)
    return tl::unexpected(checked.error());
  // Words of the part are not led: there a delay is corrected by the speed, as an error at a place.
  const bool leads = job.model != nullptr && !options.rtcp && !options.tilted_plane;
  if (!leads && job.model != nullptr && job.model->lag_of_all_axes_s != 0.0)
    diagnostics.warning(
        job.model->file, {},
        "lag_of_all_axes_ms: words of the part's frame are not led: corners and curves are cut "
        "inside by what the axes are late");
  if (!leads) return Program(std::move(source), job, options, sink, diagnostics).run();
  // What follows the command in time is led in time; the errors at a place are all else.
  const Model at_place = without_servo_effects(*job.model);
  PostJob with_lags = job;
  const JointVector lags = axis_lags(*job.model);
  for (AxisId id = 0; id < job.machine->axes.size(); ++id) {
    if (!(std::abs(lags[id]) <= kMostLag_s))
      return fail(ErrorCode::wrong_input,
                  "the model has a delay (servo_lag, lag_of_all_axes_ms) of " + shortest_text(lags[id]) +
                      " s for " + job.machine->axes[id].name + ": more than " + shortest_text(kMostLag_s) +
                      " s is no servo's, and words are not led by it",
                  job.model->file);
    with_lags.lag_s[id] += lags[id];
  }
  with_lags.model = at_place.effects.empty() ? nullptr : &at_place;
  return Program(std::move(source), with_lags, options, sink, diagnostics).run();
}

}  // namespace trunnion::post
