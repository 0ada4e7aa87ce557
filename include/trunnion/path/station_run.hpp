#pragma once
#include <array>
#include <vector>

#include "trunnion/path/certificate.hpp"

namespace trunnion::path {

template <class T>
struct ConstantsOf;
template <class T>
struct StationOf;

/// Poses that follow one another, and how far the motions between them leave straight lines at most, in
/// columns.
struct PoseRun {
  using Column = std::vector<double>;
  std::array<Column, 3> tip_P, axis_P;
  // Of the motion from row to row + 1: how far the tip leaves its chord at most, and the tool axis the chord
  // or the arc of a great circle between its ends, whichever it is nearer to.
  Column bow_mm, bow_axis;
  // The tip leaves its chord by 4 t (1 - t) of this vector, but for so much.
  std::array<Column, 3> sag_mm;
  Column rest_mm;
  // The tool axis leaves the great circle between its ends, on which it goes at an even pace, by
  // 4 t (1 - t) of this vector, but for so much.
  std::array<Column, 3> axis_sag;
  Column axis_rest;

  void resize(std::size_t rows);
  ToolPose pose(std::size_t row) const {
    return {{tip_P[0][row], tip_P[1][row], tip_P[2][row]}, {axis_P[0][row], axis_P[1][row], axis_P[2][row]}};
  }
  Certifier::Bows bows(std::size_t row) const { return {bow_mm[row], bow_axis[row]}; }
};

/// Positions that follow one another, evaluated a few at a time: the same stations as `station` gives one by
/// one, and bows between them: of the tool axis those of Certifier::bows_from_norms, of the tip these or what
/// the middle of the motion tells, whichever is less. For machines that TableKinematics evaluates side by
/// side.
class StationRun {
 public:
  /// Rows of doubles.
  using Column = std::vector<double>;
  /// More rows than there are, so that the few that are looked at together may begin at the last one.
  static constexpr std::size_t kMoreRows = 2 * lanes::kCount<Quads>;

  explicit StationRun(const TableKinematics& kinematics)
      : kinematics_(kinematics),
        way_(lanes::way()),
        spindle_arm2_(kinematics.direction(0).cross(kinematics.spindle()).squaredNorm()) {}

  void resize(std::size_t count);
  std::size_t count() const { return count_; }
  /// Positions of an axis: those of all axes must be there before `evaluate`.
  Column& of_axis(AxisId id) { return q_[id]; }
  const Column& of_axis(AxisId id) const { return q_[id]; }
  void evaluate();

  JointVector q(std::size_t row) const {
    JointVector out;
    for (AxisId id = 0; id < kMaxAxes; ++id) out[id] = q_[id][row];
    return out;
  }
  RotarySines sines(std::size_t row) const {
    return {{sin_[0][row], sin_[1][row]}, {cos_[0][row], cos_[1][row]}};
  }
  /// As `station` gives it.
  Station station(std::size_t row) const;
  /// Of as many rows as T holds.
  template <class T>
  TableKinematics::SinesOf<T> sines_of(std::size_t row) const {
    return {{lanes::load<T>(&sin_[0][row]), lanes::load<T>(&sin_[1][row])},
            {lanes::load<T>(&cos_[0][row]), lanes::load<T>(&cos_[1][row])}};
  }
  /// Where the tool stands on the nominal machine.
  const PoseRun& poses() const { return poses_; }

 private:
  template <class T>
  void evaluate_few();
  template <class T>
  void put_few(std::size_t row, const ConstantsOf<T>& chain);
  template <class T>
  void bow_few(std::size_t row, const ConstantsOf<T>& chain);
  template <class T>
  StationOf<T> half_way(std::size_t row, const ConstantsOf<T>& chain) const;

  TableKinematics kinematics_;
  lanes::Way way_;
  std::size_t count_ = 0;
  double spindle_arm2_;  // of the spindle direction from the outer axis
  std::array<Column, kMaxAxes> q_;
  std::array<Column, 2> sin_, cos_;
  Column arm2_outer_, arm2_inner_, axis_arm2_, size_mm_;  // as in Station; squared arm of the tool axis
  PoseRun poses_;
};

}  // namespace trunnion::path
