#include <memory>
#include <utility>

#include "post/path_stages/all_stages.hpp"
#include "post/path_stages/divided_path.hpp"

namespace trunnion::post {

PathStage longest_block() {
  // Ten digits of words of three decimals: below that a block's direction is that of its rounding.
  constexpr double kLeast_mm = 0.01;
  constexpr double kMost_mm = 10000.0;  // farther than machines go
  return {"longest-block-mm",
          "insert points on the path, so that the tip cuts no farther than this in one block", kLeast_mm,
          kMost_mm,
          [](std::unique_ptr<cl::RecordSource> path, double longest_mm) -> std::unique_ptr<cl::RecordSource> {
            return std::make_unique<DividedPath>(std::move(path),
                                                 [longest_mm](const ToolPose& from, const ToolPose& to) {
                                                   return (to.tip_P - from.tip_P).norm() / longest_mm;
                                                 });
          }};
}

}  // namespace trunnion::post
