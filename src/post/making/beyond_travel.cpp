#include "post/making/beyond_travel.hpp"

#include <cmath>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

void BeyondTravel::note(const Machine& machine, const JointVector& q, const JointVector& quantum,
                        const SpindleTool& tool, SourceRef where) {
  for (const LimitViolation& v : limit_violations(machine, q)) {
    if (v.by <= 0.5 * quantum[v.axis] + 1e-12) continue;  // rounding of a position at the limit
    Positions& beyond = of_axis_[v.axis];
    ++beyond.count;
    if (beyond.count == 1) beyond.first = where;
    if (v.by > beyond.worst.by) {
      beyond.worst = v;
      beyond.where = where;
      beyond.tool_mm = tool.vector();
    }
  }
}

Result<void> BeyondTravel::tell(Posting& posting) const {
  const std::string& file = posting.job.cl_file;
  Result<void> out;
  for (AxisId id = 0; id < posting.machine.axes.size(); ++id) {
    const Positions& beyond = of_axis_[id];
    if (beyond.count == 0) continue;
    const std::string what = text(posting.machine.axes[id], beyond);
    posting.diagnostics.error(file, beyond.where, what);
    if (out) out = fail(ErrorCode::check_failed, what, file, beyond.where);
  }
  return out;
}

std::string BeyondTravel::text(const Axis& axis, const Positions& beyond) {
  const bool rotary = axis.kind == AxisKind::rotary;
  const double factor = rotary ? kDegreePerRad : 1.0;
  const std::string unit = rotary ? " deg" : " mm";
  const auto number = [&](double v) { return fixed_text(v * factor, 4) + unit; };
  // Along the spindle the position is that of the spindle nose: what of it is tool is what can be changed.
  const double along_mm = rotary || axis.carries_part ? 0.0 : axis.direction.dot(beyond.tool_mm);
  std::string text;
  if (along_mm != 0.0) {
    const auto short_number = [](double v) { return fixed_text(v, 3); };
    const bool above = beyond.worst.value > axis.max;
    text = "spindle nose at " + axis.name + " " + short_number(beyond.worst.value) + " (tip " +
           short_number(beyond.worst.value + along_mm) + (along_mm < 0.0 ? " + tool " : " - tool ") +
           short_number(std::abs(along_mm)) + "): " + short_number(beyond.worst.by) +
           (above ? " above" : " below") + " the limit of " + shortest_text(above ? axis.max : axis.min);
  } else {
    text = "axis " + axis.name + " would have to go to " + number(beyond.worst.value) + ", " +
           number(beyond.worst.by) + " beyond its limits of " + number(axis.min) + " to " + number(axis.max);
  }
  if (beyond.count > 1) {
    text += "; " + std::to_string(beyond.count) + " positions are beyond them, the first at line " +
            std::to_string(beyond.first.line);
  }
  return text;
}

}  // namespace trunnion::post
