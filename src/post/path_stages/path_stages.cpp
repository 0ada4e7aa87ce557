#include "trunnion/post/path_stages.hpp"

#include <algorithm>
#include <utility>

#include "post/path_stages/all_stages.hpp"

namespace trunnion::post {

std::span<const PathStage> path_stages() {
  static const std::vector<PathStage> all = all_stages();
  return all;
}

std::unique_ptr<cl::RecordSource> behind_stages(std::unique_ptr<cl::RecordSource> path,
                                                const std::vector<PathStageAtWork>& asked) {
  for (const PathStage& stage : path_stages()) {
    const auto at = std::find_if(asked.begin(), asked.end(),
                                 [&](const PathStageAtWork& use) { return use.name == stage.name; });
    if (at != asked.end()) path = stage.make(std::move(path), at->value);
  }
  return path;
}

}  // namespace trunnion::post
