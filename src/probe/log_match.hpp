#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/probe/strokes.hpp"

namespace trunnion::probe {

/// A touch of the program with the line that the control wrote for it.
struct MatchedTouch {
  Vec3 at_mm = Vec3::Zero();  // positions of the linear axes X, Y, Z
  double left_mm = 0.0;       // from there to the end that the stroke had not reached
  std::uint32_t line = 0;     // of the log
};

/// Each touch with its line, in their order. Fails with wrong_input, the line and the pose.
Result<std::vector<MatchedTouch>> match_log(const Machine& machine, const Strokes& strokes,
                                            std::string_view log, const std::string& file);

/// Positions of X, Y and Z of `q`, and `q` with them replaced.
Vec3 linear_of(const Machine& machine, const JointVector& q);
JointVector with_linear(const Machine& machine, const JointVector& q, const Vec3& xyz_mm);

}  // namespace trunnion::probe
