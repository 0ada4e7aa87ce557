#include "post/making/safe_way.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/path/reconfiguration.hpp"

namespace trunnion::post {
namespace {

constexpr std::uint16_t kZBit = nc::AxisWords::bit(nc::AxisLetter::Z);

}  // namespace

Result<void> SafeWay::retract(SourceRef where) {
  if (auto r = work_.planes.leave(); !r) return r;
  if (work_.at.up) return {};
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, why, work_.posting.job.cl_file, where);
  };
  if (work_.cutter.is_on()) return refuse("CUTCOM: CUTCOM/OFF is missing before the tool leaves the part");
  if (work_.posting.controller.retract[nc::index(nc::AxisLetter::Z)].empty()) {
    return refuse("the program has to retract and the controller file " + work_.posting.controller.file +
                  " has no words for it: add [retract] Z");
  }
  const SafeHeight& safe = work_.posting.machine.safe;
  const bool names_position = work_.posting.controller.names_position(nc::AxisLetter::Z);
  if (!safe.z_mm() || (!names_position && !safe.z_is_given)) {
    return refuse("the program has to retract and the machine file " + work_.posting.machine.file +
                  " does not say where to: add [retract] z_mm" +
                  (names_position ? ""
                                  : ", the machine position of Z to which " + work_.posting.controller.file +
                                        " [retract] Z goes"));
  }
  if (const auto fault = safe_height_fault(work_.posting.machine, work_.tool.tool.length_mm)) {
    return refuse(*fault + " ([retract], [table] and [part] of " + work_.posting.machine.file + ")");
  }
  if (const auto fault = above_safe_height(work_.at.joints); work_.at.known && fault) return refuse(*fault);
  if (auto r = rise_under_tcp(where); !r) return r;
  work_.at.up = true;
  return write_retract(nc::AxisLetter::Z, *safe.z_mm());
}

// What is called the safe height is none where the tool would go down to it, or up from it to the part.
std::optional<std::string> SafeWay::above_safe_height(const JointVector& q) const {
  constexpr double kSlack_mm = 0.1;  // digits, and a shift of the work offset
  const SafeHeight& safe = work_.posting.machine.safe;
  const auto id = work_.posting.machine.axis("Z");
  // What is beyond the travel is refused as that.
  if (!id || !safe.z_mm() || !work_.posting.machine.axes[*id].within_limits(q[*id])) return std::nullopt;
  const double above_mm = (safe.away < 0 ? -1.0 : 1.0) * (q[*id] - *safe.z_mm());
  if (above_mm <= kSlack_mm) return std::nullopt;
  return "the safe height, machine Z " + fixed_text(*safe.z_mm(), 3) + " mm, is " + fixed_text(above_mm, 3) +
         " mm below a place of the path, machine Z " + fixed_text(q[*id], 3) + " mm with a tool of " +
         shortest_text(work_.tool.tool.length_mm) + " mm: [retract] z_mm of " + work_.posting.machine.file +
         " is a position of the spindle's gauge point, and the tool rotates and moves sideways at this "
         "height";
}

// Where the word that ends tool-centre-point control may move Z by the length of the tool it stands at the
// safe height, as the one that begins it does.
Result<void> SafeWay::rise_under_tcp(SourceRef where) {
  const nc::Controller& c = work_.posting.controller;
  const bool on = std::exchange(work_.at.tcp, false);  // the retract ends it
  if (!on || !c.tcp.replaces_length || !c.length.moves_at_once) return {};
  if (const auto fault = length_drop_fault(work_.posting.machine, work_.tool.tool.length_mm)) {
    work_.posting.warn_once(
        "length drop", where,
        "where tool-centre-point control ends, " + *fault +
            ". Set the control so that no word of the length moves it by itself, and say so in " + c.file +
            " ([length] moves_at_once = false), or raise the safe height");
  }
  return blocks_.write(above(work_.at.joints), nc::MotionKind::rapid, {}, where);
}

Result<void> SafeWay::write_retract(nc::AxisLetter letter, double position_mm) {
  nc::Retract block{nc::AxisWords::bit(letter), {}};
  if (work_.posting.controller.names_position(letter))
    block.to.set(letter, work_.posting.controller.numbers.axes.quanta(letter, position_mm));
  return work_.posting.write(block);
}

Result<void> SafeWay::pause_above(SourceRef where) {
  if (!work_.at.known || work_.at.up) return {};
  const auto plane = work_.planes.in_force();
  if (auto r = retract(where); !r) return r;
  if (work_.at.approaches) return {};
  work_.at.returns = true;
  work_.planes.plan_again(plane);
  return {};
}

// At the pole the tool axis leaves the table free: it stands as the motion that follows has it, which need
// not turn it in the cut. Elsewhere the tool axis asks for what was before, on the solution that the motion
// goes on.
bool SafeWay::take_turn(const path::Point& to) {
  if (!work_.at.asked_turn) return true;
  tell_undone_turn(to);
  path::ChoiceOptions options;
  options.tool_mm = work_.tool.tool.vector();
  options.axis_tolerance = work_.modes.tolerances.cutting().axis;
  path::Point& here = work_.at.point;
  for (const JointSolution& solution : inverse(work_.posting.machine, {here.tip_P, here.axis_P}, to.q)) {
    path::Point from = here;
    from.q = solution.q;
    path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), from.tip_P, from.q);
    if (!path::connects(work_.posting.machine, from, to, options)) continue;
    here = from;
    return true;
  }
  return false;
}

Result<void> SafeWay::come_back(const path::Point& to, const ChunkMotion& motion) {
  if (!std::exchange(work_.at.returns, false) || work_.at.approaches) return {};
  if (motion.point.rapid) {
    work_.at.approaches = true;  // straight from the safe height to where the rapid ends
    return {};
  }
  if (!take_turn(to))
    return fail(
        ErrorCode::check_failed,
        "the table has turned in a cut, and no position of the rotary axes lets it go on from where the "
        "tool was: a rapid is missing before it",
        work_.posting.job.cl_file, motion.point.where);
  const SourceRef where = motion.point.where;
  const auto rate =
      blocks_.rate_of(motion.feed, (motion.point.pose.tip_P - work_.at.point.tip_P).norm(), where);
  if (!rate) return tl::unexpected(rate.error());
  path::Point above = work_.at.point;
  above.tip_P += work_.modes.retract_way_mm(work_.at.point, where, work_.posting) * work_.at.point.axis_P;
  path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), above.tip_P, above.q);
  auto up = places_.of(above, 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = turn(*up, where); !r) return r;
  if (work_.planes.in_force()) up = places_.of(above, 0.0);
  if (!up) return tl::unexpected(up.error());
  if (auto r = blocks_.write(*up, nc::MotionKind::rapid, {}, where); !r) return r;
  work_.at.joints = *up;
  const path::Point back = std::exchange(work_.at.point, above);
  const auto at = places_.of(back, 0.0);
  if (!at) return tl::unexpected(at.error());
  work_.at.point = back;
  work_.at.joints = *at;
  work_.errors.state.move_to(work_.at.joints);
  work_.at.up = false;
  return blocks_.feed_per_minute(work_.at.joints, *rate, where);
}

Result<void> SafeWay::leave_part(SourceRef where) {
  if (!work_.at.known || work_.at.up) return {};
  work_.at.approaches = true;
  return retract(where);
}

// Points without a tool axis may be meant in a part that has turned with the table: that is not how they are
// read.
void SafeWay::tell_undone_turn(const path::Point& to) {
  const auto asked = std::exchange(work_.at.asked_turn, std::nullopt);
  if (!asked || std::abs(to.q[asked->axis] - asked->angle) < 1e-9) return;
  const auto degrees = [](double angle) { return fixed_text(angle * kDegreePerRad, 3) + " deg"; };
  const Axis& axis = work_.posting.machine.axes[asked->axis];
  work_.posting.diagnostics.warning(
      work_.posting.job.cl_file, asked->where,
      "axis " + axis.name + " turns to " + degrees(asked->angle) +
          ", and the tool axis of the next point turns it to " + degrees(to.q[asked->axis]) +
          ": points of the CL file stay where they are on the part, whatever the table does");
}

Result<void> SafeWay::approach(const path::Point& to, const ChunkMotion& motion) {
  tell_undone_turn(to);
  // Words of a plane have another grid: it is left before the place is rounded.
  if (auto r = retract(motion.point.where); !r) return r;
  const auto first = places_.of(to, 0.0);
  if (!first) return tl::unexpected(first.error());
  if (auto r = turn(*first, motion.point.where); !r) return r;
  // In a plane that was entered on the way the words are others.
  const auto found = work_.planes.in_force() ? places_.of(to, 0.0) : first;
  if (!found) return tl::unexpected(found.error());
  const JointVector q = *found;
  work_.at.point = to;
  work_.at.joints = q;
  work_.at.up = false;
  if (motion.point.rapid) return blocks_.write(q, nc::MotionKind::rapid, {}, motion.point.where);
  const auto rate = blocks_.rate_of(motion.feed, 0.0, motion.point.where);
  if (!rate) return tl::unexpected(rate.error());
  return blocks_.feed_per_minute(q, *rate, motion.point.where);
}

Result<void> SafeWay::turn(const JointVector& q, SourceRef where) {
  std::uint16_t rotary = 0;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind == AxisKind::rotary) {
      rotary = static_cast<std::uint16_t>(rotary | nc::AxisWords::bit(work_.posting.letters[id]));
    }
  }
  if (auto r = retract(where); !r) return r;
  if (const auto fault = above_safe_height(q))
    return fail(ErrorCode::check_failed, *fault, work_.posting.job.cl_file, where);
  if (auto r = work_.thermal.write_shift(); !r) return r;
  // Where the machine comes from is known from the second time on.
  work_.moved(q, work_.at.known ? work_.planner.axes().rapid_seconds(work_.at.joints, q) : 0.0);
  if (auto r = blocks_.write(q, nc::MotionKind::rapid, {}, where, rotary); !r) return r;
  if (auto r = work_.planes.enter(); !r) return r;
  if (auto r = clamp_standing(); !r) return r;
  if (!work_.posting.options.rtcp)
    return blocks_.write(q, nc::MotionKind::rapid, {}, where, static_cast<std::uint16_t>(~rotary & ~kZBit));
  work_.at.tcp = true;
  if (auto r = work_.posting.write(nc::TcpControl{true, work_.tool.length_register}); !r) return r;
  return blocks_.write(above(q), nc::MotionKind::rapid, {}, where);
}

Result<void> SafeWay::turn_table(AxisId id, double angle, bool now, SourceRef where) {
  const double rounded = work_.axis_words.rounded(id, angle);
  if (std::abs(work_.at.point.q[id] - rounded) < 1e-12) return {};
  work_.at.point.q[id] = rounded;
  work_.at.asked_turn = AskedTurn{id, rounded, where};
  // What follows comes from the safe height.
  work_.at.returns = true;
  if (!work_.at.known) work_.at.approaches = true;
  if (!now || !work_.at.known) return {};
  if (auto r = retract(where); !r) return r;
  work_.at.joints[id] = rounded;
  return blocks_.write(work_.at.joints, nc::MotionKind::rapid, {}, where,
                       nc::AxisWords::bit(work_.posting.letters[id]));
}

Result<void> SafeWay::clamp_standing() {
  if (work_.posting.controller.clamps.empty()) return {};
  const std::uint16_t stand = work_.now.standing_axes(work_.posting, work_.axis_words);
  for (const nc::Controller::Clamp& clamp : work_.posting.controller.clamps) {
    std::uint16_t own = 0;
    for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id)
      own = static_cast<std::uint16_t>(own | (nc::AxisWords::bit(work_.posting.letters[id]) & clamp.axes));
    if (own == 0 || (own & stand) != own) continue;
    if (auto r = work_.posting.write(nc::Clamp{clamp.axes, true}); !r) return r;
  }
  return {};
}

// Under tool-centre-point control a linear move needs all of X Y Z: those of a place straight above, at the
// safe height.
JointVector SafeWay::above(const JointVector& q) const {
  JointVector out = q;
  const auto id = work_.posting.machine.axis("Z");
  if (!id) return out;
  const Axis& z = work_.posting.machine.axes[*id];
  // A shift of the work offset needs room at the end of the travel.
  const double room_mm = work_.thermal.room_mm();
  const double digit_mm = work_.posting.controller.numbers.axes.quantum(nc::AxisLetter::Z);
  const double height = std::clamp(*work_.posting.machine.safe.z_mm(), z.min + room_mm, z.max - room_mm);
  out[*id] = work_.posting.machine.safe.away < 0 ? std::min(q[*id], height) : std::max(q[*id], height);
  // Words of the part are rounded in all three directions, and a control stops at a place that is beyond its
  // travel by the last digit (LinuxCNC does): a digit or two towards the part.
  constexpr int kDigits = 4;
  for (int i = 0; i < kDigits; ++i) {
    JointVector there = out;
    work_.tool.kinematics.solve_linear(words_.tip_P(out), work_.tool.kinematics.sines(out), there);
    if (there[*id] <= z.max && there[*id] >= z.min) break;
    out[*id] += there[*id] > z.max ? -digit_mm : digit_mm;
  }
  return out;
}

Result<void> SafeWay::end() {
  if (auto r = work_.planes.leave(); !r) return r;
  if (work_.at.known) {
    if (auto r = retract({}); !r) return r;
    for (const nc::AxisLetter letter : {nc::AxisLetter::X, nc::AxisLetter::Y}) {
      const auto& to_mm = work_.posting.machine.safe.to_mm[nc::index(letter)];
      if (!to_mm) continue;
      if (auto r = write_retract(letter, *to_mm); !r) return r;
    }
  }
  if (auto r = work_.thermal.finish(); !r) return r;
  if (auto r = work_.posting.write(nc::Spindle{}); !r) return r;
  return work_.posting.write(nc::Coolant{});
}

}  // namespace trunnion::post
