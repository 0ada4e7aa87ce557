#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/cl/record.hpp"
#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/pole.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::post {

/// A motion of the CL file that waits for the choice of its joints.
struct Pending {
  path::ChoicePoint point;  // near the pole its tool axis may be tilted
  cl::Feed feed;
  Vec3 programmed_axis_P = Vec3::UnitZ();
  bool step = false;  // cl::Motion::step
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

/// The segment that ends at a motion, refined beforehand.
struct PreparedSegment {
  bool known = false;
  path::Tolerance tolerance;  // for which
  path::SegmentReport report;
  std::size_t first = 0;  // of its points in Chunk::inserted; report.inserted of them
};

/// A piece of the program that goes from stage to stage: so many motions and what is said between them.
struct Chunk {
  std::vector<Pending> motions;
  std::vector<Event> events;
  std::vector<ToleranceFrom> tolerances;  // the first one holds from motion 0 on
  std::vector<path::ChosenPoint> chosen;
  std::vector<path::PoleStretch> pole;  // where tool axes are tilted
  InverseOptions inverse;               // with which they were chosen
  std::optional<Error> failure;         // no way was found through these motions
  path::Point before;                   // where the chunk before ends
  bool has_before = false;

  std::vector<path::Point> points;  // of the motions, on the word grid
  std::vector<PreparedSegment> segments;
  std::vector<path::Point> inserted;

  std::string text;  // the NC text of these motions

  /// Empty, with the memory that it has.
  void clear() {
    motions.clear();
    events.clear();
    tolerances.clear();
    chosen.clear();
    pole.clear();
    failure.reset();
    points.clear();
    segments.clear();
    inserted.clear();
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
