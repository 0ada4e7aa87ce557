#pragma once
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/pose.hpp"

// A chain of the tests' own, for programs of the machine of trunnion_offset.toml or another one that is
// written down here: words of any control to the tool in the part, with nothing of the library's kinematics
// or readers.
namespace trunnion::test {

struct PlacedTool {
  Vec3 tip, axis;
};

// v turned about the unit vector n: Rodrigues' formula.
inline Vec3 turned(const Vec3& v, const Vec3& n, double angle) {
  return std::cos(angle) * v + std::sin(angle) * n.cross(v) + (1.0 - std::cos(angle)) * n.dot(v) * n;
}

using FiveWords = std::array<double, 5>;  // X Y Z mm, both rotary axes, the outer one first, deg

// Two rotary axes that carry the part, the outer one first: a positive word turns the part about `axis` by
// the right hand. The words X Y Z are those of the tip.
struct OwnChain {
  std::string letters;
  std::array<Vec3, 2> axis, point;
  // Rotation vectors by which the bodies that they carry are turned before they turn, about these points:
  // tilts of the axes, rad.
  std::array<Vec3, 2> tilt = {Vec3::Zero(), Vec3::Zero()};
};
// The numbers of postconfigs/machines.
inline OwnChain own_chain(const std::string& machine) {
  const double half = std::sqrt(0.5);
  if (machine == "paper")
    return {"XYZAC", {Vec3(1, 0, 0), Vec3(0, 0, 1)}, {Vec3(0, 0, -200), Vec3(0, 0, -200)}};
  if (machine == "xyzac_trt")
    return {"XYZAC", {Vec3(1, 0, 0), Vec3(0, 0, 1)}, {Vec3(0, 20, 10), Vec3(0, 0, 0)}};
  if (machine == "nutating_45")
    return {"XYZBC", {Vec3(0, half, half), Vec3(0, 0, 1)}, {Vec3(0, 0, -120), Vec3(0, 0, -60)}};
  return {"XYZAC", {Vec3(-1, 0, 0), Vec3(0, 0, -1)}, {Vec3(0, 0.4, -65), Vec3(0.1, 0, -30)}};
}

// The tool in the part where the words put it: seen from the part the tool turns the other way.
inline PlacedTool in_part(const FiveWords& w, const OwnChain& chain) {
  PlacedTool tool{{w[0], w[1], w[2]}, Vec3::UnitZ()};
  for (std::size_t k = 0; k < 2; ++k) {
    const double angle = -w[3 + k] * kRadPerDegree;
    const double tilt = chain.tilt[k].norm();
    const auto back = [&](const Vec3& v) {
      const Vec3 straight = tilt > 0.0 ? turned(v, chain.tilt[k] / tilt, -tilt) : v;
      return turned(straight, chain.axis[k], angle);
    };
    tool.tip = back(tool.tip - chain.point[k]) + chain.point[k];
    tool.axis = back(tool.axis);
  }
  return tool;
}

// The cuts of a program in the words of any of the controls: from the second positioning block with G1, or L
// without FMAX, on.
struct Cut {
  std::vector<FiveWords> ends;
  std::vector<std::size_t> line;  // of each
};

inline bool is_cutting(const std::string& line) {
  const bool heidenhain = line.find(" L ") != std::string::npos || line.rfind("L ", 0) == 0;
  return (heidenhain && line.find("FMAX") == std::string::npos) || line.find("G1 ") != std::string::npos ||
         line.find("G01 ") != std::string::npos;
}

inline Cut cut_of(const std::string& nc, const OwnChain& chain = own_chain("trunnion_offset")) {
  Cut out;
  FiveWords now{};
  bool cutting = false;
  std::istringstream lines(nc);
  std::string line;
  for (std::size_t number = 0; std::getline(lines, line); ++number) {
    if (line.empty() || line[0] == '(' || line[0] == ';' || line[0] == '%') continue;
    if (line.find("G0 ") != std::string::npos || line.find("G00 ") != std::string::npos ||
        line.find("M30") != std::string::npos || line.find("FMAX") != std::string::npos)
      cutting = false;
    if (is_cutting(line)) cutting = true;
    const bool machine = line.find("G53") != std::string::npos || line.find("SUPA") != std::string::npos ||
                         line.find("M91") != std::string::npos;
    if (machine) continue;
    bool any = false;
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      const std::size_t axis = chain.letters.find(line[i]);
      if (axis == std::string::npos || (i > 0 && std::isalpha(static_cast<unsigned char>(line[i - 1])) != 0))
        continue;
      std::size_t at = i + 1;
      if (line[at] == '=') ++at;
      const bool modulo = line.compare(at, 3, "DC(") == 0;
      if (modulo) at += 3;
      if (at < line.size() && line[at] == '+') ++at;
      const auto end = line.find_first_not_of("-0123456789.", at);
      const auto number_there = parse_number(std::string_view(line).substr(at, end - at));
      if (!number_there) continue;
      // A modulo axis goes the shorter way.
      now[axis] =
          modulo ? now[axis] + std::remainder(number_there.value - now[axis], 360.0) : number_there.value;
      any = true;
    }
    if (!cutting || !any) continue;
    out.ends.push_back(now);
    out.line.push_back(number);
  }
  return out;
}

// The angle of u from the great circle between a and b, all nearly of length one.
inline double off_arc(const Vec3& u, const Vec3& a, const Vec3& b) {
  const auto angle = [](const Vec3& x, const Vec3& y) { return std::atan2(x.cross(y).norm(), x.dot(y)); };
  const Vec3 normal = a.cross(b);
  const bool between = normal.norm() > 1e-9 && normal.cross(a).dot(u) > 0.0 && b.cross(normal).dot(u) > 0.0;
  if (between) return std::abs(0.5 * kPi - angle(u, normal));
  return std::min(angle(u, a), angle(u, b));
}

inline std::vector<PlacedTool> tool_of(const Cut& cut, const OwnChain& chain = own_chain("trunnion_offset")) {
  constexpr int kPieces = 16;  // of a block, the bow of each 1/256 of its own
  std::vector<PlacedTool> out = {in_part(cut.ends.front(), chain)};
  for (std::size_t i = 1; i < cut.ends.size(); ++i) {
    for (int k = 1; k <= kPieces; ++k) {
      FiveWords w{};
      for (std::size_t n = 0; n < w.size(); ++n)
        w[n] = cut.ends[i - 1][n] + (cut.ends[i][n] - cut.ends[i - 1][n]) * k / kPieces;
      out.push_back(in_part(w, chain));
    }
  }
  return out;
}

}  // namespace trunnion::test
