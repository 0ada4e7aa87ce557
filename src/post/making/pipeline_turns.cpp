// Where the rotary axes turn back or change the branch: away from the part, or at a rapid.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/path/reconfiguration.hpp"

#include "post/making/pipeline.hpp"

namespace trunnion::post {

Result<bool> Pipeline::emit_reconfiguration(const path::ChosenPoint& next, const Pending& motion) {
  path::ChoiceOptions options;
  options.inverse = now_.chunk->inverse;
  options.tool_mm = tool_.tool.vector();
  options.axis_tolerance = modes_.tolerances.cutting().axis_room();
  const auto turns = path::plan_turns(posting_.machine, {at_.point.tip_P, at_.point.axis_P}, at_.point.q,
                                      motion.point.pose, next.q, options);
  if (!turns) {
    return fail(ErrorCode::check_failed,
                "from line " + std::to_string(at_.point.where.line) + " to here: at " + turns.error().message,
                posting_.job.cl_file, motion.point.where);
  }
  for (const path::TurnAway& turn : *turns) {
    if (turn.share > 0.0) {
      path::ChoicePoint there = motion.point;
      there.pose = turn.pose;
      if (auto done = emit_segment(rounded(there, turn.before), motion, nullptr); !done)
        return tl::unexpected(done.error());
      if (turn.share >= 1.0) {
        // If a rapid follows, or nothing, there is no need for it.
        at_.turn_due = next.q_leave;
        return true;
      }
      ++posting_.report.points_inserted;
    }
    if (auto done = emit_turn_away(turn.after, motion); !done) return tl::unexpected(done.error());
  }
  return false;
}

Result<void> Pipeline::emit_waiting_turn(const Pending& motion) {
  const auto waits = std::exchange(at_.turn_due, std::nullopt);
  if (!waits || motion.point.rapid || at_.approaches) return {};
  return emit_turn_away(*waits, motion);
}

// The tool leaves along its axis, the rotary axes turn at the safe height to the position that the path goes
// on with, and the tool comes back along its axis to where it was.
Result<void> Pipeline::emit_turn_away(const JointVector& after, const Pending& motion) {
  const double way_mm = modes_.retract_way_mm(at_.point, motion.point.where, posting_);
  const auto away = [&](const path::Point& point) {
    path::Point out = point;
    out.tip_P += way_mm * point.axis_P;
    path::round_to_words(tool_.kinematics, axis_words_.rounding(), out.tip_P, out.q);
    return out;
  };
  const auto rate =
      feed_rate(motion.feed, (motion.point.pose.tip_P - at_.point.tip_P).norm(), motion.point.where);
  if (!rate) return tl::unexpected(rate.error());
  const auto up = corrected(away(at_.point), 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = emit_feed_per_minute(*up, posting_.options.retract_feed_mm_s, motion.point.where); !r)
    return r;
  errors_.state.move_to(*up);
  at_.joints = *up;
  path::Point back = at_.point;
  back.q = after;
  path::round_to_words(tool_.kinematics, axis_words_.rounding(), back.tip_P, back.q);
  const auto above = corrected(away(back), 0.0);
  if (!above) return tl::unexpected(above.error());
  if (auto r = emit_safe_turn(*above, motion.point.where); !r) return r;
  if (auto r = emit_motion(*above, nc::MotionKind::rapid, {}, motion.point.where); !r) return r;
  // Lost motion is that of the axes as they come to stand above, and is taken up there: in the air.
  at_.point = away(back);
  at_.joints = *above;
  at_.up = false;
  auto at = corrected(back, 0.0);
  if (at && errors_.lose_motion) {
    const auto taken_up = emit_take_up(*at, motion.point.where);
    if (!taken_up) return tl::unexpected(taken_up.error());
    if (*taken_up) at = corrected(back, 0.0);
  }
  if (!at) return tl::unexpected(at.error());
  at_.point = back;
  at_.joints = *at;
  errors_.state.move_to(at_.joints);
  pause(way_mm / posting_.options.retract_feed_mm_s + way_mm / *rate);
  posting_.diagnostics.note(posting_.job.cl_file, motion.point.where,
                            "the tool leaves the part here: the rotary axes turn back or change the branch");
  return emit_feed_per_minute(at_.joints, *rate, motion.point.where);
}

// On the straight way from the last position to `q` the tip would circle the part: a rotary axis turns back,
// or the branch changes.
bool Pipeline::rewinds(const path::Point& to, const JointVector& q) const {
  constexpr double kHalfTurn = kPi * (1.0 + 1e-9);
  double turn = 0.0;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind != AxisKind::rotary) continue;
    const double by = std::abs(q[id] - at_.joints[id]);
    if (by > kHalfTurn) return true;
    turn += by;
  }
  constexpr double kNear = 20.0 * kRadPerDegree;  // the tip stays about where it is
  if (turn < kNear) return false;
  path::ChoiceOptions options;
  options.tool_mm = tool_.tool.vector();
  options.axis_tolerance = modes_.tolerances.cutting().axis;
  return !path::connects(posting_.machine, {at_.point.tip_P, at_.point.axis_P}, at_.point.q,
                         {to.tip_P, to.axis_P}, to.q, options);
}

Result<void> Pipeline::emit_rapid_above(const path::Point& to) {
  const auto q = corrected(to, 0.0);
  if (!q) return tl::unexpected(q.error());
  ++posting_.report.rewinds_at_rapids;
  posting_.diagnostics.note(
      posting_.job.cl_file, to.where,
      "a rotary axis turns back or changes the branch at this rapid: at the safe height");
  if (auto r = emit_safe_turn(*q, to.where); !r) return r;
  at_.joints = *q;
  at_.up = false;
  return emit_motion(*q, nc::MotionKind::rapid, {}, to.where);
}

Result<void> Pipeline::emit_rapid(const path::Point& to) {
  const auto q = corrected(to, 0.0);
  if (!q) return tl::unexpected(q.error());
  const double seconds = planner_.rapid_seconds(at_.joints, *q);
  // Nothing is being cut: a good moment to follow the drift.
  thermal_.renew();
  if (auto r = thermal_.write_shift(); !r) return r;
  moved(*q, seconds);
  at_.joints = *q;
  return emit_motion(*q, nc::MotionKind::rapid, {}, to.where);
}

}  // namespace trunnion::post
