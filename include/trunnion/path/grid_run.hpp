#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A run of points that is put on the word grid and looked at a few points at a time. It gives what
/// round_to_words gives for each, and tells the segments that need no second look from the others: the first
/// bounds of Refiner::decide. For machines that TableKinematics evaluates side by side.
class GridRun {
 public:
  GridRun(const TableKinematics& kinematics, const Rounding& rounding);
  ~GridRun();
  GridRun(GridRun&&) noexcept;

  /// Largest values of SegmentReport: what is below them is of no account.
  struct Known {
    double predicted_mm = 0.0;
    double midpoint_mm = 0.0;  // no smaller
  };
  /// Puts the points of `chosen`, of which `pose_at(i)` is prescribed, on the grid, and bounds the segments
  /// that end there. `before`: the point that comes before them, on the grid already; null where none does,
  /// and then nothing is said of the first segment. `known`: figures of the report so far.
  template <class PoseAt>
  void place(const Point* before, std::span<const ChosenPoint> chosen, const PoseAt& pose_at,
             const Tolerance& tolerance, const Known& known, std::span<JointVector> out) {
    known_ = known;
    begin(before, chosen.size(), tolerance);
    Few few;
    const std::size_t together = lanes::count_of(way_);
    for (std::size_t i = 0; i < chosen.size(); i += together) {
      for (std::size_t k = 0; k < together; ++k) {
        const std::size_t j =
            std::min(i + k, chosen.size() - 1);  // the last one stands for what is not there
        few[k] = {&pose_at(j), &chosen[j], &out[j]};
      }
      add(i, few);
    }
  }
  /// Sines of the rounded rotary positions of point i.
  const RotarySines& sines(std::size_t i) const { return sines_[i]; }
  std::span<const RotarySines> sines() const { return sines_; }
  /// The segment that ends at point i surely keeps to the tolerance.
  bool keeps(std::size_t i) const { return keeps_[i] != 0; }
  /// Of one that keeps: it may change a figure of which so much is known by now.
  bool counts(std::size_t i, const Known& known) const {
    return bow_mm_[i] > known.predicted_mm &&
           (across_mm_[i] > known.predicted_mm || bow_mm_[i] > known.midpoint_mm);
  }
  /// It leaves its own chord by no more than this.
  double bow_mm(std::size_t i) const { return bow_mm_[i]; }
  /// Of one that counts: by how much it leaves its own chord at most, and that is close to the truth.
  double across_mm(std::size_t i) const { return across_mm_[i]; }

 private:
  static constexpr std::size_t kMost = lanes::kCount<Quads>;  // at a time
  struct One {
    const ToolPose* pose;
    const ChosenPoint* chosen;
    JointVector* out;
  };
  using Few = std::array<One, kMost>;
  template <class T>
  struct Place;
  struct Work;
  void begin(const Point* before, std::size_t count, const Tolerance& tolerance);
  void add(std::size_t i, const Few& few);
  template <class T>
  void add_few(std::size_t i, const Few& few);
  template <class T>
  void set_out(const Point& before);
  template <class T>
  void judge(std::size_t i, const Place<T>& last, const Place<T>& to,
             const TableKinematics::SinesOf<T>& sines);
  template <class T>
  void look_closer(std::size_t i);

  TableKinematics kinematics_;
  std::array<AxisId, 2> rotary_;
  std::array<AxisId, 3> linear_;
  lanes::Way way_;
  Tolerance tolerance_;
  Known known_;
  bool may_count_ = false;  // one of the last few
  std::unique_ptr<Work> work_;
  // Of the points, with room for those that are not there.
  std::vector<RotarySines> sines_;
  // Of the segments; bow_mm_ with what leads along the chord, across_mm_ of those that were looked at closer.
  std::vector<double> bow_mm_, across_mm_;
  std::vector<std::int64_t> keeps_;
};

}  // namespace trunnion::path
