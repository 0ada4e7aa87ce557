#pragma once
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "post/judging/path_place.hpp"
#include "post/judging/path_points.hpp"

namespace trunnion::post {

/// How far a program may be off the place of the CL path that it is matched to.
struct MatchLimits {
  double tip_mm = 0.0;
  double axis_rad = 0.0;
  double pole_axis_rad = 0.0;  // beyond that, beside CL points in the pole's cone
  double back_mm = 0.0;        // by which the tip may go back on a segment
};

/// What is known of how blocks are matched.
struct Matched {
  /// The CL point at which the last of them ends; nothing: wherever it does.
  std::optional<std::size_t> last_point;
  /// Block number i, from 0 on, and a segment of the path on which it does not end: between its ends it was
  /// found to be beyond the limits there.
  std::set<std::pair<std::size_t, std::size_t>> not_on;
};

/// Where blocks that follow one another end on the CL path, of all ways to match them in the order of both
/// (of the path's segments) the one that is off the path least: every end within the limits of
/// its place, every CL point that a block passes within those of the block's chord. Empty where there is no
/// such way.
///
/// The ways are followed segment by segment of the path, block by block: of each pair the best one that comes
/// to it is kept (free space of two polygons, as for their Frechet distance).
/// @param from        where the first of them begins
/// @param poses       where that is, and the ends of the blocks
std::vector<Place> match_places(const PathPoints& points, const Place& from, std::span<const ToolPose> poses,
                                const MatchLimits& limits, const Matched& known = {});

}  // namespace trunnion::post
