#pragma once
#include <optional>

#include "post/making/place_words.hpp"

namespace trunnion::post {

/// On a machine that loses motion where an axis reverses: which way the axes go on, and where they take up
/// what they lose.
class LostMotion {
 public:
  LostMotion(const ProgramInWork& work, const PlaceWords& words) : work_(work), words_(words) {}

  /// The correction with the senses of motion that it leads to itself; those of `at` do not count. On a
  /// machine that loses no motion it is that of `at`.
  Result<path::Corrected> compensated(const Vec3& tip_P, const Vec3& axis_P, MachineState at) const;
  /// A rotary axis that would turn back by less than it loses, or by a digit, stays where it is.
  void hold_idle_turns(JointVector& q) const;
  /// Where an axis is about to reverse on the way to `next`: the position that takes its lost motion up
  /// before; nothing where none has to.
  std::optional<JointVector> taken_up(const JointVector& next) const;

 private:
  double turn_of(const MachineState& at, AxisId id, std::int8_t sense) const;

  const ProgramInWork& work_;
  const PlaceWords& words_;
};

}  // namespace trunnion::post
