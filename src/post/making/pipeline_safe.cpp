// The safe height: where the tool goes before a rotary axis turns outside a cut, before a tool change, before
// the spindle stops and at the end, and how it comes back.
#include <algorithm>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/making/pipeline.hpp"

namespace trunnion::post {
namespace {

constexpr std::uint16_t kZBit = nc::AxisWords::bit(nc::AxisLetter::Z);

}  // namespace

// Z to the safe height, where it is not there already.
Result<void> Pipeline::emit_retract(SourceRef where) {
  if (auto r = planes_.leave(); !r) return r;
  if (at_.up) return {};
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, why, posting_.job.cl_file, where);
  };
  if (posting_.controller.retract[nc::index(nc::AxisLetter::Z)].empty()) {
    return refuse("the program has to retract and the controller file " + posting_.controller.file +
                  " has no words for it: add [retract] Z");
  }
  const SafeHeight& safe = posting_.machine.safe;
  const bool names_position = posting_.controller.names_position(nc::AxisLetter::Z);
  if (!safe.z_mm() || (!names_position && !safe.z_is_given)) {
    return refuse("the program has to retract and the machine file " + posting_.machine.file +
                  " does not say where to: add [retract] z_mm" +
                  (names_position ? ""
                                  : ", the machine position of Z to which " + posting_.controller.file +
                                        " [retract] Z goes"));
  }
  if (const auto fault = safe_height_fault(posting_.machine, tool_.tool.length_mm)) {
    return refuse(*fault + " ([retract], [table] and [part] of " + posting_.machine.file + ")");
  }
  at_.up = true;
  return write_retract(nc::AxisLetter::Z, *safe.z_mm());
}

Result<void> Pipeline::write_retract(nc::AxisLetter letter, double position_mm) {
  nc::Retract block{nc::AxisWords::bit(letter), {}};
  if (posting_.controller.names_position(letter))
    block.to.set(letter, posting_.controller.numbers.axes.quanta(letter, position_mm));
  return posting_.write(block);
}

// Before what stops the cut where it is: the tool comes back there if the program cuts on.
Result<void> Pipeline::emit_pause_above(SourceRef where) {
  if (!at_.known || at_.up) return {};
  const auto plane = planes_.in_force();
  if (auto r = emit_retract(where); !r) return r;
  if (at_.approaches) return {};
  at_.returns = true;
  planes_.plan_again(plane);
  return {};
}

Result<void> Pipeline::emit_return(const Pending& motion) {
  if (!std::exchange(at_.returns, false) || at_.approaches) return {};
  if (motion.point.rapid) {
    at_.approaches = true;  // straight from the safe height to where the rapid ends
    return {};
  }
  const SourceRef where = motion.point.where;
  const auto rate = feed_rate(motion.feed, (motion.point.pose.tip_P - at_.point.tip_P).norm(), where);
  if (!rate) return tl::unexpected(rate.error());
  path::Point above = at_.point;
  above.tip_P += modes_.retract_way_mm(at_.point, where, posting_) * at_.point.axis_P;
  path::round_to_words(tool_.kinematics, axis_words_.rounding(), above.tip_P, above.q);
  auto up = corrected(above, 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = emit_safe_turn(*up, where); !r) return r;
  if (planes_.in_force()) up = corrected(above, 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = emit_motion(*up, nc::MotionKind::rapid, {}, where); !r) return r;
  at_.joints = *up;
  const path::Point back = std::exchange(at_.point, above);
  const auto at = corrected(back, 0.0);
  if (!at) return tl::unexpected(at.error());
  at_.point = back;
  at_.joints = *at;
  errors_.state.move_to(at_.joints);
  at_.up = false;
  return emit_feed_per_minute(at_.joints, *rate, where);
}

// From an unknown or safe position: up, the rotary axes, then over the part, then down.
Result<void> Pipeline::emit_approach(const path::Point& to, const Pending& motion) {
  const auto first = corrected(to, 0.0);
  if (!first) return tl::unexpected(first.error());
  if (auto r = emit_safe_turn(*first, motion.point.where); !r) return r;
  // In a plane that was entered on the way the words are others.
  const auto found = planes_.in_force() ? corrected(to, 0.0) : first;
  if (!found) return tl::unexpected(found.error());
  const JointVector q = *found;
  at_.point = to;
  at_.joints = q;
  at_.up = false;
  if (motion.point.rapid) return emit_motion(q, nc::MotionKind::rapid, {}, motion.point.where);
  const auto rate = feed_rate(motion.feed, 0.0, motion.point.where);
  if (!rate) return tl::unexpected(rate.error());
  return emit_feed_per_minute(q, *rate, motion.point.where);
}

// Up to the safe height, then the rotary axes and then X and Y to where `q` has them.
Result<void> Pipeline::emit_safe_turn(const JointVector& q, SourceRef where) {
  std::uint16_t rotary = 0;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind == AxisKind::rotary) {
      rotary = static_cast<std::uint16_t>(rotary | nc::AxisWords::bit(posting_.letters[id]));
    }
  }
  if (auto r = emit_retract(where); !r) return r;
  if (auto r = thermal_.write_shift(); !r) return r;
  // Where the machine comes from is known from the second time on.
  moved(q, at_.known ? planner_.rapid_seconds(at_.joints, q) : 0.0);
  if (auto r = emit_motion(q, nc::MotionKind::rapid, {}, where, rotary); !r) return r;
  if (auto r = planes_.enter(); !r) return r;
  if (auto r = clamp_standing(); !r) return r;
  if (!posting_.options.rtcp)
    return emit_motion(q, nc::MotionKind::rapid, {}, where, static_cast<std::uint16_t>(~rotary & ~kZBit));
  if (auto r = posting_.write(nc::TcpControl{true, tool_.length_register}); !r) return r;
  return emit_motion(above(q), nc::MotionKind::rapid, {}, where);
}

Result<void> Pipeline::clamp_standing() {
  if (posting_.controller.clamps.empty()) return {};
  const std::uint16_t stand = now_.standing_axes(posting_, axis_words_);
  for (const nc::Controller::Clamp& clamp : posting_.controller.clamps) {
    std::uint16_t own = 0;
    for (AxisId id = 0; id < posting_.machine.axes.size(); ++id)
      own = static_cast<std::uint16_t>(own | (nc::AxisWords::bit(posting_.letters[id]) & clamp.axes));
    if (own == 0 || (own & stand) != own) continue;
    if (auto r = posting_.write(nc::Clamp{clamp.axes, true}); !r) return r;
  }
  return {};
}

// Under tool-centre-point control a linear move needs all of X Y Z: those of a place straight above, at the
// safe height.
JointVector Pipeline::above(const JointVector& q) const {
  JointVector out = q;
  const auto id = posting_.machine.axis("Z");
  if (!id) return out;
  const Axis& z = posting_.machine.axes[*id];
  // A shift of the work offset needs room at the end of the travel.
  const double room_mm = thermal_.room_mm();
  const double digit_mm = posting_.controller.numbers.axes.quantum(nc::AxisLetter::Z);
  const double height = std::clamp(*posting_.machine.safe.z_mm(), z.min + room_mm, z.max - room_mm);
  out[*id] = posting_.machine.safe.away < 0 ? std::min(q[*id], height) : std::max(q[*id], height);
  // Words of the part are rounded in all three directions, and a control stops at a place that is beyond its
  // travel by the last digit (LinuxCNC does): a digit or two towards the part.
  constexpr int kDigits = 4;
  for (int i = 0; i < kDigits; ++i) {
    JointVector there = out;
    tool_.kinematics.solve_linear(word_tip_P(out), tool_.kinematics.sines(out), there);
    if (there[*id] <= z.max && there[*id] >= z.min) break;
    out[*id] += there[*id] > z.max ? -digit_mm : digit_mm;
  }
  return out;
}

Result<void> Pipeline::emit_end() {
  if (auto r = planes_.leave(); !r) return r;
  if (at_.known) {
    if (auto r = emit_retract({}); !r) return r;
    for (const nc::AxisLetter letter : {nc::AxisLetter::X, nc::AxisLetter::Y}) {
      const auto& to_mm = posting_.machine.safe.to_mm[nc::index(letter)];
      if (!to_mm) continue;
      if (auto r = write_retract(letter, *to_mm); !r) return r;
    }
  }
  if (auto r = thermal_.finish(); !r) return r;
  if (auto r = posting_.write(nc::Spindle{}); !r) return r;
  return posting_.write(nc::Coolant{});
}

}  // namespace trunnion::post
