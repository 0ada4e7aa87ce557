#pragma once
#include <vector>

#include "trunnion/post/path_stages.hpp"

namespace trunnion::post {

// One function a stage, in the file of its name.
PathStage longest_block();

/// All path stages in the order in which they act, with the reason for the place of each.
inline std::vector<PathStage> all_stages() {
  return {
      longest_block(),  // parts of parts are within it, too: it may stand anywhere
  };
}

}  // namespace trunnion::post
