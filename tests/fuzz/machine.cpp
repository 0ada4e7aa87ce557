// Machine files; what is accepted can be placed and solved.
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/safe_height.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto machine = parse_machine({reinterpret_cast<const char*>(data), size}, "input.toml", diagnostics);
  if (!machine) return 0;
  const ToolPose at = tool_pose(forward(*machine, JointVector{}));
  fuzz::hold(at.tip_P.allFinite(), "the tool is somewhere");
  return 0;
}
