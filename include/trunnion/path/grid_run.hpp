#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/pair_place.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A run of points that is put on the word grid and looked at two points at a time. It gives what
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
    for (std::size_t i = 0; i < chosen.size(); i += 2) {
      const std::size_t j = std::min(i + 1, chosen.size() - 1);  // an odd last one stands for two
      add(i, {&pose_at(i), &pose_at(j)}, {&chosen[i], &chosen[j]}, {&out[i], &out[j]});
    }
  }
  /// Sines of the rounded rotary positions of point i.
  RotarySines sines(std::size_t i) const { return sines_[i]; }
  /// The segment that ends at point i surely keeps to the tolerance.
  bool keeps(std::size_t i) const { return keeps_[i] != 0; }
  /// It leaves its own chord by no more than this.
  double bow_mm(std::size_t i) const { return bow_mm_[i]; }

 private:
  struct Pair : PairPlace {
    Lanes off2_mm2, off2_axis;  // by which the position misses what is programmed, squared
  };
  void begin(const Point* before, std::size_t count, const Tolerance& tolerance);
  void add(std::size_t i, const std::array<const ToolPose*, 2>& pose,
           const std::array<const ChosenPoint*, 2>& chosen, const std::array<JointVector*, 2>& out);
  Pair evaluated(const std::array<Lanes, 2>& angle, const TableKinematics::SinesOf<Lanes>& sines,
                 const lanes::Triple<Lanes>& linear, const lanes::Triple<Lanes>& tip_P,
                 const lanes::Triple<Lanes>& axis_P) const;
  void judge(std::size_t i, const Pair& to);
  Lanes rounded(AxisId id, const Lanes& value) const;

  struct Constants;
  TableKinematics kinematics_;
  std::unique_ptr<const Constants> constants_;
  std::array<AxisId, 2> rotary_;
  std::array<AxisId, 3> linear_;
  Tolerance tolerance_;
  Pair last_;  // the two points before
  // Of the points, with room for one more.
  std::vector<RotarySines> sines_;
  std::vector<double> bow_mm_;  // of the segments
  std::vector<std::int64_t> keeps_;
};

}  // namespace trunnion::path
