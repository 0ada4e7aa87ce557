#pragma once
#include <string>
#include <vector>

#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A place between two points of a path at which the tool leaves the part, and the rotary axes turn from one
/// position to another that holds the same tool axis.
struct TurnAway {
  double share = 0.0;  // of the way between the two points: 0 at the first, 1 at the second
  ToolPose pose;       // tip on the straight line, tool axis on the great circle between them
  JointVector before;  // how the axes come there
  JointVector after;   // how they go on
};

/// Whether the axes follow the tool axis from `a` to `b` while cutting: without a jump of the branch and
/// without a turn back. `options.axis_tolerance` is how far from the great circle.
bool connects(const Machine& machine, const Point& a, const Point& b, const ChoiceOptions& options);

/// The places where the tool has to leave the part on its way from `from` to `to`, so that
/// between them it is cut within the limits of the rotary axes on one branch: none when `connects`; one at
/// the first or the second point where that is enough; else as few as there can be, each as late as it goes.
/// Fails with check_failed when no position within the limits holds a tool axis on the way: axis, by how
/// much, and the share of the way.
Result<std::vector<TurnAway>> plan_turns(const Machine& machine, const Point& from, const Point& to,
                                         const ChoiceOptions& options);

}  // namespace trunnion::path
