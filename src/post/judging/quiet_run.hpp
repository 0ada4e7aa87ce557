#pragma once
#include "trunnion/path/station_run.hpp"

#include "post/judging/path_place.hpp"
#include "post/judging/path_points.hpp"

namespace trunnion::post {

template <class T>
struct Chords;
template <class T>
class ToolBeside;
template <class T>
struct OffBeside;

/// Blocks that follow one another, followed along the CL path a few at a time as long as they surely change
/// no figure of the report. Where each of them ends is guessed from how far the tool goes, and holds only
/// where the block before it, taken together with it, ended where it was guessed: it is the place that
/// PathFollower finds for one block (`find_near`), and is as quiet as QuietTest says. Whatever is
/// not plain (poles, rapids, still tips, CL points on top of one another) is left to it.
class QuietRun {
 public:
  QuietRun() : QuietRun(FollowLimits{}) {}
  explicit QuietRun(const FollowLimits& limits) : limits_(limits), way_(lanes::way()) {}

  /// Enough of the path for a block that begins there.
  static bool knows(const PathPoints& points, const Place& at) { return at.segment + 4 <= points.size(); }

  struct Found {
    std::size_t count = 0;      // blocks that are quiet, from the first one on
    double axis = 0.0;          // by which the tool axis leaves its course at most (a sine)
    double axis_at_tip = 0.0;   // that of the path where the tip is
    double point_off_mm = 0.0;  // the largest distance from a CL point at which a block ends
  };
  /// Looks at the blocks from the pose of `row` to that of the next, and so on. `at`: where the first of them
  /// begins; then where the last that is quiet ends.
  /// @param most_off_mm  the largest distance from a CL point in the report so far
  Found advance(const PathPoints& points, const path::PoseRun& poses, std::size_t row, std::size_t end,
                const KnownFigures& known, double most_off_mm, Place& at);

 private:
  using Column = PathPoints::Column;
  template <class T>
  struct Corners;
  template <class T>
  struct AtCorner;
  template <class T>
  struct Ends;
  template <class T>
  struct Begins;
  template <class T>
  struct Judged;
  template <class T>
  struct Course;
  template <class T>
  OffBeside<T> tool_off(const ToolBeside<T>& tool, const Course<T>& course, bool nearest) const;
  template <class T>
  void advance_few(const path::PoseRun& poses, std::size_t row, const KnownFigures& known, Place& at,
                   Found& found, std::size_t& taken) const;

  FollowLimits limits_;
  lanes::Way way_;
  const PathPoints* points_ = nullptr;  // at hand
};

}  // namespace trunnion::post
