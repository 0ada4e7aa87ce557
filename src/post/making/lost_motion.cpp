#include "post/making/lost_motion.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::post {
namespace {

// Lost motion of rotary axes is below this.
const Angle kIdleTurn = Angle::degrees(0.02);
// By so many digits of its word no rotary axis reverses.
constexpr double kIdleDigits = 1.5;

}  // namespace

// The correction decides which way an axis goes that hardly moves, and that decides about its lost motion.
// Rotary axes go where they are told. Linear ones first as they move already, since every reversal costs a
// block, and a reversal that lost motion asks for bears itself out; then as the motion so found goes.
Result<path::Corrected> LostMotion::compensated(const Vec3& tip_P, const Vec3& axis_P,
                                                MachineState at) const {
  constexpr int kTries = 3;  // each turns an axis; more than one at a time is rare
  if (!work_.errors.lose_motion)
    return work_.errors.compensator->corrected(tip_P, axis_P, at, work_.errors.state.lagged(),
                                               work_.errors.aim_P);
  at.direction = work_.errors.state.now().direction;
  const auto turning = work_.errors.state.towards(at.q, at.q).direction;
  for (const AxisId id : work_.posting.machine.rotary_axes()) at.direction[id] = turning[id];
  for (int i = 1;; ++i) {
    auto found = work_.errors.compensator->corrected(tip_P, axis_P, at, work_.errors.state.lagged());
    if (!found) return found;
    JointVector sent = found->q;
    words_.round(sent);
    const auto senses = work_.errors.state.towards(sent, sent).direction;
    if (senses == at.direction || i == kTries) return found;
    at.direction = senses;
  }
}

// By how much a rotary axis has to turn until the part follows, when it goes on from `at` in the sense
// `sense`.
double LostMotion::turn_of(const MachineState& at, AxisId id, std::int8_t sense) const {
  MachineState after = at;
  after.direction[id] = sense;
  const auto& evaluator = work_.errors.compensator->evaluator();
  const Vec3 lost = evaluator.errors(at, work_.errors.state.lagged()).joint[id].rot_rad -
                    evaluator.errors(after, work_.errors.state.lagged()).joint[id].rot_rad;
  return lost.dot(work_.posting.machine.axes[id].direction);
}

// A rotary axis that would turn back by less than it loses stays where it is: the part would not follow, and
// the linear axes cannot make up for a sense that changes without a motion. So does one that would by a
// digit: where its word is at the turn of its motion rounding would have it there and back from block to
// block.
void LostMotion::hold_idle_turns(JointVector& q) const {
  const MachineState& now = work_.errors.state.now();
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    const double way = q[id] - work_.at.joints[id];
    const bool back = way * now.direction[id] < 0.0;
    if (work_.posting.machine.axes[id].kind != AxisKind::rotary || !back || std::abs(way) > kIdleTurn.rad())
      continue;
    const double lost = turn_of(now, id, static_cast<std::int8_t>(-now.direction[id]));
    if (lost * way > 0.0 &&
        std::abs(way) < std::max(std::abs(lost), kIdleDigits * work_.axis_words.rounding().quantum[id]))
      q[id] = work_.at.joints[id];
  }
}

// Where an axis is about to reverse, its lost motion is taken up before the cut goes on. A linear axis moves
// to where the new sense has the same place. The part stands still while a rotary axis takes up, so far as
// its word can say: what that turns too much or too little, linear axes make up for that need not reverse for
// it. One that loses less than half a digit turns with the motion itself.
std::optional<JointVector> LostMotion::taken_up(const JointVector& next) const {
  const MachineState& now = work_.errors.state.now();
  MachineState after = work_.errors.state.towards(next, work_.at.point.q);
  if (after.direction == now.direction) return std::nullopt;
  const auto reverses = [&](AxisId id) { return after.direction[id] != now.direction[id]; };
  JointVector q = work_.at.joints;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind != AxisKind::rotary) continue;
    if (reverses(id)) {
      const double turn = turn_of(now, id, after.direction[id]);
      const double way = next[id] - q[id];
      // Not farther than the motion itself goes.
      if (turn * way > 0.0 && std::abs(turn) < std::abs(way))
        q[id] = work_.axis_words.rounded(id, q[id] + turn);
      if (q[id] == work_.at.joints[id]) after.direction[id] = now.direction[id];
    }
    after.q[id] = q[id];
  }
  Vec3 tip_P = work_.at.point.tip_P + work_.at.point.beside_P;
  // The words before and behind it have the thermal offset.
  if (work_.thermal.follows()) tip_P -= work_.thermal.deviation_P(q);
  const auto found =
      work_.errors.compensator->corrected(tip_P, work_.at.point.axis_P, after, work_.errors.state.lagged());
  if (!found) return std::nullopt;  // the same failure comes with its place for the point itself
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind != AxisKind::linear) continue;
    const double to = work_.axis_words.rounded(id, found->q[id]);
    if (reverses(id) || (to - q[id]) * now.direction[id] > 0.0) q[id] = to;
  }
  if (work_.in_part()) work_.tool.kinematics.solve_linear(words_.tip_P(q), work_.tool.kinematics.sines(q), q);
  if (q == work_.at.joints || !is_take_up(work_.posting.machine, work_.at.joints, q)) return std::nullopt;
  return q;
}

}  // namespace trunnion::post
