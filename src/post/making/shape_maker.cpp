#include "post/making/shape_maker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "trunnion/base/number_text.hpp"
#include "trunnion/nc/expand.hpp"

namespace trunnion::post {
namespace {

// Share of the tolerance that the rounding of an arc's centre, or of a hole's place, may take.
constexpr double kRoundingShare = 0.3;
// The same of what the control's plane is off the arc's, and Z off the hole.
constexpr double kSkewShare = 0.1;
// Motions of a hole: the verification sees so far ahead.
constexpr std::size_t kMostMotions = 900;

// The words of an arc's centre, by how much the arc is off with them, and by how much its radii differ.
struct CenterWords {
  std::array<std::int64_t, 2> quanta{};
  double off_mm = 0.0, radii_mm = 0.0;
};

CenterWords best_center(const nc::AxisFormat& format, const nc::AxisWords& from, const nc::AxisWords& to,
                        const Vec3& center, double radius_mm) {
  const auto mm = [&](std::int64_t quanta) { return format.internal(nc::AxisLetter::X, quanta); };
  const std::int64_t x0 = format.quanta(nc::AxisLetter::X, center.x());
  const std::int64_t y0 = format.quanta(nc::AxisLetter::Y, center.y());
  CenterWords best;
  double least = std::numeric_limits<double>::infinity();
  constexpr std::int64_t kSearch = 2;  // quanta: ends are off by half of one in each direction
  for (std::int64_t x = x0 - kSearch; x <= x0 + kSearch; ++x) {
    for (std::int64_t y = y0 - kSearch; y <= y0 + kSearch; ++y) {
      const auto radius = [&](const nc::AxisWords& w) {
        return std::hypot(mm(w[nc::AxisLetter::X] - x), mm(w[nc::AxisLetter::Y] - y));
      };
      const double start = radius(from);
      const double end = radius(to);
      const double moved = std::hypot(mm(x) - center.x(), mm(y) - center.y());
      const double off = moved + std::max(std::abs(start - radius_mm), std::abs(end - radius_mm));
      const double cost = off + std::abs(end - start);
      if (cost >= least) continue;
      least = cost;
      best = {{x, y}, off, std::abs(end - start)};
    }
  }
  return best;
}

}  // namespace

Result<bool> ShapeMaker::make(const cl::Shape& shape, std::size_t i) {
  const auto* arc = std::get_if<cl::Arc>(&shape.what);
  const auto* tap = std::get_if<cl::Hole>(&shape.what);
  if (tap != nullptr && tap->kind != cl::Hole::Kind::tap) tap = nullptr;
  const bool asked =
      tap != nullptr   ? true
      : arc != nullptr ? work_.posting.options.native_arcs.value_or(work_.posting.controller.arcs.native)
                       : work_.posting.options.native_cycles.value_or(work_.posting.controller.cycles.native);
  if (!asked) return false;
  if (tap == nullptr || !work_.spindle.has_tapped()) {
    if (auto done = work_.spindle.resume(); !done) return tl::unexpected(done.error());
    if (auto done = work_.spindle.check_before_cut(work_.now.chunk->points[i].where); !done)
      return tl::unexpected(done.error());
  }
  Result<bool> taken = false;
  if (may_make(i, shape.all_motions())) {
    taken = arc != nullptr ? make_arc(*arc, i, shape.all_motions())
                           : make_hole(std::get<cl::Hole>(shape.what), i, shape.all_motions());
  }
  if (taken && !*taken && tap != nullptr)
    return fail(ErrorCode::wrong_input, no_tap(*tap), work_.posting.job.cl_file,
                work_.now.chunk->points[i].where);
  if (taken && !*taken) ++work_.posting.report.shapes_as_moves;
  return taken;
}

// The rotary axes stand still, and nothing bends the path.
bool ShapeMaker::may_make(std::size_t i, std::size_t count) const {
  if (work_.at.turn_due || work_.at.returns || work_.cutter.changes || work_.errors.compensator ||
      work_.thermal.has_offsets() || count == 0 || i + count > work_.now.chunk->size())
    return false;
  for (std::size_t k = i; k < i + count; ++k) {
    const path::ChosenPoint& chosen = work_.now.chunk->chosen[k];
    if (chosen.reconfigure || !(chosen.q_leave == chosen.q)) return false;
    if (!work_.same_rotary(work_.now.chunk->joints[k], work_.now.chunk->joints[i])) return false;
    if (work_.now.chunk->programmed_axis_P(k) != work_.now.chunk->points[k].pose.axis_P) return false;
  }
  return true;
}

Result<bool> ShapeMaker::make_arc(const cl::Arc& arc, std::size_t i, std::size_t count) {
  const SourceRef where = work_.now.chunk->points[i].where;
  const path::Point end = work_.now.chunk->point(i + count - 1);
  constexpr double kSamePlace_mm = 1e-6;
  if (!work_.at.known || work_.at.approaches || arc.feed.mode == cl::FeedMode::inverse ||
      work_.posting.controller.arcs.clockwise.empty() || !work_.same_rotary(work_.at.point.q, end.q) ||
      (work_.at.point.tip_P - arc.start_P).norm() > kSamePlace_mm)
    return false;
  // Words are an affine map of the tip while the rotary axes stand: is the arc one in X and Y there?
  const double tolerance_mm = work_.posting.options.tolerance_mm;
  const Vec3 from_center_P = arc.start_P - arc.center_P;
  const Vec3 radial_P = from_center_P - arc.normal_P * arc.normal_P.dot(from_center_P);
  const double radius_mm = radial_P.norm();
  const Vec3 along_P = arc.normal_P.cross(radial_P);
  const Vec3 center = words_.xyz(arc.center_P, end.q);
  const Vec3 u = (words_.xyz(arc.center_P + radial_P, end.q) - center) / radius_mm;
  const Vec3 v = (words_.xyz(arc.center_P + along_P, end.q) - center) / radius_mm;
  const double skew = std::max({std::abs(u.norm() - 1.0), std::abs(v.norm() - 1.0), std::abs(u.dot(v)),
                                std::abs(u.z()), std::abs(v.z())});
  if (radius_mm * skew > kSkewShare * tolerance_mm) return false;

  nc::Arc block;
  block.clockwise = u.cross(v).z() < 0.0;
  block.from = words_.quanta_of(words_.xyz_of(words_.of(work_.at.joints)));
  block.source = where;
  JointVector q = end.q;
  for (std::size_t k = i; k < i + count; ++k) {  // within the limits, all the way
    const auto found = places_.of(work_.now.chunk->point(k), 0.0);
    if (!found) return tl::unexpected(found.error());
    q = *found;
  }
  nc::AxisWords target = words_.quanta_of(words_.xyz_of(words_.of(q)));
  const double rise_mm = (arc.end_P - arc.start_P).dot(arc.normal_P);
  const double digit_mm = work_.posting.controller.numbers.axes.quantum(nc::AxisLetter::Z);
  double flattened_mm = 0.0;
  if (std::abs(rise_mm) < digit_mm && target[nc::AxisLetter::Z] != block.from[nc::AxisLetter::Z]) {
    // Rounding, here or in the CL file, makes no helix of an arc.
    target.set(nc::AxisLetter::Z, block.from[nc::AxisLetter::Z]);
    q = words_.joints_of(target, end.q);
    flattened_mm = words_.xyz(arc.end_P, end.q).z() - work_.posting.controller.numbers.axes.internal(
                                                          nc::AxisLetter::Z, target[nc::AxisLetter::Z]);
  }
  block.words = target;
  const CenterWords words =
      best_center(work_.posting.controller.numbers.axes, block.from, target, center, radius_mm);
  block.center = words.quanta;
  if (std::hypot(words.off_mm, flattened_mm) > kRoundingShare * tolerance_mm ||
      words.radii_mm > work_.posting.controller.arcs.radius_tolerance_mm)
    return false;

  const bool closes = arc.sweep.rad() > kTwoPi - 1e-9;
  const auto turns = closes ? std::llround(arc.sweep.rad() / kTwoPi) : 1;
  const std::int64_t rise = target[nc::AxisLetter::Z] - block.from[nc::AxisLetter::Z];
  if (work_.posting.controller.arcs.words(block.clockwise, rise != 0).empty()) return false;
  // An end that rounding has put on the start or behind it would make a whole turn of it, and the other way
  // round.
  const double turned = nc::course_of(block, work_.posting.controller.numbers.axes, tolerance_mm).sweep_rad;
  const double meant = closes ? kTwoPi : arc.sweep.rad();
  if (std::abs(turned - meant) * radius_mm > 2.0 * tolerance_mm) return false;
  const double length_mm =
      std::hypot(radius_mm * arc.sweep.rad(), (end.tip_P - work_.at.point.tip_P).dot(arc.normal_P));

  const auto rate = blocks_.rate_of(arc.feed, length_mm, where);
  if (!rate) return tl::unexpected(rate.error());
  const double seconds = feed_word(*rate, length_mm, block.feed);
  for (std::int64_t turn = 1; turn <= turns; ++turn) {
    block.words.set(nc::AxisLetter::Z, block.from[nc::AxisLetter::Z] + rise * turn / turns);
    if (auto done = work_.posting.write(block); !done) return tl::unexpected(done.error());
  }
  work_.moved(q, seconds);
  work_.at.point = end;
  work_.at.joints = q;
  work_.course.leave_segment();
  ++work_.posting.report.arcs;
  return true;
}

// F of a motion of the linear axes alone at `rate_mm_s`, or as fast as they can; the time that it takes.
double ShapeMaker::feed_word(double rate_mm_s, double length_mm, std::int64_t& feed) {
  const nc::FeedFormat& format = work_.posting.controller.numbers.feed;
  const double most = std::min(rate_mm_s, work_.planner.axes().linear_rate_mm_s());
  feed = format.quanta(nc::FeedMode::per_minute, most);
  if (format.internal(nc::FeedMode::per_minute, feed) > work_.planner.axes().linear_rate_mm_s() && feed > 1)
    --feed;
  work_.posting.report.feed_time_lost_s += length_mm / most - length_mm / rate_mm_s;
  return length_mm / format.internal(nc::FeedMode::per_minute, feed);
}

// Its motions alone are no thread.
std::string ShapeMaker::no_tap(const cl::Hole& hole) const {
  nc::Hole block;
  block.kind = nc::Hole::Kind::tap;
  std::string why = "the rotary axes must stand, and the tool along Z of the words";
  if (work_.at.returns || work_.at.approaches)
    why = "the tool comes from the safe height: a RAPID to a point over the hole is missing";
  if (work_.spindle.spindle().turn == nc::SpindleTurn::off) {
    why = "the spindle does not turn (SPINDL before it)";
  } else if (work_.posting.controller.cycles.words(block).empty()) {
    why = "the control '" + work_.posting.controller.name + "' has no words for it ([cycles] tap in " +
          work_.posting.controller.file + ")";
  } else if (work_.posting.options.rtcp) {
    why = "controls have no cycles under tool-centre-point control (--rtcp)";
  } else if (work_.errors.compensator || work_.thermal.has_offsets()) {
    why = "its axes cannot follow the machine's errors (--no-geometric, --no-thermal)";
  } else if (hole.feed.mode == cl::FeedMode::inverse || hole.feed.mode == cl::FeedMode::none) {
    why = "it has no pitch";
  }
  return "CYCLE/TAP needs the control's tapping cycle, which is not possible here: " + why;
}

Result<nc::Thread> ShapeMaker::thread_of(const cl::Hole& hole, SourceRef where) {
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::wrong_input, "CYCLE/TAP: " + why, work_.posting.job.cl_file, where);
  };
  const nc::Spindle& spindle = work_.spindle.spindle();
  if (spindle.turn == nc::SpindleTurn::off) return refuse("the spindle does not turn (SPINDL before it)");
  const double turns_s = work_.spindle.rpm() / kSecondsPerMinute;
  const bool per_turn = hole.feed.mode == cl::FeedMode::per_revolution;
  const double pitch_mm = per_turn ? hole.feed.value : hole.feed.value / turns_s;
  // Taps are made from M1 (0.25 mm) to trapezoidal threads.
  constexpr double kFinest_mm = 0.1, kCoarsest_mm = 20.0;
  if (pitch_mm < kFinest_mm || pitch_mm > kCoarsest_mm)
    return refuse("feed over speed is a pitch of " + fixed_text(pitch_mm, 4) + " mm: no tap has that");
  const double rate_mm_s = pitch_mm * static_cast<double>(spindle.rpm) / kSecondsPerMinute;
  if (rate_mm_s > work_.planner.axes().linear_rate_mm_s())
    return refuse("a pitch of " + fixed_text(pitch_mm, 4) + " mm at " + std::to_string(spindle.rpm) +
                  " rpm is faster than the linear axes go");
  nc::Thread out;
  out.pitch = std::llround(pitch_mm / nc::kPitchUnit_mm);
  out.rpm = spindle.rpm;
  out.hand = spindle.turn == nc::SpindleTurn::clockwise ? nc::Thread::Hand::right : nc::Thread::Hand::left;
  return out;
}

Result<nc::AxisWords> ShapeMaker::rise_over(const cl::Hole& hole, double height_mm, const path::Point& end) {
  path::Point above = end;
  above.tip_P = hole.top_P + hole.axis_P * height_mm;
  path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), above.tip_P, above.q);
  if (auto done = blocks_.rapid_to(above); !done) return tl::unexpected(done.error());
  work_.at.point = above;
  return words_.quanta_of(words_.xyz_of(words_.of(work_.at.joints)));
}

Result<bool> ShapeMaker::make_hole(const cl::Hole& hole, std::size_t i, std::size_t count) {
  const SourceRef where = work_.now.chunk->points[i].where;
  const bool is_tap = hole.kind == cl::Hole::Kind::tap;
  const path::Point end = work_.now.chunk->point(i + count - 1);
  // A hole that one step drills is no deep one: a control counts its steps from the clearance, and would take
  // two.
  const bool has_steps = hole.kind == cl::Hole::Kind::peck || hole.kind == cl::Hole::Kind::chip_break;
  const bool steps = has_steps && hole.first_step_mm < hole.depth_mm;
  nc::Hole block;
  block.kind = has_steps && !steps ? nc::Hole::Kind::drill : static_cast<nc::Hole::Kind>(hole.kind);
  block.dwell_ms = std::llround(hole.dwell_s * 1000.0);
  block.source = where;
  if (is_tap && hole.feed.mode != cl::FeedMode::inverse) {
    const auto thread = thread_of(hole, where);
    if (!thread) return tl::unexpected(thread.error());
    block.thread = *thread;
  }
  const nc::Template& words_of_cycle = work_.posting.controller.cycles.words(block);
  // Controls have no drilling cycles under tool-centre-point control.
  if (words_of_cycle.empty() || work_.posting.options.rtcp || count > kMostMotions ||
      hole.feed.mode == cl::FeedMode::inverse || (steps && hole.first_step_mm != hole.step_mm) ||
      (!hole.across && (!work_.at.known || (work_.at.approaches && !work_.now.chunk->points[i].rapid))))
    return false;
  if (hole.across || work_.at.approaches) {
    // What is not at the height of the hole's motions is positioned for first; rotary axes never turn in a
    // cycle.
    if (auto done = go_across(hole, i, nc::holds(words_of_cycle, "x")); !done)
      return tl::unexpected(done.error());
  }
  if (!work_.same_rotary(work_.at.joints, end.q) && !work_.planes.in_force()) return false;

  const double tolerance_mm = work_.posting.options.tolerance_mm;
  const auto at = [&](double height) { return words_.xyz(hole.top_P + hole.axis_P * height, end.q); };
  const Vec3 middle = at(0.5 * (hole.clear_mm - hole.depth_mm));
  const Vec3 bottom = at(-hole.depth_mm);
  const Vec3 clear = at(hole.clear_mm);
  const Vec3 way = clear - bottom;
  const double length_mm = hole.clear_mm + hole.depth_mm;
  if (std::hypot(way.x(), way.y()) > kSkewShare * tolerance_mm ||
      std::abs(way.z() - length_mm) > kSkewShare * tolerance_mm)
    return false;
  for (std::size_t k = i; k < i + count; ++k) {  // within the limits
    if (const auto found = places_.of(work_.now.chunk->point(k), 0.0); !found)
      return tl::unexpected(found.error());
  }
  const nc::AxisFormat& format = work_.posting.controller.numbers.axes;
  const nc::AxisLetter z = nc::AxisLetter::Z;
  block.bottom = format.quanta(z, bottom.z());
  block.clear = format.quanta(z, clear.z());
  if (steps) block.step = format.quanta(z, hole.step_mm);
  if (!(block.bottom < block.clear) || (steps && block.step <= 0)) return false;
  // Out at the feed: how far, controls differ in; to the clearance they agree.
  const bool stands_there = is_tap && !nc::holds(words_of_cycle, "clear");
  const bool to_clear =
      hole.leave_mm == hole.clear_mm || hole.kind == cl::Hole::Kind::feed_out || stands_there;
  const std::int64_t back = to_clear ? block.clear : format.quanta(z, at(hole.leave_mm).z());
  block.words = words_.quanta_of(middle);
  block.words.set(z, back);
  block.from = words_.quanta_of(words_.xyz_of(words_.of(work_.at.joints)));
  if (!to_clear && block.from[z] != back) {
    // A cycle returns to where it was switched on.
    const auto there = rise_over(hole, hole.leave_mm, end);
    if (!there) return tl::unexpected(there.error());
    block.from = *there;
    if (block.from[z] != back) return false;
  }
  if (stands_there && block.from[z] != block.clear) {
    const auto there = rise_over(hole, hole.clear_mm, end);
    if (!there) return tl::unexpected(there.error());
    block.from = *there;
    if (block.from[z] != block.clear) return false;
  }
  const auto rate = blocks_.rate_of(hole.feed, length_mm, where);
  if (!rate) return tl::unexpected(rate.error());
  if (is_tap) {
    const double turns_s = static_cast<double>(block.thread.rpm) / kSecondsPerMinute;
    block.feed = work_.posting.controller.numbers.feed.quanta(
        nc::FeedMode::per_minute, nc::kPitchUnit_mm * static_cast<double>(block.thread.pitch) * turns_s);
  } else {
    static_cast<void>(feed_word(*rate, length_mm, block.feed));
  }
  if (!nc::holds(words_of_cycle, "x")) {
    // Called where the tool stands.
    const Vec3 stands = words_.xyz_of(words_.of(work_.at.joints));
    if (std::hypot(stands.x() - middle.x(), stands.y() - middle.y()) > kRoundingShare * tolerance_mm)
      return false;
    block.words.set(nc::AxisLetter::X, block.from[nc::AxisLetter::X]);
    block.words.set(nc::AxisLetter::Y, block.from[nc::AxisLetter::Y]);
  }
  if (auto done = work_.posting.write(block); !done) return tl::unexpected(done.error());
  const JointVector q = words_.joints_of(block.words, end.q);
  work_.moved(q, seconds_of(block, end.q));
  work_.at.point = end;
  work_.at.joints = q;
  work_.course.leave_segment();
  ++work_.posting.report.holes;
  if (is_tap) work_.spindle.tapped();
  if (to_clear && hole.leave_mm > hole.clear_mm) {
    if (auto done = blocks_.rapid_to(end); !done) return tl::unexpected(done.error());
  }
  return true;
}

// The rapid to above the hole; none where the cycle itself goes there, at the height at which the tool is.
Result<void> ShapeMaker::go_across(const cl::Hole& hole, std::size_t i, bool cycle_goes) {
  const path::Point to = work_.now.chunk->point(i);
  if (cycle_goes && work_.at.known && !work_.at.approaches && work_.same_rotary(work_.at.joints, to.q)) {
    const std::int64_t now = words_.quanta_of(words_.xyz_of(words_.of(work_.at.joints)))[nc::AxisLetter::Z];
    const std::int64_t there = words_.quanta_of(words_.xyz(to.tip_P, to.q))[nc::AxisLetter::Z];
    const std::int64_t leave =
        words_.quanta_of(words_.xyz(hole.top_P + hole.axis_P * hole.leave_mm, to.q))[nc::AxisLetter::Z];
    const bool to_clear = hole.leave_mm == hole.clear_mm || hole.kind == cl::Hole::Kind::feed_out;
    if (now == there && (to_clear || now == leave)) return {};
  }
  return segments_.make(to, work_.now.chunk->motion(i), segments_.prepared(i));
}

double ShapeMaker::seconds_of(const nc::Hole& hole, const JointVector& at) const {
  const double rate = work_.posting.controller.numbers.feed.internal(nc::FeedMode::per_minute, hole.feed);
  double seconds = 0.0;
  JointVector q = work_.at.joints;
  Vec3 before = words_.xyz_of(words_.of(work_.at.joints));
  for (const nc::Stroke& stroke :
       nc::strokes_of(hole, work_.posting.controller.cycles, work_.posting.controller.numbers.axes)) {
    const Vec3 to(stroke.xyz_mm[0], stroke.xyz_mm[1], stroke.xyz_mm[2]);
    const JointVector next = words_.joints_of(words_.quanta_of(to), at);
    seconds += (stroke.rapid ? work_.planner.axes().rapid_seconds(q, next) : (to - before).norm() / rate) +
               stroke.dwell_s;
    before = to;
    q = next;
  }
  return seconds;
}

}  // namespace trunnion::post
