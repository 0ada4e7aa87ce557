#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion {
class RotarySolver;
}

namespace trunnion::path {

/// How the rotary positions are chosen where the machine offers several.
enum class ChoiceMethod : std::uint8_t {
  global,    // shortest path over all points between two rapids: least sum of axis times
  combined,  // local, point by point: least root of the sum of squares of the rotary travels
  largest,   // local: least largest rotary travel
  sum,       // local: least sum of the rotary travels
  axis       // local: least travel of one named axis
};

struct ChoiceOptions {
  ChoiceMethod method = ChoiceMethod::global;
  std::string axis;  // for ChoiceMethod::axis
  InverseOptions inverse;
  Vec3 tool_mm = Vec3::Zero();  // from S to the tip
  /// How far the tool axis may pass the pole for its path to count as leading through it.
  Angle axis_tolerance = Angle::degrees(0.05);
};

/// One point of a path whose joints are to be chosen.
struct ChoicePoint {
  ToolPose pose;
  SourceRef where;
  bool rapid = false;  // the motion that ends here is a rapid
};

/// The point of a path that it becomes with these joints.
inline Point point_at(const ChoicePoint& point, const JointVector& q) {
  Point out;
  out.q = q;
  out.tip_P = point.pose.tip_P;
  out.axis_P = point.pose.axis_P;
  out.where = point.where;
  return out;
}

/// Points whose joints are chosen together, and where the axes stand before the first.
struct ChoiceRun {
  std::span<const ChoicePoint> points;
  JointVector seed;
  std::string cl_file;  // for messages
};

struct ChosenPoint {
  JointVector q;
  std::uint8_t branch = 0;
  bool singular = false;  // C was kept from the point before
  /// The motion that ends here cannot be made while cutting: a rotary axis must turn back, or the branch
  /// changes beside the pole. The tool has to leave the part, the axes turn, and the tool comes back
  /// (`plan_turns`).
  bool reconfigure = false;
  /// At the pole: where C must stand before the path goes on. The same as `q` but where C has to turn in
  /// place (the tool stands along C, so that the part's surface is not touched): X and Y follow the turn.
  JointVector q_leave;
  KnownSines sines;
};

/// What a choice did, for the report.
struct ChoiceSummary {
  std::size_t branch_changes = 0;    // between points that were not singular
  std::size_t reconfigurations = 0;  // flagged points
  std::size_t pole_points = 0;
  std::size_t turns_in_place = 0;  // C turned at one point of the pole
  double rotary_travel_rad = 0.0;  // sum over the rotary axes
  double axis_time_s = 0.0;        // sum over all axes of travel / rapid rate: what `global` makes least
  bool goes_on = false;  // set by the caller: the next points go on from the last ones, on `last_branch`
  std::uint8_t last_branch = 0;
};

/// Joint positions for a run of points (one operation, or the points between two rapids).
///
/// Pole: C is free there, so it takes the position in which the path leaves the pole: at once when a rapid
/// leads there, spread over the way along the pole when the tool cuts into it and out of it, in place
/// (`q_leave`) when there is no such way.
///
/// `global` is a shortest path (dynamic programming) over all branches and all turns within the limits; the
/// cost of a step is the sum over the axes of travel / rapid rate, a step that needs a reconfiguration costs
/// kReconfigureSeconds more, and with equal cost the position nearer to the middle of the limits wins.
/// O(points x candidates^2), candidates <= 8 in practice. Leaves one ChosenPoint per point in `out`, all of
/// it written anew, and adds to `summary`. Linear limits are not a criterion (see limit_violations). Fails
/// with check_failed for a point that no branch reaches within the rotary limits: CL line, axis, by how much.
Result<void> choose_solutions(const Machine& machine, const ChoiceRun& run, const ChoiceOptions& options,
                              std::vector<ChosenPoint>& out, ChoiceSummary& summary);

/// Whether exactly one position (whole turns of an axis without limits aside) reaches `pose`, and C is
/// determined there: whatever comes after it, the choice up to it stands, so that a run may be cut behind it
/// without a change of the result. `solver`: of `machine`.
bool settles_choice(const Machine& machine, const RotarySolver& solver, const ToolPose& pose,
                    const ChoiceOptions& options);

/// Time that a retract, a turn and a re-engagement take beside the turn itself; large against any detour
/// worth making while cutting.
inline constexpr double kReconfigureSeconds = 60.0;

}  // namespace trunnion::path
