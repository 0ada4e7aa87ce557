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

Result<PostReport> post(std::unique_ptr<cl::TextSource> source, const PostJob& job,
                        const PostOptions& options, const TextSink& sink, Diagnostics& diagnostics) {
  if (options.rtcp && !job.controller->has_tcp()) {
    return fail(ErrorCode::wrong_use,
                "--rtcp: the control '" + job.controller->name + "' has no tool-centre-point control");
  }
  if (options.tilted_plane && options.rtcp)
    return fail(ErrorCode::wrong_use, "--tilted-plane and --rtcp: a program is written in one of the two");
  if (options.rtcp && (options.nonlinear.thin || options.nonlinear.move_programmed_points))
    return fail(ErrorCode::wrong_use,
                std::string(options.nonlinear.thin ? "--thin" : "--move-programmed-points") +
                    " and --rtcp: under tool-centre-point control every programmed point stays where it is");
  if (options.tilted_plane && !job.controller->has_tilted_plane()) {
    return fail(ErrorCode::wrong_use,
                "--tilted-plane: the control '" + job.controller->name + "' has no tilted plane");
  }
  Program program(std::move(source), job, options, sink, diagnostics);
  return program.run();
}

}  // namespace trunnion::post
