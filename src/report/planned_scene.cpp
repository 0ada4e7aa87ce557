// The poses of planned runs on the machine.
#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

constexpr double kDrawnTable_mm = 120.0;  // radius, of a machine file without a table
constexpr double kBall = 0.06;            // its drawn radius, of the table's

std::string pose_text(const Machine& machine, const std::string& run, const JointVector& q) {
  std::string out;
  // The rotary axes first: they are what tells poses apart.
  std::vector<AxisId> order = machine.rotary_axes();
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    if (machine.axes[id].kind == AxisKind::linear) order.push_back(id);
  for (const AxisId id : order) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    out += (out.empty() ? "" : " ") + machine.axes[id].name +
           fixed_text(q[id] * (rotary ? kDegreePerRad : 1.0), rotary ? 2 : 3);
  }
  if (!run.empty()) out += "  " + run;
  return out;
}

// With all axes at zero the spindle's nose may be at the part's zero, the tool within the table: a machine
// that is looked at stands with its tool clear above the part.
std::vector<double> clear_of_part(const Machine& machine, double size_mm) {
  constexpr double kUpright = 0.9;  // cosine between an axis and the tool
  constexpr double kAbove = 0.6;    // of the table's radius
  std::vector<double> out(machine.axes.size(), 0.0);
  const Pose X_MP = part_in_machine(machine, JointVector{});
  const Vec3 tip = X_MP * forward(machine, JointVector{}, machine.tool_vector()).p;
  const double lift_mm = kAbove * size_mm - (tip - X_MP.p).z();
  if (lift_mm <= 0.0) return out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    const double up = axis.direction.z() * (axis.carries_part ? -1.0 : 1.0);
    if (axis.kind != AxisKind::linear || std::abs(up) < kUpright) continue;
    const double wanted = lift_mm / up;
    out[id] = axis.has_limits() ? std::clamp(wanted, axis.min, axis.max) : wanted;
    break;
  }
  return out;
}

}  // namespace

void add_stand(std::vector<Scene::Stand>& stands, const Machine& machine, const std::string& run,
               const JointVector& q) {
  Scene::Stand stand{pose_text(machine, run, q), {}};
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    stand.q.push_back(q[id] * (machine.axes[id].kind == AxisKind::rotary ? kDegreePerRad : 1.0));
  if (stands.empty() || stands.back().text != stand.text) stands.push_back(std::move(stand));
}

Scene stands_scene(const Machine& machine, std::vector<Scene::Stand> stands) {
  Scene out = machine_solids(machine, kDrawnTable_mm);
  out.by_hand.stands = std::move(stands);
  out.title = "The poses, on the machine";
  out.caption =
      "Choose a pose in the list, or step with comma and full stop: the machine goes there. Positions are "
      "those of the axes, in mm and degrees. Bodies only show which body carries which.";
  return out;
}

Scene jog_scene(const Machine& machine, const std::vector<BodyMesh>& meshes) {
  Scene out = machine_solids(machine, kDrawnTable_mm);
  put_meshes(out, meshes);
  out.by_hand.start = clear_of_part(machine, out.size_mm);
  out.title = "The machine, moved by hand";
  out.caption =
      "Move an axis and compare with the machine: the arrow shows the motion of its body on a + command. "
      "Bodies have the sizes of the machine file if it gives them; else they only show which body carries "
      "which.";
  return out;
}

std::optional<Scene> planned_scene(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs) {
  Machine drawn = machine;
  std::vector<Scene::Stand> stands;
  std::vector<Vec3> balls;
  for (const auto& run : runs) {
    const auto data = diagnosis::expand({run}, machine);
    if (!data) continue;
    if (stands.empty() && run.tool_mm.z() < 0.0) drawn.tool_length_mm = -run.tool_mm.z();
    for (std::size_t row = 0; row < data->track.size(); ++row)
      add_stand(stands, machine, run.id, data->track.state(row).q);
    const auto* grid = std::get_if<diagnosis::PlanGrid>(&run.path);
    if (grid == nullptr || !grid->ball_P) continue;
    if (std::find(balls.begin(), balls.end(), *grid->ball_P) == balls.end()) balls.push_back(*grid->ball_P);
  }
  if (stands.empty()) return std::nullopt;
  Scene out = stands_scene(drawn, std::move(stands));
  const Pose X_MP = part_in_machine(machine, JointVector{});
  for (const Vec3& ball : balls)
    out.bodies.push_back(ball_on_part(machine, X_MP * ball, kBall * out.size_mm));
  return out;
}

}  // namespace trunnion::report
