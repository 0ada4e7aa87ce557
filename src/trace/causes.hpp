#pragma once
#include <vector>

#include "trace/followed.hpp"

// Private to the layer: why the axes left the program, as far as the rows show it.
namespace trunnion::trace {

/// What was found, and what the delays of the axes are.
struct Findings {
  std::vector<Cause> causes;
  std::vector<std::string> remarks;
};

/// README of this layer, "Why". `scatter` of the rows, scaled (standard deviation of one coordinate).
Findings find_causes(const Followed& followed, const JointPath& path, const Machine& machine,
                     const Plan& plan, double scatter);

}  // namespace trunnion::trace
