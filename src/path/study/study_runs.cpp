#include "trunnion/path/study.hpp"

namespace trunnion::path {
namespace {

// Starts a new cutting run behind the link from the last point to `to`.
void add_link(const Point& to, std::vector<StudyRun>& runs) {
  const Point from = runs.back().points.back();
  if (runs.back().points.size() < 2) runs.pop_back();
  runs.push_back({{from, to}, true});
  runs.push_back({{to}, false});
}

}  // namespace

Result<std::vector<StudyRun>> study_runs(const Machine& machine, const Vec3& tool_mm,
                                         const cl::Program& program) {
  std::vector<ChoicePoint> asked;
  for (const cl::Record& record : program.records) {
    const auto* motion = std::get_if<cl::Motion>(&record.data);
    if (motion != nullptr) asked.push_back({{motion->tip_P, motion->axis_P}, record.where, motion->rapid});
  }
  ChoiceOptions options;
  options.tool_mm = tool_mm;
  options.inverse.axis_resolution = program.resolution.axis;
  std::vector<ChosenPoint> chosen;
  ChoiceSummary summary;
  if (const auto done =
          choose_solutions(machine, {asked, JointVector(), program.file}, options, chosen, summary);
      !done) {
    return tl::unexpected(done.error());
  }
  std::vector<StudyRun> runs;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    Point p = point_at(asked[i], chosen[i].q);
    if (runs.empty()) {
      runs.push_back({{p}, false});
    } else if (asked[i].rapid || chosen[i].reconfigure) {
      add_link(p, runs);
    } else {
      runs.back().points.push_back(p);
    }
    if (chosen[i].q_leave == chosen[i].q) continue;
    p.q = chosen[i].q_leave;  // a turn in place at the pole
    runs.back().points.push_back(p);
  }
  if (!runs.empty() && runs.back().points.size() < 2) runs.pop_back();
  return runs;
}

}  // namespace trunnion::path
