#include "trunnion/report/batch_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

const char* state_name(post::BatchState state) {
  constexpr const char* kNames[] = {"posted", "skipped", "failed", "would post", "not run"};
  return kNames[static_cast<std::size_t>(state)];
}

// More lines than this are no summary: the JSON has them all.
constexpr std::size_t kMaxLines = 40;

}  // namespace

BatchCounts count(const std::vector<post::BatchResult>& results) {
  BatchCounts out;
  for (const auto& r : results) {
    std::size_t* const slots[] = {&out.posted, &out.skipped, &out.failed, &out.would_post, &out.not_run};
    ++*slots[static_cast<std::size_t>(r.state)];
  }
  return out;
}

std::string batch_table(const std::vector<post::BatchResult>& results) {
  std::string out;
  std::size_t width = 0;
  std::size_t lines = 0;
  for (const auto& r : results) width = std::max(width, r.item.output.size());
  for (const auto& r : results) {
    if (r.state == post::BatchState::skipped) continue;
    if (++lines > kMaxLines) continue;
    std::string name = r.item.output;
    name.resize(width, ' ');
    out += name + "  " + state_name(r.state);
    if (r.outcome.report && r.outcome.report->verification) {
      out += "  " + std::to_string(r.outcome.report->points_in) + " + " +
             std::to_string(r.outcome.report->points_inserted) + " points, tip " +
             fixed_text(r.outcome.report->verification->certified_tip_deviation_mm, 6) + " mm";
    }
    out += "\n";
  }
  if (lines > kMaxLines) out += "... and " + std::to_string(lines - kMaxLines) + " more (--json lists all)\n";
  return out + batch_summary(results);
}

std::string batch_summary(const std::vector<post::BatchResult>& results) {
  const BatchCounts c = count(results);
  std::string out = std::to_string(results.size()) + (results.size() == 1 ? " file: " : " files: ") +
                    std::to_string(c.posted) + " posted, " + std::to_string(c.skipped) + " unchanged, " +
                    std::to_string(c.failed) + " failed";
  if (c.would_post > 0) out += ", " + std::to_string(c.would_post) + " to be posted";
  if (c.not_run > 0) out += ", " + std::to_string(c.not_run) + " not run (interrupted)";
  return out;
}

std::string batch_json(const std::vector<post::BatchResult>& results) {
  nlohmann::ordered_json out;
  const BatchCounts c = count(results);
  out["files"] = results.size();
  out["posted"] = c.posted;
  out["skipped"] = c.skipped;
  out["failed"] = c.failed;
  out["would_post"] = c.would_post;
  out["not_run"] = c.not_run;
  auto& list = out["items"] = nlohmann::ordered_json::array();
  for (const auto& r : results) {
    nlohmann::ordered_json item;
    item["input"] = r.item.input;
    item["output"] = r.item.output;
    item["state"] = state_name(r.state);
    item["seconds"] = r.seconds;
    if (r.program_number > 0) item["program_number"] = r.program_number;
    if (r.outcome.error) item["error"] = r.outcome.error->text();
    for (const Finding& finding : r.outcome.diagnostics.findings()) {
      if (finding.severity == Severity::warning) item["warnings"].push_back(finding.text());
    }
    if (r.outcome.report) {
      item["written"] = r.outcome.written;
      item["points_in"] = r.outcome.report->points_in;
      item["points_inserted"] = r.outcome.report->points_inserted;
      if (r.outcome.report->verification) {
        item["certified_tip_deviation_mm"] = r.outcome.report->verification->certified_tip_deviation_mm;
        item["within_tolerance"] = r.outcome.report->verification->within_tolerance();
      }
    }
    list.push_back(item);
  }
  return json_text(out);
}

}  // namespace trunnion::report
