#include "post/making/corrected_place.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

bool CorrectedPlace::stands(const path::Point& to) const {
  return work_.errors.turner != nullptr && work_.at.known && to.axis_P == work_.at.point.axis_P &&
         work_.same_rotary(to.q, work_.at.point.q);
}

// The rotary words are rounded first: the linear axes answer what that leaves at the tip. Where the tool axis
// stands the words of the block before are kept as long as they hold the flute: a turn by a digit would free
// the clamps in the cut.
Result<void> CorrectedPlace::turn_for_errors(const path::Point& point, const Vec3& tip_P, MachineState& at) {
  constexpr double kHeld = 0.5;  // of the tolerance: a cut with a fixed axis bends by nothing else
  const auto turn_to = [&](MachineState& state, const auto& angle) {
    for (std::size_t k = 0; k < work_.tool.kinematics.rotary_count() && !work_.planes.in_force(); ++k) {
      const AxisId id = work_.tool.kinematics.rotary(k);
      state.q[id] = angle(id);
    }
    work_.tool.kinematics.solve_linear(tip_P, work_.tool.kinematics.sines(state.q), state.q);
  };
  if (stands(point)) {
    MachineState held = at;
    turn_to(held, [&](AxisId id) { return work_.at.joints[id]; });
    const auto there = lost_motion_.compensated(tip_P, point.axis_P, held);
    const auto end_off_mm = [&] {
      return (point.beside_P + work_.tool.tool.flute_mm * (there->axis_P - point.axis_P)).norm();
    };
    if (there && end_off_mm() <= kHeld * work_.modes.tolerances.tolerance_mm()) {
      at.q = held.q;
      return {};
    }
  }
  const auto turned = work_.errors.turner->corrected(tip_P, point.axis_P, at, work_.errors.state.lagged());
  if (!turned) return tl::unexpected(turned.error());
  turn_to(at, [&](AxisId id) { return work_.axis_words.rounded(id, turned->q[id]); });
  return {};
}

Result<JointVector> CorrectedPlace::of(const path::Point& point, double seconds) {
  JointVector q = point.q;
  if (!work_.errors.compensator && !work_.thermal.has_offsets() && !work_.in_part()) {
    work_.axis_words.check_travel(q, work_.tool.tool, point.where);
    return q;
  }
  if (work_.errors.lose_motion) lost_motion_.hold_idle_turns(q);
  Vec3 tip_P = point.tip_P + point.beside_P;
  // The grid of a plane's words is not that of the joints.
  if (work_.planes.in_force()) work_.tool.kinematics.solve_linear(tip_P, work_.tool.kinematics.sines(q), q);
  if (work_.thermal.follows()) {
    // A deviation of the tool is answered by its opposite.
    const Vec3 deviation_P = work_.thermal.deviation_P(q);
    tip_P -= deviation_P;
    work_.tool.kinematics.solve_linear(tip_P, work_.tool.kinematics.sines(q), q);
    words_.round(q);
    work_.posting.report.largest_error_mm =
        std::max(work_.posting.report.largest_error_mm, deviation_P.norm());
  }
  if (work_.errors.compensator) {
    MachineState at = work_.errors.know_history ? work_.errors.state.towards(expected(q), q, seconds)
                                                : work_.errors.state.now();
    at.q = q;
    const auto at_point = [&](Error error) {
      error.file = work_.posting.job.cl_file;
      error.where = point.where;
      return tl::unexpected(error);
    };
    if (work_.errors.turner) {
      if (auto done = turn_for_errors(point, tip_P, at); !done) return at_point(done.error());
      q = at.q;
    }
    const auto found = lost_motion_.compensated(tip_P, point.axis_P, at);
    if (!found) return at_point(found.error());
    if (found->held) {
      work_.posting.warn_once("table range", point.where, work_.errors.compensator->range_message(at));
    }
    double correction2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double by = found->q[work_.tool.kinematics.linear(i)] - q[work_.tool.kinematics.linear(i)];
      correction2 += by * by;
    }
    const double correction_mm = std::sqrt(correction2);
    if (correction_mm > work_.posting.options.largest_correction_mm) {
      const auto most = work_.errors.compensators->largest_effect(at, work_.tool.tool.length_mm);
      return fail(ErrorCode::check_failed,
                  "the model asks for a correction of " + fixed_text(correction_mm, 4) + " mm here, '" +
                      most.id + "' alone for " + fixed_text(most.tip_mm, 4) + " mm; at most " +
                      shortest_text(work_.posting.options.largest_correction_mm) +
                      " mm is taken to be meant (--largest-correction-mm)",
                  work_.posting.job.cl_file, point.where);
    }
    work_.posting.report.largest_correction_mm =
        std::max(work_.posting.report.largest_correction_mm, correction_mm);
    work_.posting.report.largest_error_mm = std::max(work_.posting.report.largest_error_mm, found->before_mm);
    q = found->q;
    work_.errors.aim_P = found->aim_P;
    words_.round(q);
  }
  // What the axes do follows from the words, and those are rounded.
  if (work_.in_part()) work_.tool.kinematics.solve_linear(words_.tip_P(q), work_.tool.kinematics.sines(q), q);
  work_.axis_words.check_travel(work_.thermal.shifted(q), work_.tool.tool, point.where);
  return q;
}

// Where a nominal position will be sent to, as far as it can be told before: shifted as the last one was.
JointVector CorrectedPlace::expected(const JointVector& nominal) const {
  JointVector q = nominal;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id)
    q[id] += work_.at.joints[id] - work_.at.point.q[id];
  return q;
}

}  // namespace trunnion::post
