#pragma once
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// What an axis does for a positive command, in words a person can check at the machine.
struct AxisWords {
  std::string name;
  std::string motion;  // "the table turns about machine +X: its side towards +Y goes up (+Z)"
  std::string limits;  // "-30.0000 deg to 120.0000 deg", "turns for ever"
  std::string rapid;   // "36000 mm/min", "not given"
};

std::vector<AxisWords> describe_axes(const Machine& machine);

/// A small program in the words of `controller` that moves one axis at a time a little and says in a comment
/// before each move what must be seen, with a stop after it. To be run without a tool and a part, at low
/// override. Starts from the middle of the travels.
Result<std::string> proving_program(const Machine& machine, const nc::Controller& controller);

}  // namespace trunnion::post
