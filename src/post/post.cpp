#include "trunnion/post/post.hpp"

#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {
namespace {

constexpr std::size_t kVerdictLength = 56;  // below the shortest comment that a controller file allows

std::string padded(std::string text) {
  text.resize(kVerdictLength, '.');
  return text;
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
  const std::size_t errors = diagnostics.error_count();
  Pipeline pipeline(job, options, sink, diagnostics);
  if (auto r = pipeline.begin(); !r) return tl::unexpected(r.error());
  cl::Reader reader(std::move(source), job.cl_file, options.cl, diagnostics);
  cl::Record record;
  std::optional<Error>
      failure;  // of the path; the reader goes on, since all findings in the CL file are to be told
  while (reader.next(record)) {
    if (failure || diagnostics.error_count() > errors) continue;
    if (auto r = pipeline.take(record, reader.resolution()); !r) failure = r.error();
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  if (failure) return tl::unexpected(*failure);
  return pipeline.finish();
}

}  // namespace trunnion::post
