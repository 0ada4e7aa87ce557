#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "trunnion/nc/motion_run.hpp"
#include "trunnion/path/station_run.hpp"
#include "trunnion/post/verify.hpp"

#include "post/judging/match_places.hpp"
#include "post/judging/program_judge.hpp"
#include "post/offset_tracker.hpp"
#include "post/program_state.hpp"

// Private to the verifier: the last blocks of a cut, to be matched anew where a later one shows that they
// were matched to the wrong places.
namespace trunnion::post {

/// What the verification knew before a block.
struct TrailMark {
  std::size_t block = 0;  // of the trail, behind which it stands
  Place at;
  CutFigures figures;
  double judged_axis_rad = 0.0;
  std::size_t recorded = 0;  // VerifyReport::blocks
  double path_mm = 0.0;
  ProgramState program;
  std::optional<OffsetTracker> offsets;
  ProgramJudge::Found found;
};

/// The blocks of a cut since its begin, or as many of them as are worth keeping, and marks between them.
class BlockTrail {
 public:
  /// As many blocks as these are kept at least where the cut is longer. A match that goes wrong shows it as
  /// soon as the path goes elsewhere than the place that was taken for it.
  static constexpr std::size_t kKept = 256;
  /// Blocks from mark to mark.
  static constexpr std::size_t kApart = 8;

  void clear();
  bool empty() const { return size() == 0; }
  std::size_t size() const { return nc_line_.size(); }
  /// The end of block `i`; that of the first one is where the others begin.
  BlockEnd end(std::size_t i) const;
  /// How long it lasts; 0 where `last_takes` was not told.
  double seconds(std::size_t i) const { return seconds_[i]; }

  void add(const BlockEnd& end);
  /// Motions of a run: row `row` of the stations is the end of motion `row` - 1.
  void add(const nc::MotionRun& run, const path::StationRun& stations, std::size_t first_row,
           std::size_t last_row);
  void last_takes(double seconds) { seconds_.back() = seconds; }

  std::deque<TrailMark>& marks() { return marks_; }
  const std::deque<TrailMark>& marks() const { return marks_; }
  bool wants_mark() const { return marks_.empty() || size() > marks_.back().block + kApart; }
  /// Leaves out what is no longer worth keeping.
  void shorten();

 private:
  template <class F>
  void each_column(const F& f) {
    for (auto& column : q_) f(column);
    f(nc_line_);
    f(feed_mode_);
    f(feed_);
    f(seconds_);
  }

  // What motions of a run have.
  std::array<std::vector<double>, kMaxAxes> q_;
  std::vector<std::uint32_t> nc_line_;
  std::vector<nc::FeedMode> feed_mode_;
  std::vector<std::int64_t> feed_;
  std::vector<double> seconds_;
  struct Other {
    std::size_t block = 0;
    BlockEnd end;
  };
  std::deque<Other> others_;  // blocks of which the columns do not say all, in order
  std::deque<TrailMark> marks_;
};

}  // namespace trunnion::post
