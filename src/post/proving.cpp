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

double middle(const Axis& axis) {
  return axis.has_limits() ? 0.5 * (axis.min + axis.max) : 0.0;
}

}  // namespace

std::vector<AxisWords> describe_axes(const Machine& machine) {
  std::vector<AxisWords> out;
  for (const Axis& axis : machine.axes) {
    const bool rotary = axis.kind == AxisKind::rotary;
    AxisWords words;
    words.name = axis.name;
    words.motion = rotary ? rotary_text(axis) : linear_text(axis);
    words.limits =
        axis.has_limits() ? number(axis, axis.min) + " to " + number(axis, axis.max) : "turns for ever";
    const double per_minute = axis.rapid.value_or(0.0) * kSecondsPerMinute * (rotary ? kDegreePerRad : 1.0);
    words.rapid = axis.rapid ? fixed_text(per_minute, 0) + (rotary ? " deg/min" : " mm/min") : "not given";
    out.push_back(words);
  }
  return out;
}

Result<std::string> proving_program(const Machine& machine, const nc::Controller& controller) {
  std::string text;
  nc::Writer writer(controller, text);
  std::vector<nc::Block> blocks;
  blocks.emplace_back(nc::ProgramStart{});
  blocks.emplace_back(nc::Comment{"proving program for " + machine.name});
  blocks.emplace_back(nc::Comment{"no tool, no part, low override"});
  constexpr double kStep_mm = 20.0;
  constexpr double kStep_rad = 10.0 * kRadPerDegree;
  const auto words = describe_axes(machine);
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id) q[id] = middle(machine.axes[id]);
  const auto motion = [&](AxisId only, double value) {
    nc::Motion m;
    const nc::AxisLetter letter = *nc::axis_letter(machine.axes[only].name);
    JointVector at = q;
    at[only] = value;
    m.words.set(letter,
                controller.numbers.axes.quanta(letter, words_of(machine, at, machine.tool_vector())[only]));
    return m;
  };
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    const double wanted = axis.kind == AxisKind::rotary ? kStep_rad : kStep_mm;
    const double step = axis.has_limits() ? std::min(wanted, 0.25 * (axis.max - axis.min)) : wanted;
    blocks.emplace_back(motion(id, q[id]));
    blocks.emplace_back(nc::Comment{axis.name + " plus: " + words[id].motion});
    blocks.emplace_back(nc::Stop{});
    blocks.emplace_back(motion(id, q[id] + step));
    blocks.emplace_back(nc::Stop{});
    blocks.emplace_back(motion(id, q[id]));
  }
  blocks.emplace_back(nc::ProgramEnd{});
  for (const nc::Block& block : blocks) {
    if (auto written = writer.write(block); !written) return tl::unexpected(written.error());
  }
  return text;
}

}  // namespace trunnion::post
