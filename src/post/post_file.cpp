#include "trunnion/post/post_file.hpp"

#include <utility>

#include "trunnion/base/files.hpp"

namespace trunnion::post {
namespace {

// The output file, with the verdict put into its header in the end.
class ProgramFile {
 public:
  explicit ProgramFile(AtomicFile file) : file_(std::move(file)) {}

  Result<void> take(std::string_view text) {
    if (!verdict_at_) {
      const auto at = text.find(verdict_placeholder());
      if (at != std::string_view::npos) verdict_at_ = size_ + at;
    }
    size_ += text.size();
    return file_.write(text);
  }
  Result<void> finish(const std::string& verdict, const FinishedText& written) {
    if (verdict_at_) {
      if (auto r = file_.overwrite(*verdict_at_, verdict); !r) return r;
    }
    if (written) {
      if (auto r = file_.read_back(written); !r) return r;
    }
    return file_.commit();
  }

 private:
  AtomicFile file_;
  std::size_t size_ = 0;
  std::optional<std::size_t> verdict_at_;
};

}  // namespace

bool FileOutcome::only_deviates() const {
  return report && report->verification && report->verification->limits_ok() &&
         report->verification->points_missed == 0;
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
  ProgramFile file(std::move(*opened));
  auto report = post(
      std::move(*source), job, options, [&](std::string_view text) { return file.take(text); },
      out.diagnostics);
  if (!report) {
    out.error = report.error();
    return out;
  }
  out.report = std::move(*report);
  out.passed = !out.report->verification || out.report->verification->passed();
  if (!out.passed && !(accept_deviation && out.only_deviates())) return out;
  if (auto finished = file.finish(verdict_text(*out.report), written); !finished) {
    out.error = finished.error();
    return out;
  }
  out.written = true;
  return out;
}

}  // namespace trunnion::post
