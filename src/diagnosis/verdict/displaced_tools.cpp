#include <algorithm>

#include "diagnosis/verdict/unrecorded.hpp"

// One tool or ball of several whose length or run-out is wrong differs from the others by a constant, and so
// does a temperature that differs between the runs and hardly moves in them.
namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kMostTools = 8;      // more are no longer a few constants
constexpr double kLargestError_mm = 10.0;  // more is another tool: a mistake of the files

// Which tool or ball took each reading: the places of the measured point, numbered.
std::vector<std::size_t> tool_of_readings(const Observations& o, std::size_t& count) {
  std::vector<Vec3> tools;
  std::vector<std::size_t> out;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const Vec3& tool = o.data().rows[o.reading(i).row].tool_mm;
    const auto at = std::find(tools.begin(), tools.end(), tool);
    out.push_back(static_cast<std::size_t>(at - tools.begin()));
    if (at == tools.end()) tools.push_back(tool);
  }
  count = tools.size();
  return out;
}

}  // namespace

std::vector<UnrecordedCondition> displaced_tools(const Observations& o) {
  std::size_t count = 0;
  const std::vector<std::size_t> tools = tool_of_readings(o, count);
  if (count < 2 || count > kMostTools) return {};
  UnrecordedCondition out;
  out.what =
      "the measured point of one tool or ball (its length, or its place beside the spindle's axis) that is "
      "wrong by a constant";
  out.remedy =
      "Check the length and the run-out of each tool and ball, or measure one ball place with all of them at "
      "one temperature.";
  out.covariate = "tool";
  out.stands_for = is_thermal;
  // Of each tool but the first: displaced in the spindle. What all tools share is no difference between them.
  out.columns = [&o, tools, count](double) {
    const MatrixXd& spindle = o.response(o.link_count() - 2);
    MatrixXd columns = MatrixXd::Zero(o.size(), 3 * static_cast<Eigen::Index>(count - 1));
    for (Eigen::Index i = 0; i < o.size(); ++i) {
      const std::size_t tool = tools[static_cast<std::size_t>(i)];
      if (tool > 0)
        columns.block(i, 3 * static_cast<Eigen::Index>(tool - 1), 1, 3) = spindle.block(i, 0, 1, 3);
    }
    return columns;
  };
  out.largest = VectorXd::Constant(3 * static_cast<Eigen::Index>(count - 1), kLargestError_mm);
  return {std::move(out)};
}

}  // namespace trunnion::diagnosis
