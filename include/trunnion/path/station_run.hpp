#pragma once
#include <array>
#include <span>
#include <vector>

#include "trunnion/path/certificate.hpp"

namespace trunnion::path {

template <class T>
struct ConstantsOf;

/// Positions that follow one another, evaluated two at a time: the same stations as `station` gives one by
/// one, and the same bows between them as Certifier::bows_from_norms. For machines that TableKinematics
/// evaluates side by side.
class StationRun {
 public:
  /// Rows of doubles. Two more than there are, so that pairs may begin at the last one.
  using Column = std::vector<double>;

  explicit StationRun(const TableKinematics& kinematics)
      : kinematics_(kinematics),
        spindle_arm2_(kinematics.direction(0).cross(kinematics.spindle()).squaredNorm()) {}

  void resize(std::size_t count);
  std::size_t count() const { return count_; }
  /// Positions of an axis: those of all axes must be there before `evaluate`.
  Column& of_axis(AxisId id) { return q_[id]; }
  const Column& of_axis(AxisId id) const { return q_[id]; }
  void evaluate();

  JointVector q(std::size_t row) const;
  RotarySines sines(std::size_t row) const {
    return {{sin_[0][row], sin_[1][row]}, {cos_[0][row], cos_[1][row]}};
  }
  /// As `station` gives it.
  Station station(std::size_t row) const;
  TableKinematics::SinesOf<Lanes> sines_of_pair(std::size_t row) const;
  /// Where the tool stands on the nominal machine.
  const std::vector<ToolPose>& poses() const { return poses_; }
  /// Of the motion from row to row + 1.
  const std::vector<Certifier::Bows>& bows() const { return bows_; }

 private:
  void put_pair(std::size_t row, const ConstantsOf<Lanes>& chain);
  void bow_pair(std::size_t row);

  TableKinematics kinematics_;
  std::size_t count_ = 0;
  double spindle_arm2_;  // of the spindle direction from the outer axis
  std::array<Column, kMaxAxes> q_;
  std::array<Column, 2> sin_, cos_;
  Column arm2_outer_, arm2_inner_, axis_arm2_, size_mm_;  // as in Station; squared arm of the tool axis
  std::vector<ToolPose> poses_;
  std::vector<Certifier::Bows> bows_;
};

}  // namespace trunnion::path
