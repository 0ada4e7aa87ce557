#include "post/judging/read_back.hpp"

#include <utility>

namespace trunnion::post {
namespace {

VerifyOptions verify_options(const PostJob& job, const PostOptions& options, const ModelEvaluator* errors) {
  VerifyOptions v;
  v.tolerance_mm = options.tolerance_mm;
  v.rapid_tolerance_mm = options.rapid_tolerance_mm;
  v.axis_tolerance = options.axis_tolerance.value_or(job.machine->axis_tolerance);
  v.pole = options.pole;
  v.certify = options.nonlinear.certify;
  v.truth = errors;
  v.lag_s = job.lag_s;
  v.temperatures.of_truth = job.temperatures;
  v.offsets = job.offsets;
  v.offset_limits = job.offset_limits;
  if (job.run_time_drift != nullptr) v.temperatures.of_program = &job.run_time_drift->history;
  v.tools = options.tools;
  v.work_offset = options.work_offset;
  v.smoothing_mm = options.smoothing_mm;
  v.default_feed_mm_s = options.default_feed_mm_s;
  v.collect = options.collect;
  return v;
}

}  // namespace

ReadBack::ReadBack(const PostJob& job, const PostOptions& options, const TextSink& sink,
                   const ModelEvaluator* errors)
    : sink_(sink), cl_file_(job.cl_file) {
  if (!options.verify) return;
  const std::string nc_file = "<program>";
  verifier_ = std::make_unique<Verifier>(*job.machine, *job.controller, verify_options(job, options, errors),
                                         nc_file, diagnostics_);
  if (errors != nullptr || job.offsets != nullptr) verifier_->judge_nominal_too();
}

void ReadBack::expect(const Chunk& chunk, std::size_t first, std::size_t end) {
  if (first == end) return;
  InForce said(chunk.words, first);
  for (std::size_t next = first; next < end;) {
    const MotionWords& words = said.at(next).words;
    const std::size_t begin = std::exchange(next, said.end(end));
    // What path stages have added is none of the CL file's: the program is judged by the motions of the
    // text.
    if (words.part.ends_inside) continue;
    cl::Feed feed = words.feed;
    if (feed.mode == cl::FeedMode::inverse) feed.value *= words.part.share;
    const auto of = [&](const auto& column) { return std::span(column).subspan(begin, next - begin); };
    const std::span<const Vec3> none;
    verifier_->expect({of(chunk.points), chunk.programmed_axes_P.empty() ? none : of(chunk.programmed_axes_P),
                       feed, words.step});
  }
}

void ReadBack::expect(const Chunk& chunk) {
  if (!verifier_) return;
  for (const Event& event : chunk.events) {
    if (const auto* change = std::get_if<cl::ToolChange>(&event.record.data))
      verifier_->expect_tool(change->number, *change->gauge_length_mm);
  }
  if (!chunk.tool.control_adds_length) verifier_->expect_no_length();
  std::size_t done = 0;
  for (const Event& event : chunk.events) {
    expect(chunk, done, event.before);
    done = event.before;
    verifier_->expect(event.record);
  }
  expect(chunk, done, chunk.size());
  verifier_->text(unread_);
  unread_.clear();
}

Result<void> ReadBack::pass_on(Chunk& chunk) {
  expect(chunk);
  if (chunk.text.empty()) return {};
  auto done = sink_(chunk.text);
  if (verifier_) unread_.swap(chunk.text);
  return done;
}

Result<void> ReadBack::finish(PostReport& report) {
  if (!verifier_) return {};
  verifier_->text(unread_);
  auto found = verifier_->finish();
  if (!found) return tl::unexpected(found.error());
  // As `verify` has it: what cannot be judged is not within tolerance.
  if (diagnostics_.has_errors())
    return fail(ErrorCode::wrong_input,
                "no program is written: the verification finds an error in the words of what was made",
                cl_file_);
  report.verification = std::move(found->report);
  report.nominal_verification = std::move(found->nominal);
  return {};
}

}  // namespace trunnion::post
