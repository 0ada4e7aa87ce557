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

// A chain of the tests' own, for programs of the machine of trunnion_offset.toml: words of any control to the
// tool in the part, with nothing of the library's kinematics or readers.
namespace trunnion::test {

struct PlacedTool {
  Vec3 tip, axis;
};

// v turned about the unit vector n: Rodrigues' formula.
inline Vec3 turned(const Vec3& v, const Vec3& n, double angle) {
  return std::cos(angle) * v + std::sin(angle) * n.cross(v) + (1.0 - std::cos(angle)) * n.dot(v) * n;
}

using FiveWords = std::array<double, 5>;  // X Y Z mm, A C deg

// The tool in the part where the words put it, on the machine of trunnion_offset.toml: the part is turned by
// -A about X through (0, 0.4, -65) and by -C about Z through (0.1, 0, -30). The words are those of the tip.
inline PlacedTool in_part(const FiveWords& w) {
  const Vec3 a(0.0, 0.4, -65.0);
  const Vec3 c(0.1, 0.0, -30.0);
  const auto back = [&](const Vec3& v, const Vec3& at, const Vec3& at_c) {
    const Vec3 of_c = turned(v - at, Vec3::UnitX(), w[3] * kRadPerDegree) + at;
    return Vec3(turned(of_c - at_c, Vec3::UnitZ(), w[4] * kRadPerDegree) + at_c);
  };
  return {back({w[0], w[1], w[2]}, a, c), back(Vec3::UnitZ(), Vec3::Zero(), Vec3::Zero())};
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

inline Cut cut_of(const std::string& nc) {
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
      const std::size_t axis = std::string("XYZAC").find(line[i]);
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

inline std::vector<PlacedTool> tool_of(const Cut& cut) {
  constexpr int kPieces = 16;  // of a block, the bow of each 1/256 of its own
  std::vector<PlacedTool> out = {in_part(cut.ends.front())};
  for (std::size_t i = 1; i < cut.ends.size(); ++i) {
    for (int k = 1; k <= kPieces; ++k) {
      FiveWords w{};
      for (std::size_t n = 0; n < w.size(); ++n)
        w[n] = cut.ends[i - 1][n] + (cut.ends[i][n] - cut.ends[i - 1][n]) * k / kPieces;
      out.push_back(in_part(w));
    }
  }
  return out;
}

}  // namespace trunnion::test
