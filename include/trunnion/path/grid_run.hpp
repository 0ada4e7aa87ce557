#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A run of points that is put on the word grid and looked at two points at a time. It gives what
/// round_to_words gives for each, and tells the segments that need no second look from the others: the first
/// bounds of Refiner::decide. For machines that TableKinematics evaluates side by side.
class GridRun {
 public:
  GridRun(const TableKinematics& kinematics, const Rounding& rounding)
      : kinematics_(kinematics), rounding_(rounding) {}

  /// Rounds the positions of `points`, which are those of `chosen`. `before`: the point that comes before
  /// them, on the grid already; null where none does.
  void place(const Point* before, std::span<Point> points, std::span<const ChosenPoint> chosen);
  /// Sines of the rounded rotary positions of points[i].
  RotarySines sines(std::size_t i) const {
    return {{sin_[0][i + 1], sin_[1][i + 1]}, {cos_[0][i + 1], cos_[1][i + 1]}};
  }

  /// Bounds of the segments that end at the points placed last; point 0 needs a point before.
  void judge(const Tolerance& tolerance);
  /// The segment that ends at points[i] surely keeps to the tolerance.
  bool keeps(std::size_t i) const { return keeps_[i] != 0; }
  /// It leaves its own chord by no more than this.
  double bow_mm(std::size_t i) const { return bow_mm_[i]; }

 private:
  using Column = std::vector<double>;
  struct Place;
  void put(std::size_t row, const Place& place);

  TableKinematics kinematics_;
  Rounding rounding_;
  std::size_t count_ = 0;
  // Of the points, the one before them first; one row more than there are.
  std::array<Column, 2> angle_, sin_, cos_;
  std::array<Column, 3> w_;
  Column arm2_outer_, arm2_inner_, size_mm_;
  Column off2_mm2_, off2_axis_;  // by which the position misses what is programmed, squared
  Column bow_mm_;                // of the segments
  std::vector<std::int64_t> keeps_;
};

}  // namespace trunnion::path
