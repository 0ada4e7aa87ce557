#include "post/making/rotary_turns.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/path/reconfiguration.hpp"

namespace trunnion::post {

Result<void> RotaryTurns::make_waiting(const ChunkMotion& motion) {
  const auto waits = std::exchange(work_.at.turn_due, std::nullopt);
  if (!waits || motion.point.rapid || work_.at.approaches) return {};
  return turn_away(*waits, motion);
}

// The tool leaves along its axis, the rotary axes turn at the safe height to the position that the path goes
// on with, and the tool comes back along its axis to where it was.
Result<void> RotaryTurns::turn_away(const JointVector& after, const ChunkMotion& motion) {
  const double way_mm = work_.modes.retract_way_mm(work_.at.point, motion.point.where, work_.posting);
  const auto away = [&](const path::Point& point) {
    path::Point out = point;
    out.tip_P += way_mm * point.axis_P;
    path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), out.tip_P, out.q);
    return out;
  };
  const auto rate = blocks_.rate_of(motion.feed, (motion.point.pose.tip_P - work_.at.point.tip_P).norm(),
                                    motion.point.where);
  if (!rate) return tl::unexpected(rate.error());
  const auto up = places_.of(away(work_.at.point), 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = blocks_.feed_per_minute(*up, work_.posting.options.retract.feed_mm_s, motion.point.where); !r)
    return r;
  work_.errors.state.move_to(*up);
  work_.at.joints = *up;
  path::Point back = work_.at.point;
  back.q = after;
  path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), back.tip_P, back.q);
  const auto above = places_.of(away(back), 0.0);
  if (!above) return tl::unexpected(above.error());
  if (auto r = safe_way_.turn(*above, motion.point.where); !r) return r;
  if (auto r = blocks_.write(*above, nc::MotionKind::rapid, {}, motion.point.where); !r) return r;
  // Lost motion is that of the axes as they come to stand above, and is taken up there: in the air.
  work_.at.point = away(back);
  work_.at.joints = *above;
  work_.at.up = false;
  auto at = places_.of(back, 0.0);
  if (at && work_.errors.lose_motion) {
    const auto taken_up = blocks_.take_up(*at, motion.point.where);
    if (!taken_up) return tl::unexpected(taken_up.error());
    if (*taken_up) at = places_.of(back, 0.0);
  }
  if (!at) return tl::unexpected(at.error());
  work_.at.point = back;
  work_.at.joints = *at;
  work_.errors.state.move_to(work_.at.joints);
  work_.pause(way_mm / work_.posting.options.retract.feed_mm_s + way_mm / *rate);
  work_.posting.diagnostics.note(
      work_.posting.job.cl_file, motion.point.where,
      "the tool leaves the part here: the rotary axes turn back or change the branch");
  return blocks_.feed_per_minute(work_.at.joints, *rate, motion.point.where);
}

bool RotaryTurns::rewinds(const path::Point& to, const JointVector& q) const {
  constexpr double kHalfTurn = kPi * (1.0 + 1e-9);
  double turn = 0.0;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind != AxisKind::rotary) continue;
    const double by = std::abs(q[id] - work_.at.joints[id]);
    if (by > kHalfTurn) return true;
    turn += by;
  }
  constexpr double kNear = 20.0 * kRadPerDegree;  // the tip stays about where it is
  if (turn < kNear) return false;
  path::ChoiceOptions options;
  options.tool_mm = work_.tool.tool.vector();
  options.axis_tolerance = work_.modes.tolerances.cutting().axis;
  return !path::connects(work_.posting.machine, work_.at.point, to, options);
}

Result<void> RotaryTurns::rapid_above(const path::Point& to) {
  const auto q = places_.of(to, 0.0);
  if (!q) return tl::unexpected(q.error());
  ++work_.posting.report.rewinds_at_rapids;
  work_.posting.diagnostics.note(
      work_.posting.job.cl_file, to.where,
      "a rotary axis turns back or changes the branch at this rapid: at the safe height");
  if (auto r = safe_way_.turn(*q, to.where); !r) return r;
  work_.at.joints = *q;
  work_.at.up = false;
  return blocks_.write(*q, nc::MotionKind::rapid, {}, to.where);
}

}  // namespace trunnion::post
