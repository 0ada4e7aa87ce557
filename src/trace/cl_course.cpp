#include "trace/cl_course.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/geom/direction.hpp"

namespace trunnion::trace {
namespace {

// A rad beside a mm where the nearest piece is looked for.
constexpr double kArm_mm = 10.0;
constexpr double kNoLength_mm = 1e-9;

double angle_of(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// The axis at `t` of the great circle from a to b.
Vec3 axis_at(const Vec3& a, const Vec3& b, double t) {
  const double angle = angle_of(a, b);
  if (angle < 1e-12) return b;
  const double sine = std::sin(angle);
  if (sine < 1e-9) return t < 0.5 ? a : b;
  return ((std::sin((1.0 - t) * angle) * a + std::sin(t * angle) * b) / sine).normalized();
}

struct OnPiece {
  double tip_mm, axis_rad, t;
  Vec3 foot_P, axis_P;
};

OnPiece on_piece(const PathPoint& from, const PathPoint& to, const ToolPose& tool) {
  const Vec3 way = to.tip_P - from.tip_P;
  const double length2 = way.squaredNorm();
  double t = 1.0;
  if (length2 > kNoLength_mm * kNoLength_mm) {
    t = std::clamp(way.dot(tool.tip_P - from.tip_P) / length2, 0.0, 1.0);
  } else {
    // The tip stands and the tool turns.
    const Vec3 n = from.axis_P.cross(to.axis_P);
    const double whole = angle_of(from.axis_P, to.axis_P);
    if (whole > 1e-12 && n.norm() > 0.0) {
      const Vec3 unit = n.normalized();
      const Vec3 flat = tool.axis_P - unit.dot(tool.axis_P) * unit;
      const double turned = std::atan2(from.axis_P.cross(flat).dot(unit), from.axis_P.dot(flat));
      t = std::clamp(turned / whole, 0.0, 1.0);
    }
  }
  OnPiece out{0.0, 0.0, t, from.tip_P + t * way, axis_at(from.axis_P, to.axis_P, t)};
  out.tip_mm = (tool.tip_P - out.foot_P).norm();
  out.axis_rad = angle_of(tool.axis_P, out.axis_P);
  return out;
}

}  // namespace

ClCourse::ClCourse(const Machine& machine, const Plan& plan) : path_(plan.path) {
  of_block_.reserve(plan.blocks.size());
  std::size_t at = 0;
  for (const PlannedBlock& block : plan.blocks) {
    const Vec3 tool(0.0, 0.0, -block.length_mm);
    const ToolPose pose = plan.pose ? plan.pose(block.q, tool) : tool_pose(forward(machine, block.q, tool));
    at = place_of(pose, block.cl_line, at);
    of_block_.push_back(at);
  }
}

std::size_t ClCourse::place_of(const ToolPose& tool, std::uint32_t line, std::size_t from) const {
  std::size_t first = from;
  while (first < path_.size() && path_[first].line != line) ++first;
  if (first == path_.size()) return from;
  std::size_t best = first;
  double least = std::numeric_limits<double>::max();
  for (std::size_t j = first; j < path_.size() && path_[j].line == line; ++j) {
    const auto at = on_piece(path_[j == 0 ? 0 : j - 1], path_[j], tool);
    const double off = at.tip_mm + kArm_mm * at.axis_rad;
    if (off >= least - 1e-9) continue;
    least = off;
    best = j;
  }
  return best;
}

OffPath ClCourse::off(const ToolPose& tool, std::size_t first, std::size_t last) const {
  const std::size_t begin = of_block_[first > 0 ? first - 1 : 0];
  const std::size_t end = std::min(of_block_[last] + 1, path_.size() - 1);
  OffPath out;
  double least = std::numeric_limits<double>::max();
  for (std::size_t j = std::max<std::size_t>(begin, 1); j <= std::max<std::size_t>(end, 1); ++j) {
    if (j >= path_.size()) break;
    const auto at = on_piece(path_[j - 1], path_[j], tool);
    const double off = std::hypot(at.tip_mm, kArm_mm * at.axis_rad);
    if (off >= least) continue;
    least = off;
    out.tip_mm = at.tip_mm;
    out.axis_rad = at.axis_rad;
    out.error_P = tool.tip_P - at.foot_P;
    const double flute = path_[j].flute_mm;
    out.flute_mm =
        flute > 0.0 ? std::max(at.tip_mm, (out.error_P + flute * (tool.axis_P - at.axis_P)).norm()) : 0.0;
  }
  return out;
}

}  // namespace trunnion::trace
