#pragma once
#include <algorithm>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trunnion/cl/record.hpp"
#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/pole.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "post/tools/spindle_tool.hpp"

namespace trunnion::post {

/// A motion of the CL file that waits for the choice of its joints.
struct Pending {
  path::ChoicePoint point;  // near the pole its tool axis may be tilted
  cl::Feed feed;
  Vec3 programmed_axis_P = Vec3::UnitZ();
  bool step = false;  // cl::Motion::step
  cl::Motion::Part part{};
  double pace = 1.0;  // path::Point::pace
};

/// What is said before a motion.
struct Event {
  std::size_t before = 0;  // index of the motion
  cl::Record record;
};

/// From this motion on the path keeps to this tolerance (LINTOL).
struct ToleranceFrom {
  std::size_t motion = 0;
  path::Tolerance tolerance;
};

/// The segment that ends at a motion, as it was refined beforehand.
struct PreparedSegment {
  static constexpr std::int32_t kUnknown = -2;
  static constexpr std::int32_t kKept = -1;  // no figure of the report is to be had from it
  std::int32_t report = kUnknown;            // else its number in Chunk::reports
  std::uint32_t first = 0;                   // of its points in Chunk::inserted
  std::uint32_t end = 0;                     // number of its end in Chunk::corrections

  bool known() const { return report != kUnknown; }
};

/// A piece of the program that goes from stage to stage: so many motions and what is said between them.
struct Chunk {
  std::vector<Pending> motions;
  std::vector<Event> events;
  SpindleTool tool;                       // that the motions are made with
  std::vector<ToleranceFrom> tolerances;  // the first one holds from motion 0 on
  std::vector<path::ChosenPoint> chosen;
  std::vector<path::PoleStretch> pole;  // where tool axes are tilted
  InverseOptions inverse;               // with which they were chosen
  std::optional<Error> failure;         // no way was found through these motions
  path::Point before;                   // where the chunk before ends
  bool has_before = false;

  std::vector<JointVector> joints;  // of the motions, on the word grid; the preparer writes all of them
  std::vector<PreparedSegment> segments;
  std::vector<path::SegmentReport> reports;
  std::vector<path::Point> inserted;
  /// On a machine whose errors hang on the position alone: inserted points and ends of motions corrected, as
  /// path::CorrectionRun has them; empty elsewhere.
  struct Corrections {
    std::vector<JointVector> joints;
    std::vector<std::uint8_t> known, keeps;
    double largest_error_mm = 0.0, largest_correction_mm = 0.0;
  } corrections;

  std::string text;  // the NC text of these motions

  /// The motion's end, on the word grid.
  path::Point point(std::size_t i) const {
    path::Point out;
    out.q = joints[i];
    out.tip_P = motions[i].point.pose.tip_P;
    out.axis_P = motions[i].point.pose.axis_P;
    out.where = motions[i].point.where;
    out.pace = motions[i].pace;
    return out;
  }
  /// Under which the segment that ends at motion `i` was prepared.
  const path::Tolerance& tolerance_at(std::size_t i) const {
    const auto behind =
        std::upper_bound(tolerances.begin(), tolerances.end(), i,
                         [](std::size_t at, const ToleranceFrom& t) { return at < t.motion; });
    return std::prev(behind)->tolerance;
  }
  /// Points that were inserted in it.
  std::span<const path::Point> inserted_in(const PreparedSegment& segment) const {
    if (segment.report < 0) return {};
    return {inserted.data() + segment.first, reports[static_cast<std::size_t>(segment.report)].inserted};
  }

  /// Nothing is known of the segments that end at its motions.
  void leave_unprepared() {
    segments.assign(motions.size(), {});
    reports.clear();
    inserted.clear();
    corrections.joints.clear();
    corrections.known.clear();
    corrections.keeps.clear();
  }

  bool is_empty() const { return motions.empty() && events.empty() && !failure; }

  /// Empty, with the memory that it has. What was chosen stays until it is chosen anew.
  void clear() {
    motions.clear();
    events.clear();
    tolerances.clear();
    pole.clear();
    failure.reset();
    leave_unprepared();
    text.clear();
  }
};

/// Chunks that have gone through all stages, for the intake to fill again.
class ChunkStore {
 public:
  std::unique_ptr<Chunk> take() {
    const std::lock_guard lock(mutex_);
    if (chunks_.empty()) return std::make_unique<Chunk>();
    auto out = std::move(chunks_.back());
    chunks_.pop_back();
    return out;
  }
  void give_back(std::unique_ptr<Chunk> chunk) {
    chunk->clear();
    const std::lock_guard lock(mutex_);
    chunks_.push_back(std::move(chunk));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Chunk>> chunks_;
};

/// The chosen joint position of a point of the CL file, on the word grid.
inline path::Point rounded_point(const TableKinematics& kinematics, const path::Rounding& rounding,
                                 const path::ChoicePoint& point, const JointVector& q) {
  path::Point out;
  out.q = q;
  out.tip_P = point.pose.tip_P;
  out.axis_P = point.pose.axis_P;
  out.where = point.where;
  path::round_to_words(kinematics, rounding, out.tip_P, out.q);
  return out;
}

}  // namespace trunnion::post
