// Lost motion: which way the axes go on, and the block that takes it up where one of them reverses.
#include <cmath>

#include "post/making/pipeline.hpp"

namespace trunnion::post {
namespace {

// Lost motion of rotary axes is below this.
const Angle kIdleTurn = Angle::degrees(0.02);
// By so many digits of its word no rotary axis reverses.
constexpr double kIdleDigits = 1.5;
// What a block lasts that takes up lost motion.
constexpr double kTakeUp_s = 0.01;

}  // namespace

// The correction decides which way an axis goes that hardly moves, and that decides about its lost motion.
// Rotary axes go where they are told. Linear ones first as they move already, since every reversal costs a
// block, and a reversal that lost motion asks for bears itself out; then as the motion so found goes.
Result<path::Corrected> Pipeline::compensated(const Vec3& tip_P, const Vec3& axis_P, MachineState at) const {
  constexpr int kTries = 3;  // each turns an axis; more than one at a time is rare
  if (!errors_.lose_motion)
    return errors_.compensator->corrected(tip_P, axis_P, at, errors_.state.lagged(), errors_.aim_P);
  at.direction = errors_.state.now().direction;
  const auto turning = errors_.state.towards(at.q, at.q).direction;
  for (const AxisId id : posting_.machine.rotary_axes()) at.direction[id] = turning[id];
  for (int i = 1;; ++i) {
    auto found = errors_.compensator->corrected(tip_P, axis_P, at, errors_.state.lagged());
    if (!found) return found;
    JointVector sent = found->q;
    round_joints(sent);
    const auto senses = errors_.state.towards(sent, sent).direction;
    if (senses == at.direction || i == kTries) return found;
    at.direction = senses;
  }
}

// By how much a rotary axis has to turn until the part follows, when it goes on from `at` in the sense
// `sense`.
double Pipeline::lost_turn(const MachineState& at, AxisId id, std::int8_t sense) const {
  MachineState after = at;
  after.direction[id] = sense;
  const auto& evaluator = errors_.compensator->evaluator();
  const Vec3 lost = evaluator.errors(at, errors_.state.lagged()).joint[id].rot_rad -
                    evaluator.errors(after, errors_.state.lagged()).joint[id].rot_rad;
  return lost.dot(posting_.machine.axes[id].direction);
}

// A rotary axis that would turn back by less than it loses stays where it is: the part would not follow, and
// the linear axes cannot make up for a sense that changes without a motion. So does one that would by a
// digit: where its word is at the turn of its motion rounding would have it there and back from block to
// block.
void Pipeline::hold_idle_turns(JointVector& q) const {
  const MachineState& now = errors_.state.now();
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    const double way = q[id] - at_.joints[id];
    const bool back = way * now.direction[id] < 0.0;
    if (posting_.machine.axes[id].kind != AxisKind::rotary || !back || std::abs(way) > kIdleTurn.rad())
      continue;
    const double lost = lost_turn(now, id, static_cast<std::int8_t>(-now.direction[id]));
    if (lost * way > 0.0 &&
        std::abs(way) < std::max(std::abs(lost), kIdleDigits * axis_words_.rounding().quantum[id]))
      q[id] = at_.joints[id];
  }
}

// Where an axis is about to reverse, its lost motion is taken up before the cut goes on. A linear axis moves
// to where the new sense has the same place. The part stands still while a rotary axis takes up, so far as
// its word can say: what that turns too much or too little, linear axes make up for that need not reverse for
// it. One that loses less than half a digit turns with the motion itself.
Result<bool> Pipeline::emit_take_up(const JointVector& next, SourceRef where) {
  const MachineState& now = errors_.state.now();
  MachineState after = errors_.state.towards(next, at_.point.q);
  if (after.direction == now.direction) return false;
  const auto reverses = [&](AxisId id) { return after.direction[id] != now.direction[id]; };
  JointVector q = at_.joints;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind != AxisKind::rotary) continue;
    if (reverses(id)) {
      const double turn = lost_turn(now, id, after.direction[id]);
      const double way = next[id] - q[id];
      // Not farther than the motion itself goes.
      if (turn * way > 0.0 && std::abs(turn) < std::abs(way)) q[id] = axis_words_.rounded(id, q[id] + turn);
      if (q[id] == at_.joints[id]) after.direction[id] = now.direction[id];
    }
    after.q[id] = q[id];
  }
  const auto found = errors_.compensator->corrected(at_.point.tip_P + at_.point.beside_P, at_.point.axis_P,
                                                    after, errors_.state.lagged());
  if (!found) return false;  // the same failure comes with its place for the point itself
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind != AxisKind::linear) continue;
    const double to = axis_words_.rounded(id, found->q[id]);
    if (reverses(id) || (to - q[id]) * now.direction[id] > 0.0) q[id] = to;
  }
  if (in_part()) tool_.kinematics.solve_linear(word_tip_P(q), tool_.kinematics.sines(q), q);
  if (q == at_.joints || !is_take_up(posting_.machine, at_.joints, q)) return false;
  // Micrometres, in a time that no axis has to jump for.
  const double rate_mm_s = posting_.options.default_feed_mm_s;
  const BlockFeed block = planner_.plan(move_to(q, kTakeUp_s * rate_mm_s), rate_mm_s);
  moved(q, block.seconds);
  at_.joints = q;
  if (auto r = emit_motion(q, nc::MotionKind::feed, block, where); !r) return tl::unexpected(r.error());
  return true;
}

}  // namespace trunnion::post
