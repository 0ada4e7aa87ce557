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

  /// Puts the points of `chosen`, of which `pose_at(i)` is prescribed, on the grid, and bounds the segments
  /// that end there. `before`: the point that comes before them, on the grid already; null where none does,
  /// and then nothing is said of the first segment.
  template <class PoseAt>
  void place(const Point* before, std::span<const ChosenPoint> chosen, const PoseAt& pose_at,
             const Tolerance& tolerance, std::span<JointVector> out) {
    begin(before, chosen.size(), tolerance);
    Few few;
    for (std::size_t i = 0; i < chosen.size(); i += together_) {
      for (std::size_t k = 0; k < together_; ++k) {
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
  /// It leaves its own chord by no more than this.
  double bow_mm(std::size_t i) const { return bow_mm_[i]; }

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
  void judge(std::size_t i, const Place<T>& last, const Place<T>& to);

  TableKinematics kinematics_;
  std::array<AxisId, 2> rotary_;
  std::array<AxisId, 3> linear_;
  std::size_t together_;
  Tolerance tolerance_;
  std::unique_ptr<Work> work_;
  // Of the points, with room for those that are not there.
  std::vector<RotarySines> sines_;
  std::vector<double> bow_mm_;  // of the segments
  std::vector<std::int64_t> keeps_;
};

}  // namespace trunnion::path
