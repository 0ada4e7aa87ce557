#include "trunnion/machine/iso841.hpp"

#include <cmath>
#include <string_view>

#include "trunnion/base/number_text.hpp"

namespace trunnion {
namespace {

std::string text_of(const Vec3& direction) {
  return "[" + shortest_text(direction.x()) + ", " + shortest_text(direction.y()) + ", " +
         shortest_text(direction.z()) + "]";
}

}  // namespace

// ISO 841: a positive command moves the tool along the axis of that letter, seen from the part; a linear axis
// that carries the part goes the other way itself. A and B turn about X and Y, or lean to them (nutating).
std::vector<std::string> directions_beside_iso841(const Machine& machine) {
  std::vector<std::string> out;
  constexpr double kAlong = 0.7, kAbout = 0.5;  // cosines: 45 and 60 degrees
  constexpr std::string_view kLinear = "XYZ", kRotary = "ABC";
  for (const Axis& axis : machine.axes) {
    const bool rotary = axis.kind == AxisKind::rotary;
    const auto letter =
        axis.name.size() == 1 ? (rotary ? kRotary : kLinear).find(axis.name[0]) : std::string_view::npos;
    if (letter == std::string_view::npos) continue;
    const Vec3 tool_way = axis.carries_part && !rotary ? Vec3(-axis.direction) : axis.direction;
    const double along = tool_way[static_cast<Eigen::Index>(letter)];
    if (!rotary && along < kAlong)
      out.push_back("a positive " + axis.name + " moves the tool against the part along " +
                    text_of(tool_way) + ", by ISO 841 it is +" + axis.name +
                    ": is the part mirrored? (the direction is that of what moves: an axis that carries the "
                    "part goes the other way)");
    if (rotary && std::abs(along) < kAbout)
      out.push_back(axis.name + " turns about " + text_of(axis.direction) + ", by ISO 841 it turns about " +
                    kLinear[letter] + ": is the direction that of another axis?");
  }
  return out;
}

}  // namespace trunnion
