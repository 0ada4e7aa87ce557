#include "trunnion/probe/control_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/base/number_text.hpp"

namespace trunnion::probe {
namespace {

using Numbers = std::map<std::string, std::string>;

constexpr int kLengthDigits = 4;
constexpr int kDirectionDigits = 9;

void add_vector(Numbers& out, const std::string& name, const Vec3& v, int digits) {
  static constexpr std::array kLetters = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) out[name + kLetters[static_cast<std::size_t>(i)]] = fixed_text(v[i], digits);
}

Eigen::Index along_of(const Vec3& n) {
  Eigen::Index along = 0;
  n.cwiseAbs().maxCoeff(&along);
  return along;
}

void add_axis(Numbers& out, const std::string& name, const Vec3& point, const Vec3& n) {
  add_vector(out, name + ".", point, kLengthDigits);
  add_vector(out, name + ".n", n, kDirectionDigits);
  add_vector(out, name + ".against_", -n, kDirectionDigits);
  out[name + ".left_hand"] = n[along_of(n)] < 0.0 ? "1" : "0";
  out[name + ".axis"] = std::to_string(along_of(n) + 1);
}

Result<std::string> filled(const std::string& line, const Numbers& numbers, const std::string& file) {
  std::string out;
  std::size_t at = 0;
  while (at < line.size()) {
    const auto open = line.find('{', at);
    out += line.substr(at, open == std::string::npos ? open : open - at);
    if (open == std::string::npos) break;
    const auto close = line.find('}', open);
    const std::string name = line.substr(open + 1, close == std::string::npos ? close : close - open - 1);
    const auto number = numbers.find(name);
    if (close == std::string::npos || number == numbers.end())
      return fail(ErrorCode::wrong_input,
                  "[axis_numbers]: unknown placeholder {" + name + "} in '" + line + "'", file);
    out += number->second;
    at = close + 1;
  }
  return out;
}

}  // namespace

Result<std::vector<std::string>> control_numbers(const Machine& machine, const nc::Controller& controller) {
  const auto axes = machine.rotary_axes();
  std::string letters;
  for (const AxisId id : axes) letters += machine.axes[id].name;
  auto lines = controller.axis_numbers.find(letters);
  if (lines == controller.axis_numbers.end()) lines = controller.axis_numbers.find("any");
  if (axes.size() != 2 || lines == controller.axis_numbers.end())
    return fail(ErrorCode::wrong_input,
                "[axis_numbers] has no lines for the rotary axes " + letters +
                    ", and none for any: this control's "
                    "own numbers are not known here",
                controller.file);
  const Axis& outer = machine.axes[axes[0]];
  const Axis& inner = machine.axes[axes[1]];
  // The points of the common perpendicular.
  const Vec3 between = inner.point_mm - outer.point_mm;
  const double c = outer.direction.dot(inner.direction);
  const double a = between.dot(outer.direction);
  const double b = between.dot(inner.direction);
  const double square = 1.0 - c * c;
  const Vec3 p_outer = outer.point_mm + (a - b * c) / square * outer.direction;
  const Vec3 p_inner = inner.point_mm + (a * c - b) / square * inner.direction;
  Numbers numbers;
  add_axis(numbers, "outer", p_outer, outer.direction);
  add_axis(numbers, "inner", p_inner, inner.direction);
  add_vector(numbers, "minus_inner.", -p_inner, kLengthDigits);
  add_vector(numbers, "inner_from_outer.", p_inner - p_outer, kLengthDigits);
  add_vector(numbers, "outer_from_inner.", p_outer - p_inner, kLengthDigits);
  std::vector<std::string> out;
  for (const std::string& line : lines->second) {
    auto text = filled(line, numbers, controller.file);
    if (!text) return tl::unexpected(text.error());
    out.push_back(std::move(*text));
  }
  const auto hold = [&](const char* placeholder) {
    return std::any_of(lines->second.begin(), lines->second.end(),
                       [&](const std::string& line) { return line.find(placeholder) != std::string::npos; });
  };
  if (hold(".n") || hold(".against_")) return out;
  // One number for the sense of both.
  if (hold("outer.left_hand") && !hold("inner.left_hand") &&
      numbers["outer.left_hand"] != numbers["inner.left_hand"])
    return fail(ErrorCode::wrong_input,
                "this control's numbers take one sense for both rotary axes; here " + outer.name + " and " +
                    inner.name + " turn opposite ways for a positive command",
                machine.file);
  for (const AxisId id : axes) {
    const Vec3& n = machine.axes[id].direction;
    const Eigen::Index along = along_of(n);
    const Vec3 beside = Vec3::Unit(along) * (n[along] < 0.0 ? -1.0 : 1.0);
    const double off_deg = angle_between(n, beside).deg();
    constexpr double kSquare_deg = 1e-4;
    constexpr double kOblique_deg = 5.0;  // no error of a machine that is meant to be square
    const std::string off = "axis " + machine.axes[id].name + " is " + fixed_text(off_deg, 4) +
                            " deg off machine " + std::string(1, "XYZ"[along]);
    if (off_deg > kOblique_deg && lines->first != "any")
      return fail(ErrorCode::wrong_input, "this control's numbers are of square axes: " + off, machine.file);
    if (off_deg > kSquare_deg) out.push_back("these numbers do not hold that " + off);
  }
  return out;
}

}  // namespace trunnion::probe
