#pragma once
#include <cmath>
#include <optional>
#include <utility>

#include "post/judging/path_place.hpp"
#include "post/judging/path_points.hpp"

// Private to the verifier.
namespace trunnion::post {

// Far more CL points than one block of a thinned program passes.
inline constexpr std::size_t kLookAhead = 1024;

/// Where a program is on its CL path, and where the blocks that come next end there.
class PathFollower {
 public:
  /// `points` must outlive the object.
  PathFollower(const PathPoints& points, const FollowLimits& limits) : points_(points), limits_(limits) {}

  const PathPoints& points() const { return points_; }
  const FollowLimits& limits() const { return limits_; }
  const Place& at() const { return at_; }
  void go_to(const Place& place) { at_ = place; }
  /// At a CL point.
  void go_to(std::size_t point) { at_ = {point, 0.0, 0.0}; }
  /// So many of the first points are no longer known.
  void forget(std::size_t count) { at_.segment -= count; }
  /// The place of the path as a point of its own.
  Target here() const;
  std::size_t next() const { return at_.segment + 1; }
  /// The next CL point, or null behind the last one.
  const Target* target() const { return next() < points_.size() ? &points_[next()] : nullptr; }
  /// Line of the CL file of the next point, or of the last one; 0 where there is none.
  std::uint32_t cl_line() const {
    return points_.empty() ? 0 : points_[std::min(next(), points_.size() - 1)].line;
  }

  /// How near a block must come to a CL point that is reached by a rapid to be that point; blocks on the way
  /// may be anywhere. Above compensation and rounding, on a machine with errors above those; below the length
  /// of rapids.
  double hit_tolerance_mm() const;
  /// Combined measure of how far `v` is from a place of the path; what the pole allows is no distance.
  double distance_to(const ToolPose& v, const Target& target) const;
  bool hits(const ToolPose& v, const Target& target) const {
    return distance_to(v, target) <= hit_tolerance_mm();
  }
  /// The tool stands above this point, along its axis, or there.
  bool is_above(const ToolPose& v, const Target& target, double least_mm) const;
  /// Between these two the tool axis may be off by the pole's tolerance more.
  static bool near_pole(const Target& a, const Target& b) { return a.in_cone || b.in_cone; }

  /// Where the block to `v` ends: the nearest place ahead, no farther along the path than the block can have
  /// come.
  Place find(const TableKinematics& kinematics, const Vertex& from, const Vertex& v) const;
  /// The same where nothing beyond the two next CL points has to be looked at. `from_is_placed`: `from` was
  /// found at the place where the program is.
  std::optional<Place> find_near(const ToolPose& from, const ToolPose& v, bool from_is_placed) const;
  /// `v` at this fraction of a segment.
  Place placed_at(const ToolPose& v, std::size_t segment, double t) const;
  /// The segments on which the tool may have its place while the tip tells `segment`: one to each side of it,
  /// and farther where the tip does not go beyond its tolerance.
  std::pair<std::size_t, std::size_t> segments_about(std::size_t segment) const;

 private:
  Place placed_at(const ToolPose& v, std::size_t segment, double t, double off_tip_mm) const;
  /// As find_ahead, where the place can only be beside one CL point, the next or the one behind it.
  /// `off_axis`: by which the axis of `v` misses that of the next.
  std::optional<Place> find_at_corner(const ToolPose& from, const ToolPose& v, double off_axis) const;
  Place find_ahead(const ToolPose& v, const Way& way) const;
  bool is_at_end(const Target& b, double off2_mm2, double chord2) const;
  /// Fraction of the segment a-b at which `v` stands, when its foot is on the way ahead and it is within the
  /// tolerances.
  std::optional<double> still_on(const ToolPose& v, const Target& a, const Target& b) const;

  const PathPoints& points_;
  FollowLimits limits_;
  Place at_;
};

}  // namespace trunnion::post
