#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::diagnosis {

/// What the plans below are made for.
struct StandardSetUp {
  std::vector<Vec3> balls_P;  // mm; a run for each (one-ball and two-ball set-ups)
  double u_random_mm = 1e-3;
  double feed_mm_s = 1000.0 / kSecondsPerMinute;  // of what is read while the axes move
  /// The path of the cone frustum: a circle of the tip, the tool along the cone.
  struct Cone {
    double radius_mm = 40.0;
    Angle half_apex = Angle::degrees(15.0);
    Angle inclination = Angle::degrees(10.0);  // of its axis to the table's normal
  } cone;
  std::vector<std::vector<ToolPose>> cuts;  // of `path`: of a part, each two poses or more
  std::size_t poses = 200;                  // along them, the ways between cuts left out
};

/// "rtest", "bk1", "bk2", "frustum", "path".
std::vector<std::string> standard_plan_kinds();

/// Measuring plans for a machine with two rotary axes under the part, as the standards' tests have them; a
/// ball's centre is followed by the tool, three displacements at each pose. `rtest`: poses that stand, the
/// inner axis once round at 0 of the outer one, then the outer axis through its travel at four places of the
/// inner. `bk1` and `bk2` (ISO 10791-6): the outer, the inner axis and the linear ones move together, there
/// and back, read on the fly along the axis, radially and tangentially, in directions that turn with the
/// part. `frustum` (ISO 10791-6 BK4, and the path of the piece of ISO 10791-7): all five axes, the tip on a
/// circle about the ball's place. `path`: the tip and the tool's direction of a given path, as that of the
/// S-shaped piece of ISO 10791-7, whose numbers only the standard has. The standards' own texts were not at
/// hand: this is what published papers say of them. Positions that the machine does not reach are left out of
/// `rtest`, `bk1` and `bk2`. Fails with wrong_input where the machine has no two such axes, the ball lies on
/// the axis, or the path leaves the travel.
Result<std::vector<PlanRun>> standard_plan(const Machine& machine, std::string_view kind,
                                           const StandardSetUp& set_up);

}  // namespace trunnion::diagnosis
