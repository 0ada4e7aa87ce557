#include "trunnion/post/post_file.hpp"

#include <utility>

#include "trunnion/base/files.hpp"

namespace trunnion::post {
namespace {

// The output file, with the verdict put into its header in the end.
class ProgramFile {
 public:
  ProgramFile(AtomicFile file, const nc::Controller::Comments& comments)
      : file_(std::move(file)), begins_comment_(comments.open + (comments.close.empty() ? " " : "")) {}

  Result<void> take(std::string_view text) {
    find(verdict_placeholder(), text, verdict_at_);
    find(tools_placeholder(), text, tools_at_);
    size_ += text.size();
    return file_.write(text);
  }
  Result<void> finish(const PostReport& report, const FinishedText& written) {
    if (verdict_at_) {
      if (auto r = file_.overwrite(*verdict_at_, verdict_text(report)); !r) return r;
    }
    if (tools_at_) {
      if (auto r = file_.overwrite(*tools_at_, tools_text(report.tools)); !r) return r;
    }
    if (written) {
      if (auto r = file_.read_back(written); !r) return r;
    }
    return file_.commit();
  }

 private:
  void find(const std::string& placeholder, std::string_view text, std::optional<std::size_t>& found) const {
    if (found) return;
    const auto at = text.find(begins_comment_ + placeholder);
    if (at != std::string_view::npos) found = size_ + at + begins_comment_.size();
  }
  AtomicFile file_;
  std::string begins_comment_;  // other comments may hold the same words, but not at their beginning
  std::size_t size_ = 0;
  std::optional<std::size_t> verdict_at_, tools_at_;
};

}  // namespace

bool FileOutcome::only_deviates() const {
  return report && report->verification && report->verification->limits_ok() &&
         report->verification->points_missed == 0 && report->verification->unsafe_count == 0;
}

FileOutcome post_file(const PostJob& job, const PostOptions& options, const std::string& output,
                      bool accept_deviation, const FinishedText& written) {
  FileOutcome out;
  auto source = cl::open_source(job.cl_file);
  if (!source) {
    out.error = source.error();
    return out;
  }
  auto opened = AtomicFile::create(output);
  if (!opened) {
    out.error = opened.error();
    return out;
  }
  ProgramFile file(std::move(*opened), job.controller->comments);
  PostJob named = job;
  if (named.output.empty()) named.output = output;
  auto report = post(
      std::move(*source), named, options, [&](std::string_view text) { return file.take(text); },
      out.diagnostics);
  if (!report) {
    out.error = report.error();
    return out;
  }
  out.report = std::move(*report);
  out.passed = !out.report->verification || out.report->verification->passed();
  if (!out.passed && !(accept_deviation && out.only_deviates())) return out;
  if (auto finished = file.finish(*out.report, written); !finished) {
    out.error = finished.error();
    return out;
  }
  out.written = true;
  return out;
}

}  // namespace trunnion::post
