#include "trunnion/post/post.hpp"

#include <algorithm>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/program.hpp"

namespace trunnion::post {
namespace {

constexpr std::size_t kVerdictLength = 56;  // below the shortest comment that a controller file allows

std::string padded(const std::string& text) {
  std::string out(kVerdictLength, '.');
  out.replace(0, std::min(text.size(), out.size()), text, 0, out.size());
  return out;
}

}  // namespace

std::string verdict_placeholder() {
  return padded("VERIFICATION PENDING ");
}

std::string verdict_text(const PostReport& report) {
  if (!report.verification) return padded("NOT VERIFIED ");
  const VerifyReport& v = *report.verification;
  const double tip = std::max(v.certified_tip_deviation_mm, v.max_point_deviation_mm);
  return padded((v.passed() ? "WITHIN TOLERANCE: " : "NOT WITHIN TOLERANCE: ") + fixed_text(tip, 6) + " OF " +
                fixed_text(v.tolerance_mm, 6) + " MM ");
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
  Program program(std::move(source), job, options, sink, diagnostics);
  return program.run();
}

}  // namespace trunnion::post
