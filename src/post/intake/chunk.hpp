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

/// What the CL file says of a motion beside its point.
struct MotionWords {
  cl::Feed feed;
  cl::Motion::Step step = cl::Motion::Step::none;
  cl::Motion::Part part{};
  bool operator==(const MotionWords&) const = default;
};

/// From this motion on it says so.
struct WordsFrom {
  std::size_t motion = 0;
  MotionWords words;
};

/// A motion as blocks are made of it.
struct ChunkMotion {
  const path::ChoicePoint& point;
  const cl::Feed& feed;
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

/// Of what is said from a motion on: what holds for motion `i`.
template <class From>
typename std::vector<From>::const_iterator in_force(const std::vector<From>& all, std::size_t i) {
  const auto behind = std::upper_bound(all.begin(), all.end(), i,
                                       [](std::size_t at, const From& from) { return at < from.motion; });
  return std::prev(behind);
}

/// The same for motions that come one behind the other.
template <class From>
class InForce {
 public:
  /// From motion `i` on; there is one for it.
  InForce(const std::vector<From>& all, std::size_t i) : all_(all), at_(in_force(all, i)) {}
  /// No motion before the last one that was asked for.
  const From& at(std::size_t i) {
    while (std::next(at_) != all_.end() && std::next(at_)->motion <= i) ++at_;
    return *at_;
  }
  /// The first motion for which the next one holds, `end` at most.
  std::size_t end(std::size_t end) const {
    const auto next = std::next(at_);
    return next == all_.end() ? end : std::min(next->motion, end);
  }

 private:
  const std::vector<From>& all_;
  typename std::vector<From>::const_iterator at_;
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

/// Motions of the CL file, in columns.
struct MotionColumns {
  std::vector<path::ChoicePoint> points;  // near the pole tool axes may be tilted
  std::vector<double> paces;              // path::Point::pace; empty: all are 1
  std::vector<Vec3> programmed_axes_P;    // empty where `points` has them
  std::vector<WordsFrom> words;           // the first ones hold from motion 0 on

  std::size_t size() const { return points.size(); }
  /// Of the motions that are added next.
  void say(const MotionWords& said) { say_from(size(), said, words); }
  static void say_from(std::size_t motion, const MotionWords& said, std::vector<WordsFrom>& words) {
    if (words.empty() || !(words.back().words == said)) words.push_back({motion, said});
  }
  void clear_motions() {
    points.clear();
    paces.clear();
    words.clear();
    programmed_axes_P.clear();
  }
  ChunkMotion motion(std::size_t i) const { return {points[i], words_at(i).feed}; }
  const MotionWords& words_at(std::size_t i) const { return in_force(words, i)->words; }
  double pace(std::size_t i) const { return paces.empty() ? 1.0 : paces[i]; }
  const Vec3& programmed_axis_P(std::size_t i) const {
    return programmed_axes_P.empty() ? points[i].pose.axis_P : programmed_axes_P[i];
  }
};

/// A piece of the program that goes from stage to stage: so many motions and what is said between them.
struct Chunk : MotionColumns {
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
    path::Point out = path::point_at(points[i], joints[i]);
    out.pace = pace(i);
    return out;
  }
  /// Under which the segment that ends at motion `i` was prepared.
  const path::Tolerance& tolerance_at(std::size_t i) const { return in_force(tolerances, i)->tolerance; }
  /// Points that were inserted in it.
  std::span<const path::Point> inserted_in(const PreparedSegment& segment) const {
    if (segment.report < 0) return {};
    return {inserted.data() + segment.first, reports[static_cast<std::size_t>(segment.report)].inserted};
  }

  /// Nothing is known of the segments that end at its motions.
  void leave_unprepared() {
    segments.assign(size(), {});
    reports.clear();
    inserted.clear();
    corrections.joints.clear();
    corrections.known.clear();
    corrections.keeps.clear();
  }

  bool is_empty() const { return points.empty() && events.empty() && !failure; }

  /// Empty, with the memory that it has. What was chosen stays until it is chosen anew.
  void clear() {
    clear_motions();
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
  path::Point out = path::point_at(point, q);
  path::round_to_words(kinematics, rounding, out.tip_P, out.q);
  return out;
}

}  // namespace trunnion::post
