#include "trunnion/probe/planned.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::probe {
namespace {

constexpr double kOnePlace_mm = 1e-3;
constexpr double kAlong_mm = 1e-6;

}  // namespace

Result<PlannedBall> planned_ball(const diagnosis::PlanRun& run, const Machine& machine,
                                 const std::string& file) {
  const auto other = [&](const std::string& what) {
    return fail(ErrorCode::wrong_input, "run '" + run.id + "' is no ball that a probe can touch: " + what,
                file);
  };
  if (run.quantity != diagnosis::Quantity::displacement) return other("it reads angles");
  if (run.radial) return other("it is a circle");
  if (std::hypot(run.tool_mm.x(), run.tool_mm.y()) > kAlong_mm || !(run.tool_mm.z() < 0.0))
    return other("its tool does not point along the spindle");
  const auto data = diagnosis::expand({run}, machine);
  if (!data) return tl::unexpected(data.error());
  PlannedBall out;
  out.stylus_length_mm = -run.tool_mm.z();
  out.both_directions = run.both_directions;
  const auto axes = machine.rotary_axes();
  for (std::size_t row = 0; row < data->rows.size(); ++row) {
    const JointVector q = data->track.state(row).q;
    const Vec3 place_P = forward(machine, q, run.tool_mm).p;
    if (row == 0) out.place_P = place_P;
    if (const double off = (place_P - out.place_P).norm(); off > kOnePlace_mm)
      return other("its points are up to " + fixed_text(off, 3) + " mm apart in the part");
    JointVector pose;
    for (const AxisId id : axes) pose[id] = q[id];
    if (std::find(out.poses.begin(), out.poses.end(), pose) == out.poses.end()) out.poses.push_back(pose);
  }
  if (out.poses.size() < 2) return other("the rotary axes stand still");
  return out;
}

}  // namespace trunnion::probe
