#include "trunnion/probe/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/nc/reader.hpp"

#include "probe/clearances.hpp"
#include "probe/head_lines.hpp"

namespace trunnion::probe {
namespace {

constexpr std::size_t kFewestTouches = 5;

bool same_rotary(const Machine& machine, const JointVector& a, const JointVector& b) {
  const auto axes = machine.rotary_axes();
  return std::all_of(axes.begin(), axes.end(), [&](AxisId id) { return a[id] == b[id]; });
}

// Follows the joints through the blocks of a program.
class StrokeReader {
 public:
  StrokeReader(const Machine& machine, const nc::Controller& controller)
      : machine_(machine), controller_(controller) {
    out_.must_guard = !controller.probing.guarded.empty();
    for (const Axis& axis : machine.axes) needed_ |= nc::AxisWords::bit(*nc::axis_letter(axis.name));
  }

  void take(const nc::Block& block) {
    if (const auto* comment = std::get_if<nc::Comment>(&block)) head_.take(comment->text);
    if (std::holds_alternative<nc::Retract>(block)) {
      at_safe_height_ = true;
      behind_touch_ = -1;
      knows_ = false;
    }
    if (std::holds_alternative<nc::ToolCall>(block)) knows_ = false;
    if (const auto* motion = std::get_if<nc::Motion>(&block)) take(*motion);
    if (const auto* probe = std::get_if<nc::Probe>(&block)) take(*probe);
  }

  Result<Strokes> finish(const std::string& file) {
    if (fault_) return fail(ErrorCode::wrong_input, fault_->message, file, {fault_->line, 0});
    if (const auto missing = head_.missing()) {
      return fail(ErrorCode::wrong_input,
                  "the program's head has no line '" + *missing +
                      ":': it was not written by 'trunnion probe program', or its comments were cut out",
                  file);
    }
    if (out_.touches.empty()) return fail(ErrorCode::wrong_input, "the program has no touch", file);
    out_.ball = head_.ball();
    find_measuring();
    // Words hold positions of the tip or of the spindle; the length is known now.
    const Vec3 tool_mm(0.0, 0.0, -out_.ball.stylus_length_mm);
    for (Touch& touch : out_.touches) {
      touch.from = joints_of_words(machine_, touch.from, tool_mm);
      touch.to = joints_of_words(machine_, touch.to, tool_mm);
    }
    for (Move& move : out_.moves) {
      move.from = joints_of_words(machine_, move.from, tool_mm);
      move.to = joints_of_words(machine_, move.to, tool_mm);
    }
    for (JointVector& pose : out_.poses) pose = joints_of_words(machine_, pose, tool_mm);
    return std::move(out_);
  }

 private:
  JointVector values(const nc::AxisWords& words) const {
    JointVector out;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const auto letter = *nc::axis_letter(machine_.axes[id].name);
      if (words.has(letter)) out[id] = controller_.numbers.axes.internal(letter, words[letter]);
    }
    return out;
  }

  void take(const nc::Motion& motion) { take_move(motion.words, motion.source.line); }

  void take_move(const nc::AxisWords& words, std::uint32_t line, bool guarded = false) {
    Move move;
    move.line = line;
    move.guarded = guarded;
    move.to = values(words);
    move.knows_to = (words.mask & needed_) == needed_;
    move.from = at_;
    move.knows_from = knows_;
    move.knows_plane = knows_plane_;
    knows_plane_ = knows_plane_ || (words.has(nc::AxisLetter::X) && words.has(nc::AxisLetter::Y));
    move.behind_touch = std::exchange(behind_touch_, -1);
    move.turns = !same_rotary(machine_, at_, move.to) || !knows_rotary_;
    if (move.turns) turn_to(move.to);
    knows_rotary_ = true;
    move.at_safe_height = at_safe_height_ && !words.has(nc::AxisLetter::Z);
    if (words.has(nc::AxisLetter::Z)) at_safe_height_ = false;
    at_ = move.to;
    knows_ = move.knows_to;
    out_.moves.push_back(move);
  }

  // An axis that counts modulo one turn takes the shorter way.
  void turn_to(const JointVector& to) {
    ++turns_;
    for (const AxisId id : machine_.rotary_axes()) {
      double way = to[id] - at_[id];
      if (controller_.rotary.is_modulo(*nc::axis_letter(machine_.axes[id].name)))
        way = std::remainder(way, kTwoPi);
      constexpr double kStands = 1e-9;
      if (!knows_rotary_ || std::abs(std::abs(way) - kPi) < kStands)
        sense_[id] = 0;
      else if (std::abs(way) > kStands)
        sense_[id] = way > 0.0 ? 1 : -1;
    }
  }

  void take(const nc::Probe& probe) {
    if (!std::exchange(learned_, true) && !probe.first && !controller_.probing.first.empty())
      out_.not_learned = probe.source.line;
    if (probe.guards) return take_move(probe.words, probe.source.line, true);
    Touch touch;
    touch.line = probe.source.line;
    touch.feed = probe.feed;
    if (!knows_ || (probe.words.mask & needed_) != needed_) {
      if (!fault_) fault_ = Fault{"a touch from a place that is not known", touch.line};
      return;
    }
    touch.from = at_;
    touch.to = values(probe.words);
    touch.turns = turns_;
    if (out_.touches.empty() || out_.touches.back().turns != turns_) {
      out_.poses.push_back(touch.from);
      out_.senses.push_back(sense_);
    }
    touch.pose = out_.poses.size() - 1;
    behind_touch_ = static_cast<std::ptrdiff_t>(out_.touches.size());
    knows_ = false;
    out_.touches.push_back(touch);
  }

  // A touch is followed by a slower one with the same end, or it is the last of them.
  void find_measuring() {
    auto& touches = out_.touches;
    for (std::size_t i = 0; i < touches.size(); ++i) {
      const bool goes_on = i + 1 < touches.size() && touches[i + 1].to == touches[i].to &&
                           touches[i + 1].turns == touches[i].turns;
      touches[i].measures = !goes_on;
    }
  }

  struct Fault {
    std::string message;
    std::uint32_t line;
  };
  const Machine& machine_;
  const nc::Controller& controller_;
  HeadReader head_;
  Strokes out_;
  JointVector at_;
  bool knows_ = false, knows_rotary_ = false, knows_plane_ = false;
  bool at_safe_height_ = false;
  bool learned_ = false;  // a motion that a touch stops was there
  std::ptrdiff_t behind_touch_ = -1;
  std::uint16_t needed_ = 0;
  std::size_t turns_ = 0;
  std::array<std::int8_t, kMaxAxes> sense_{};
  std::optional<Fault> fault_;
};

Vec3 tip_of(const Machine& machine, const Ball& ball, const JointVector& q) {
  return forward(machine, q, {0.0, 0.0, -ball.stylus_length_mm}).p;
}

std::string at_line(std::uint32_t line) {
  return "line " + std::to_string(line) + ": ";
}

// A rounded word may be this much beside the place that was meant, in each of three axes.
double slack_mm(const nc::AxisFormat& format) {
  return 2.0 * format.quantum(nc::AxisLetter::X);
}

}  // namespace

std::string Strokes::pose_text(const Machine& machine, std::size_t pose) const {
  std::string out = "pose " + std::to_string(pose + 1) + " (";
  bool first = true;
  for (const AxisId id : machine.rotary_axes()) {
    const std::string at = fixed_text(poses[pose][id] * kDegreePerRad, 3);
    out += (first ? "" : " ") + machine.axes[id].name + at;
    first = false;
  }
  return out + ")";
}

Result<Strokes> read_strokes(const Machine& machine, const nc::Controller& controller, std::string_view text,
                             const std::string& file, Diagnostics& diagnostics) {
  for (const char* name : {"X", "Y", "Z"}) {
    if (!machine.axis(name))
      return fail(ErrorCode::wrong_input, std::string("the machine has no axis ") + name, machine.file);
  }
  StrokeReader strokes(machine, controller);
  nc::ReaderOptions options;
  options.whole_program = true;
  nc::Reader reader(
      controller, file, diagnostics, [&](const nc::Block& block) { strokes.take(block); }, options);
  reader.feed(text);
  if (const auto done = reader.finish(); !done) return tl::unexpected(done.error());
  return strokes.finish(file);
}

std::vector<std::string> faults_of(const Machine& machine, const Strokes& strokes) {
  std::vector<std::string> out;
  const Ball& ball = strokes.ball;
  const double slack = slack_mm(nc::AxisFormat(3, 3));
  const auto check_limits = [&](const JointVector& q, std::uint32_t line) {
    for (const LimitViolation& v : limit_violations(machine, q)) {
      const Axis& axis = machine.axes[v.axis];
      const bool rotary = axis.kind == AxisKind::rotary;
      out.push_back(at_line(line) + "axis " + axis.name + " is " +
                    fixed_text(rotary ? v.by * kDegreePerRad : v.by, 4) + (rotary ? " deg" : " mm") +
                    " beyond its limit");
    }
  };
  if (strokes.not_learned) {
    out.push_back(at_line(*strokes.not_learned) +
                  "the first motion that a touch stops has not the words of [probing] first");
  }
  const auto at_the_top = [&](const Move& move) {
    const double z = move.to[*machine.axis("Z")];
    return machine.safe.z_mm() && std::abs(z - *machine.safe.z_mm()) <= kBelowSafe_mm + slack;
  };
  // Where the safe height is not over everything that the ball can sweep, each turn is looked at.
  const bool turns_matter = swept_ball_fault(machine, ball).has_value();
  const auto add = [&](std::uint32_t line, const std::optional<std::string>& fault) {
    if (fault) out.push_back(at_line(line) + *fault);
  };
  for (const Move& move : strokes.moves) {
    if (strokes.must_guard && !move.guarded && move.behind_touch < 0 && !move.at_safe_height &&
        !at_the_top(move))
      out.push_back(at_line(move.line) +
                    "a motion below the safe height that goes on where the probe is touched");
    if (move.knows_to) check_limits(move.to, move.line);
    if (move.turns && !move.at_safe_height)
      out.push_back(at_line(move.line) + "a rotary axis turns below the safe height");
    if (move.behind_touch >= 0) {
      const Touch& touch = strokes.touches[static_cast<std::size_t>(move.behind_touch)];
      if (!(move.to == touch.from))
        out.push_back(at_line(move.line) +
                      "the stylus does not go back the way it came from the touch of line " +
                      std::to_string(touch.line));
      continue;
    }
    if (move.at_safe_height && move.knows_plane && turns_matter)
      add(move.line, turn_fault(machine, ball, move.from, move.to));
    if (!move.knows_from || !move.knows_to || move.turns) {
      if (!move.at_safe_height && !move.turns && move.knows_to && move.knows_plane && machine.safe.z_mm()) {
        JointVector from = move.from;  // straight down from the safe height
        from[*machine.axis("Z")] = *machine.safe.z_mm();
        add(move.line, obstructed_move(machine, ball, from, move.to));
      }
      if (!move.at_safe_height && !move.knows_to)
        out.push_back(at_line(move.line) + "a motion whose end is not known");
      continue;
    }
    const double apart =
        distance_to_segment(ball.place_P, tip_of(machine, ball, move.from), tip_of(machine, ball, move.to));
    if (apart < ball.apart_mm() - slack)
      out.push_back(at_line(move.line) + "the centres of stylus and ball come within " +
                    fixed_text(apart, 4) + " mm, less than " + fixed_text(ball.apart_mm(), 4) + " mm");
  }
  std::vector<std::size_t> measured(strokes.poses.size(), 0);
  for (const Touch& touch : strokes.touches) {
    check_limits(touch.from, touch.line);
    check_limits(touch.to, touch.line);
    const Vec3 from = tip_of(machine, ball, touch.from);
    const Vec3 to = tip_of(machine, ball, touch.to);
    if ((from - ball.place_P).norm() < ball.apart_mm() - slack)
      out.push_back(at_line(touch.line) + "a touch begins " + fixed_text((from - ball.place_P).norm(), 4) +
                    " mm from the ball's centre, less than " + fixed_text(ball.apart_mm(), 4) + " mm");
    if (distance_to_segment(ball.place_P, from, to) > ball.reach_mm() - slack)
      out.push_back(at_line(touch.line) + "a touch that passes the ball");
    add(touch.line, obstructed_touch(machine, ball, touch.from, touch.to));
    if (touch.measures) ++measured[touch.pose];
  }
  for (std::size_t pose = 0; pose < measured.size(); ++pose) {
    if (measured[pose] < kFewestTouches)
      out.push_back(strokes.pose_text(machine, pose) + " has " + std::to_string(measured[pose]) +
                    " measuring touches, fewer than " + std::to_string(kFewestTouches));
  }
  return out;
}

}  // namespace trunnion::probe
