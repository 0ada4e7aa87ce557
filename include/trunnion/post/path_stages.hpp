#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"

namespace trunnion::post {

/// A stage between the reader and the choice of the joints: records in, records out. It is asked for by an
/// option of its own, `--NAME VALUE`, of `post` and `batch` alike.
///
/// It may put motions on the path (`cl::Motion::part`). It may not move, drop or change those that are there:
/// the program is judged by them, and nothing of what a stage has added is known to the verification.
struct PathStage {
  std::string name;  // of the option, its unit at the end
  std::string help;  // one line of --help
  /// The values that it takes, both included.
  double least = 0.0;
  double most = 0.0;
  /// What stands in place of `path`, at such a value.
  std::function<std::unique_ptr<cl::RecordSource>(std::unique_ptr<cl::RecordSource> path, double value)> make;
};

/// A stage that is asked for.
struct PathStageAtWork {
  std::string name;
  double value = 0.0;
};

/// All there are, in the order in which they act. `check_options` refuses other names.
std::span<const PathStage> path_stages();

/// `path` behind all stages that are asked for.
std::unique_ptr<cl::RecordSource> behind_stages(std::unique_ptr<cl::RecordSource> path,
                                                const std::vector<PathStageAtWork>& asked);

}  // namespace trunnion::post
