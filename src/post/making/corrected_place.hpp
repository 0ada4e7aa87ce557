#pragma once
#include "post/making/lost_motion.hpp"

namespace trunnion::post {

/// Where the axes are sent for a nominal point: errors of the machine and thermal offsets taken out, rounded
/// to the words.
class CorrectedPlace {
 public:
  CorrectedPlace(ProgramInWork& work, const PlaceWords& words, const LostMotion& lost_motion)
      : work_(work), words_(words), lost_motion_(lost_motion) {}

  /// Checked against the limits; the block to it lasts `seconds`. Fails where the model has no correction, or
  /// one larger than is taken to be meant, with the line of the CL file.
  Result<JointVector> of(const path::Point& point, double seconds);
  /// Neither the prescribed tool axis nor the nominal rotary axes turn on the way to this point, and the
  /// tool's direction is corrected.
  bool stands(const path::Point& to) const;

 private:
  /// The rotary axes put the tool axis right, the linear ones the tip for it: `at.q`.
  Result<void> turn_for_errors(const path::Point& point, const Vec3& tip_P, MachineState& at);
  JointVector expected(const JointVector& nominal) const;

  ProgramInWork& work_;
  const PlaceWords& words_;
  const LostMotion& lost_motion_;
};

}  // namespace trunnion::post
