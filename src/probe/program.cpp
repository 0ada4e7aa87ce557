#include "trunnion/probe/program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/nc/writer.hpp"

#include "probe/clearances.hpp"
#include "probe/head_lines.hpp"

namespace trunnion::probe {
namespace {

// Height of the sideways touches over the ball's equator, of the distance at which the centres touch: far
// enough up that the shank, which is thinner than the stylus ball, stays clear where the ball lies higher
// than expected.
constexpr double kUp = 0.3;
constexpr double kPastContact_mm = 1.0;
// Where a rapid from the safe height ends at least, over the place of the first touch.
constexpr double kRapidAbove_mm = 20.0;

// A stroke of the stylus at one pose: offsets of its centre from the ball's, in the axes of M, mm.
struct Line {
  Vec3 over, from, to;
};

struct PoseStrokes {
  Vec3 above;
  std::vector<Line> lines;  // the first from above
};

PoseStrokes strokes_at(const Machine& machine, const Ball& ball, const JointVector& q, std::size_t sides) {
  PoseStrokes out;
  const double apart = ball.apart_mm();
  const double reach = ball.reach_mm();
  // How deep a stroke has to go that meets the ball off its middle by what is not known of its place.
  const double glancing = reach - std::sqrt(std::max(0.0, reach * reach - ball.within_mm * ball.within_mm));
  const double deep = ball.within_mm + glancing + kPastContact_mm;
  out.above = {0.0, 0.0, apart};
  out.lines.push_back({out.above, out.above, {0.0, 0.0, std::max(reach - deep, 0.0)}});
  // The stem leaves the ball against the table's normal, unless it is said: where it leans, it stands between
  // two of the touches.
  const Mat3 R = part_in_machine(machine, q).R;
  const Vec3 stem = ball.stem ? Vec3(R * (ball.stem->end_P - ball.place_P).normalized()) : Vec3(-R.col(2));
  constexpr double kLeans = 0.05;
  const double step = kTwoPi / static_cast<double>(sides);
  const double first =
      std::hypot(stem.x(), stem.y()) > kLeans ? std::atan2(stem.y(), stem.x()) + 0.5 * step : 0.0;
  const double side = reach * std::sqrt(1.0 - kUp * kUp);
  for (std::size_t i = 0; i < sides; ++i) {
    const double angle = first + step * static_cast<double>(i);
    const Vec3 d(std::cos(angle), std::sin(angle), 0.0);
    const Vec3 height = Vec3::UnitZ() * (kUp * reach);
    out.lines.push_back({apart * d + out.above, apart * d + height, std::max(side - deep, 0.0) * d + height});
  }
  return out;
}

class ProgramMaker {
 public:
  ProgramMaker(const Machine& machine, const nc::Controller& controller, const ProgramOptions& options)
      : machine_(machine),
        controller_(controller),
        options_(options),
        tool_mm_(0.0, 0.0, -options.ball.stylus_length_mm),
        writer_(controller, out_.text) {}

  Result<MadeProgram> make() {
    PoseChoice choice;
    choice.ball_P = options_.ball.place_P;
    choice.count = options_.poses;
    choice.planned = options_.planned;
    choice.largest_tilt = options_.largest_tilt;
    choice.rounded = [this](AxisId id, double angle) {
      return controller_.numbers.axes.rounded(letter(id), angle);
    };
    choice.reachable = [this](const JointVector& q) { return is_reachable(q); };
    if (machine_.output_point == OutputPoint::spindle && controller_.length.automatic) {
      return fail(ErrorCode::wrong_use,
                  "the machine file asks for words of the spindle's gauge point ([output] point), and the "
                  "control '" +
                      controller_.name +
                      "' adds the length of every tool that it loads: it needs point = \"tip\"",
                  machine_.file);
    }
    out_.chosen = choose_poses(machine_, choice);
    const auto& poses = out_.chosen.poses;
    if (poses.empty()) {
      return fail(ErrorCode::check_failed,
                  "of the poses of the rotary axes only " + std::to_string(out_.chosen.candidates) +
                      " can be reached with the stylus on all sides of the ball; at least 4 are needed",
                  machine_.file);
    }
    begin();
    for (std::size_t i = 0; i < poses.size(); ++i) measure(poses[i], i, options_.both_senses ? 1 : 0);
    // There and back: the pose that the one way ends at is near the one that the other begins at.
    for (std::size_t i = poses.size(); options_.both_senses && i-- > 0;) measure(poses[i], i, -1);
    retract();
    take(writer_.write(nc::ProbeLog{nc::ProbeLog::Kind::close, {}}));
    take(writer_.write(nc::ProgramEnd{}));
    if (!done_) return tl::unexpected(done_.error());
    return std::move(out_);
  }

 private:
  nc::AxisLetter letter(AxisId id) const { return *nc::axis_letter(machine_.axes[id].name); }

  // Joints that put the centre of the stylus ball beside that of the ball, at the rotary positions of `pose`.
  JointVector joints_at(const JointVector& pose, const Vec3& offset_M) const {
    JointVector q = pose;
    const Vec3 offset_P = part_in_machine(machine_, pose).R.transpose() * offset_M;
    solve_linear(machine_, options_.ball.place_P + offset_P, tool_mm_, q);
    return q;
  }

  // All that the stylus does at this pose: within the travel, clear of all that is given.
  bool is_reachable(const JointVector& pose) const {
    const PoseStrokes strokes = strokes_at(machine_, options_.ball, pose, options_.sides);
    const Ball& ball = options_.ball;
    JointVector at = joints_at(pose, strokes.above);
    if (const auto z = machine_.safe.z_mm()) at[*machine_.axis("Z")] = *z;
    const auto moves_to = [&](const Vec3& offset_M) {
      const JointVector to = joints_at(pose, offset_M);
      const bool clear =
          limit_violations(machine_, to).empty() && !obstructed_move(machine_, ball, at, to).has_value();
      at = to;
      return clear;
    };
    if (!moves_to(strokes.above)) return false;
    for (const Line& line : strokes.lines) {
      if (!moves_to(line.over) || !moves_to(line.from)) return false;
      const JointVector to = joints_at(pose, line.to);
      if (!limit_violations(machine_, to).empty() || obstructed_touch(machine_, ball, at, to)) return false;
      if (!moves_to(line.over)) return false;
    }
    return true;
  }

  void take(const Result<void>& written) {
    if (done_ && !written) done_ = written;
  }
  void say(const std::string& text) { take(writer_.write(nc::Comment{text})); }

  void begin() {
    take(writer_.write(nc::ProgramStart{"PROBE", 1}));
    take(writer_.write(nc::ProbeLog{nc::ProbeLog::Kind::declare, {}}));
    for (const std::string& line : head_lines(options_.ball)) say(line);
    say("tool " + std::to_string(options_.tool) +
        " is the stylus, its length goes to the centre of its ball");
    say("the probe must be on: press its stylus by hand before the start, the control must show the touch");
    say("the spindle must stand still; around the ball's centre " +
        fixed_text(options_.ball.apart_mm() + options_.ball.stylus_radius_mm, 1) +
        " mm must be free but for its stem");
    for (const std::string& line : options_.head) say(line);
    if (const auto fault = swept_ball_fault(machine_, options_.ball)) {
      out_.before_start = *fault;
      say("before the start turn the rotary axes to pose 1 by hand: elsewhere the ball may be in the way");
    }
    if (!controller_.probing.confirmed) say("nobody has run these probing words on such a control yet");
    say(std::to_string(out_.chosen.poses.size()) + " poses; touches go to " + options_.log);
    if (controller_.tcp.unknown_at_start) take(writer_.write(nc::TcpControl{}));
    take(writer_.write(nc::WorkOffset{machine_.work_offset}));
    if (!controller_.tool_change.empty()) take(writer_.write(nc::ToolCall{options_.tool, options_.tool}));
    retract();
    if (machine_.output_point == OutputPoint::tip) take(writer_.write(nc::LengthCompensation{options_.tool}));
    take(writer_.write(nc::ProbeLog{nc::ProbeLog::Kind::open, options_.log}));
  }

  void retract() {
    if (done_ && controller_.retract[nc::index(nc::AxisLetter::Z)].empty())
      done_ = fail(ErrorCode::wrong_input, "[retract] Z has no words: the program needs a safe height",
                   controller_.file);
    if (done_ && !machine_.safe.z_mm())
      done_ = fail(ErrorCode::wrong_input, "the machine has no safe height: [retract] z_mm", machine_.file);
    if (!done_) return;
    nc::Retract block;
    if (controller_.names_position(nc::AxisLetter::Z))
      block.to.set(nc::AxisLetter::Z,
                   controller_.numbers.axes.quanta(nc::AxisLetter::Z, *machine_.safe.z_mm()));
    take(writer_.write(block));
  }

  nc::AxisWords words(const JointVector& q) const {
    const JointVector values = words_of(machine_, q, tool_mm_);
    nc::AxisWords out;
    for (AxisId id = 0; id < machine_.axes.size(); ++id)
      out.set(letter(id), controller_.numbers.axes.quanta(letter(id), values[id]));
    return out;
  }

  // On the way back from a touch the stylus is still pressed: no control may stop for that.
  void go_back(const JointVector& q) { move(q, nc::MotionKind::feed); }

  // Where a rapid down to `first` ends, machine Z: over every place at which the ball can be, even where the
  // file has the sense of a rotary axis wrong. Below it a control that watches the probe stops at a feed.
  double rapid_end(const JointVector& first, double safe) const {
    const AxisId id = *machine_.axis("Z");
    const Axis& z = machine_.axes[id];
    if (machine_.safe.away == 0) return safe;
    const double rise = z.carries_part ? -z.direction.z() : z.direction.z();
    const double never =
        (never_met_above_mm(machine_, options_.ball) + options_.ball.stylus_length_mm) / rise;
    const double above = first[id] + machine_.safe.away * kRapidAbove_mm;
    return machine_.safe.away * (never - above) > 0.0 ? never : above;
  }

  // Where nobody expects a touch; guarded on controls that have words for it.
  void go(const JointVector& q) {
    if (controller_.probing.guarded.empty()) return move(q, nc::MotionKind::feed);
    // A measuring block that goes nowhere measures nothing, and says what the one before it said.
    constexpr double kNowhere_mm = 1e-4;
    if ((linear(q) - at_).norm() < kNowhere_mm) return;
    nc::Probe guarded;
    guarded.guards = true;
    guarded.first = !std::exchange(guarded_before_, true);
    guarded.feed = feed(options_.move_mm_s);
    guarded.words = words(q);
    guarded.words.forget(static_cast<std::uint16_t>(~nc::kXyz));
    take(writer_.write(guarded));
    note(q, true);
  }

  Vec3 linear(const JointVector& q) const {
    return {q[*machine_.axis("X")], q[*machine_.axis("Y")], q[*machine_.axis("Z")]};
  }

  void note(const JointVector& q, bool at_feed) {
    const Vec3 to = linear(q);
    if (at_feed) out_.seconds += (to - at_).norm() / options_.move_mm_s;
    at_ = to;
  }

  void move(const JointVector& q, nc::MotionKind kind, std::uint16_t axes = nc::kAllAxes) {
    nc::Motion motion;
    motion.kind = kind;
    motion.words = words(q);
    motion.words.forget(static_cast<std::uint16_t>(~axes));
    if (kind == nc::MotionKind::feed) motion.feed = feed(options_.move_mm_s);
    take(writer_.write(motion));
    note(q, kind == nc::MotionKind::feed);
  }

  std::int64_t feed(double mm_s) const {
    return controller_.numbers.feed.quanta(nc::FeedMode::per_minute, mm_s);
  }

  // Towards `to` until it touches, and back the same way.
  void touch(const JointVector& from, const JointVector& to, double mm_s) {
    nc::Probe probe;
    probe.feed = feed(mm_s);
    probe.words = words(to);
    probe.words.forget(static_cast<std::uint16_t>(~nc::kXyz));
    take(writer_.write(probe));
    take(writer_.write(nc::ProbeLog{nc::ProbeLog::Kind::record, options_.log}));
    ++out_.touches;
    out_.seconds += (options_.ball.within_mm + options_.ball.clearance_mm) / mm_s;
    go_back(from);
  }

  // Beside `pose`, so that each rotary axis reaches it in that sense; where its travel ends it stays.
  JointVector before(const JointVector& pose, int sense) const {
    constexpr double kOverrun = 3.0 * kRadPerDegree;
    JointVector out = pose;
    for (const AxisId id : machine_.rotary_axes()) {
      const double at = controller_.numbers.axes.rounded(letter(id), pose[id] - sense * kOverrun);
      if (machine_.axes[id].within_limits(at)) out[id] = at;
    }
    return out;
  }

  // `sense`: in which the rotary axes reach the pose; 0: as they come.
  void measure(const JointVector& pose, std::size_t number, int sense) {
    const PoseStrokes strokes = strokes_at(machine_, options_.ball, pose, options_.sides);
    std::string at;
    for (const AxisId id : machine_.rotary_axes())
      at += " " + machine_.axes[id].name + fixed_text(pose[id] * kDegreePerRad, 3);
    const bool first_pose = std::exchange(first_pose_, false);
    say("pose " + std::to_string(number + 1) + " of " + std::to_string(out_.chosen.poses.size()) + ":" + at);
    retract();
    JointVector up = joints_at(pose, strokes.above);
    const JointVector first = up;
    const AxisId z = *machine_.axis("Z");
    const auto away = static_cast<double>(machine_.safe.away == 0 ? 1 : machine_.safe.away);
    const double safe = machine_.safe.z_mm().value_or(0.0) - away * kBelowSafe_mm;
    if (sense != 0) move(before(up, sense), nc::MotionKind::rapid, nc::kRotaryAxes);
    move(up, nc::MotionKind::rapid, nc::kRotaryAxes);
    move(up, nc::MotionKind::rapid, nc::kPlaneWords);
    const bool guards = !controller_.probing.guarded.empty();
    if (first_pose) {
      // From the safe height on nothing moves down but as a touch: the ball may be where nobody expects it.
      up[z] = safe;
      move(up, nc::MotionKind::rapid);
      if (guards) {
        up[z] = safe - away * kBelowSafe_mm;
        go(up);
      }
      touch(up, joints_at(pose, strokes.lines[0].to), options_.first_mm_s);
      out_.seconds += std::abs(up[z] - first[z]) / options_.first_mm_s;
    } else {
      const double high = rapid_end(first, safe);
      up[z] = !guards && away * (safe - high) > 0.0 ? high : safe;
      move(up, nc::MotionKind::rapid);
    }
    go(first);
    for (std::size_t i = 0; i < strokes.lines.size(); ++i) {
      const Line& line = strokes.lines[i];
      const JointVector over = joints_at(pose, line.over);
      const JointVector from = joints_at(pose, line.from);
      const JointVector to = joints_at(pose, line.to);
      go(over);
      go(from);
      touch(from, to, options_.fast_mm_s);
      touch(from, to, options_.slow_mm_s);
      go(over);
    }
  }

  const Machine& machine_;
  const nc::Controller& controller_;
  const ProgramOptions& options_;
  Vec3 tool_mm_;
  MadeProgram out_;
  nc::Writer writer_;
  Result<void> done_;
  Vec3 at_ = Vec3::Zero();
  bool guarded_before_ = false;
  bool first_pose_ = true;
};

}  // namespace

double most_within_mm(double reach_mm) {
  return 0.6 * reach_mm;
}

Result<MadeProgram> make_program(const Machine& machine, const nc::Controller& controller,
                                 const ProgramOptions& options) {
  if (!controller.has_probing())
    return fail(ErrorCode::wrong_input, "the control has no words for touches: [probing] touch",
                controller.file);
  if (machine.rotary_axes().empty())
    return fail(ErrorCode::wrong_input,
                "the machine has no rotary axis: there is nothing to find with a ball", machine.file);
  for (const char* name : {"X", "Y", "Z"}) {
    if (!machine.axis(name))
      return fail(ErrorCode::wrong_input, std::string("the machine has no axis ") + name, machine.file);
  }
  if (const auto inside = inside_table_mm(machine, options.ball.place_P)) {
    return fail(ErrorCode::wrong_use,
                "--ball-mm: the ball's centre is " + fixed_text(*inside, 3) + " mm below the table's top",
                machine.file);
  }
  if (const auto fault = safe_height_fault(machine, options.ball.stylus_length_mm))
    return fail(ErrorCode::check_failed, *fault, machine.file);
  return ProgramMaker(machine, controller, options).make();
}

}  // namespace trunnion::probe
