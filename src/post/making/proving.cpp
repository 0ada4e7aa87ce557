#include "trunnion/post/proving.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/nc/writer.hpp"

namespace trunnion::post {
namespace {

// "+X", or the components when no machine axis is near.
std::string direction_text(const Vec3& v) {
  constexpr double kAlong = 0.9999;  // within 0.8 deg of a machine axis
  constexpr std::array kNames = {"X", "Y", "Z"};
  for (int i = 0; i < 3; ++i) {
    if (std::abs(v[i]) > kAlong)
      return std::string(v[i] > 0.0 ? "+" : "-") + kNames[static_cast<std::size_t>(i)];
  }
  return "(" + fixed_text(v.x(), 3) + ", " + fixed_text(v.y(), 3) + ", " + fixed_text(v.z(), 3) + ")";
}

std::string towards_text(const Vec3& v) {
  constexpr double kUp = 0.9999;
  const std::string name = direction_text(v);
  return v.z() > kUp ? "up (+Z)" : v.z() < -kUp ? "down (-Z)" : "towards " + name;
}

std::string body(const Axis& axis) {
  return axis.carries_part ? "the table" : "the tool";
}

std::string linear_text(const Axis& axis) {
  std::string text = body(axis) + " moves " + towards_text(axis.direction);
  if (axis.carries_part) text += ": the tool, seen from the part, goes " + towards_text(-axis.direction);
  return text;
}

// A side of the table that shows the turn best: horizontal, across the axis.
std::string rotary_text(const Axis& axis) {
  const Vec3& n = axis.direction;
  Vec3 side = std::abs(n.z()) > 0.99 ? Vec3::UnitX() : n.cross(Vec3::UnitZ()).normalized();
  if (side.sum() < 0.0) side = -side;
  const Vec3 goes = n.cross(side);
  return body(axis) + " turns about machine " + direction_text(n) + " (right hand): its side towards " +
         direction_text(side) + " goes " + towards_text(goes);
}

std::string number(const Axis& axis, double value) {
  return axis.kind == AxisKind::rotary ? fixed_text(value * kDegreePerRad, 4) + " deg"
                                       : fixed_text(value, 3) + " mm";
}

// +1 where a positive command of Z takes the tool away from the part.
double away_from_part(const Axis& z) {
  return (z.direction.z() < 0.0) == z.carries_part ? 1.0 : -1.0;
}

constexpr double kStep_mm = 5.0;
constexpr double kStep_rad = 5.0 * kRadPerDegree;
constexpr double kFeed_mm_s = 200.0 / kSecondsPerMinute;
constexpr double kFeed_rad_s = 3.0 * kRadPerDegree;
constexpr double kShareOfTravel = 0.25;

/// Writes the steps, each announced and behind a stop.
class ProvingProgram {
 public:
  ProvingProgram(const Machine& machine, const nc::Controller& controller, std::string& text)
      : machine_(machine),
        controller_(controller),
        words_(describe_axes(machine)),
        writer_(controller, text) {}

  Result<void> write() {
    const auto z = machine_.axis("Z");
    if (!z) return fail(ErrorCode::wrong_input, "a proving program needs an axis Z", machine_.file);
    const Axis& axis = machine_.axes[*z];
    const double away = away_from_part(axis);
    const SafeHeight& safe = machine_.safe;
    const bool names_position = controller_.names_position(nc::AxisLetter::Z);
    const bool retracts = !controller_.retract[nc::index(nc::AxisLetter::Z)].empty() && safe.z_mm() &&
                          (names_position || safe.z_is_given);
    head(retracts);
    step(*z, away,
         words_[*z].motion + opposite(away) + ". If not: reset, the machine file has Z the wrong way round");
    if (retracts) {
      announce("Z goes to the safe height, machine Z " + fixed_text(*safe.z_mm(), 3) + ", at rapid rate");
      nc::Retract retract;
      if (names_position)
        retract.to.set(nc::AxisLetter::Z, controller_.numbers.axes.quanta(nc::AxisLetter::Z, *safe.z_mm()));
      take(writer_.write(retract));
    }
    // From the end of its travel Z can only come down.
    step(*z, -away, "towards the part");
    step(*z, away, "back");
    for (const AxisKind kind : {AxisKind::linear, AxisKind::rotary}) {
      for (AxisId id = 0; id < machine_.axes.size(); ++id) {
        if (machine_.axes[id].kind != kind || id == *z) continue;
        step(id, 1.0, words_[id].motion);
        step(id, -1.0, "back");
      }
    }
    take(writer_.write(nc::ProgramEnd{}));
    return done_;
  }

 private:
  static std::string opposite(double sense) {
    return sense < 0.0 ? ", for a positive command; here the other way" : "";
  }

  void take(const Result<void>& written) {
    if (done_ && !written) done_ = written;
  }
  void say(const std::string& text) { take(writer_.write(nc::Comment{text})); }

  void head(bool retracts) {
    take(writer_.write(nc::ProgramStart{}));
    say("proving program for " + machine_.name);
    say("before the start: no tool and no part in the machine, low override, a hand on feed hold");
    say("before the start: reset the control. No tool length, no tool-centre-point control, no tilted plane "
        "may be "
        "in force");
    say("before the start: jog to where every linear axis has 10 mm of room both ways and every rotary axis "
        "10 deg");
    if (!retracts)
      say("before the start: jog Z to the safe height. There are no words for it: [retract] Z in the "
          "controller file");
    say("every move waits for cycle start: read the line before it, and look");
  }

  void announce(const std::string& text) {
    say(std::to_string(++moves_) + ": " + text);
    take(writer_.write(nc::Stop{}));
  }

  void step(AxisId id, double sense, const std::string& what) {
    const Axis& axis = machine_.axes[id];
    const bool rotary = axis.kind == AxisKind::rotary;
    const nc::AxisLetter letter = *nc::axis_letter(axis.name);
    double way = rotary ? kStep_rad : kStep_mm;
    if (axis.has_limits()) way = std::min(way, kShareOfTravel * (axis.max - axis.min));
    const std::int64_t quanta = controller_.numbers.axes.quanta(letter, sense * way);
    const double rate =
        std::min(rotary ? kFeed_rad_s : kFeed_mm_s, axis.rapid.value_or(rotary ? kFeed_rad_s : kFeed_mm_s));
    const nc::FeedFormat& format = controller_.numbers.feed;
    announce(axis.name + (quanta < 0 ? " -" : " +") +
             shortest_text(std::abs(rotary ? sense * way * kDegreePerRad : sense * way)) +
             (rotary ? " deg: " : " mm: ") + what);
    take(writer_.step(letter, quanta,
                      rotary ? format.rotary_quanta(rate) : format.quanta(nc::FeedMode::per_minute, rate)));
  }

  const Machine& machine_;
  const nc::Controller& controller_;
  std::vector<AxisWords> words_;
  nc::Writer writer_;
  Result<void> done_;
  int moves_ = 0;
};

}  // namespace

std::vector<AxisWords> describe_axes(const Machine& machine) {
  std::vector<AxisWords> out;
  for (const Axis& axis : machine.axes) {
    const bool rotary = axis.kind == AxisKind::rotary;
    AxisWords words;
    words.name = axis.name;
    words.motion = rotary ? rotary_text(axis) : linear_text(axis);
    words.limits = axis.has_limits() ? number(axis, axis.min) + " to " + number(axis, axis.max) : "unlimited";
    const double per_minute = axis.rapid.value_or(0.0) * kSecondsPerMinute * (rotary ? kDegreePerRad : 1.0);
    words.rapid = axis.rapid ? fixed_text(per_minute, 0) + (rotary ? " deg/min" : " mm/min") : "not given";
    out.push_back(words);
  }
  return out;
}

Result<std::string> proving_program(const Machine& machine, const nc::Controller& controller) {
  std::string text;
  if (auto written = ProvingProgram(machine, controller, text).write(); !written)
    return tl::unexpected(written.error());
  return text;
}

}  // namespace trunnion::post
