#pragma once
#include "post/making/block_maker.hpp"

namespace trunnion::post {

/// The safe height: where the tool goes before a rotary axis turns outside a cut, before a tool change,
/// before the spindle stops and at the end, and how it comes back.
class SafeWay {
 public:
  SafeWay(ProgramInWork& work, const PlaceWords& words, CorrectedPlace& places, BlockMaker& blocks)
      : work_(work), words_(words), places_(places), blocks_(blocks) {}

  /// Z to the safe height, where it is not there already.
  Result<void> retract(SourceRef where);
  /// To the safe height, from where the tool comes back if the program cuts on.
  Result<void> pause_above(SourceRef where);
  /// `to`: where the motion that follows ends.
  Result<void> come_back(const path::Point& to, const ChunkMotion& motion);
  /// To the safe height: what follows comes from there.
  Result<void> leave_part(SourceRef where);
  /// From an unknown or safe position: up, the rotary axes, then over the part, then down.
  Result<void> approach(const path::Point& to, const ChunkMotion& motion);
  /// Up to the safe height, then the rotary axes and then X and Y to where `q` has them.
  Result<void> turn(const JointVector& q, SourceRef where);
  /// A rotary axis alone, as the CL file says (ROTABL): at once, or with what follows.
  Result<void> turn_table(AxisId id, double angle, bool now, SourceRef where);
  Result<void> end();

 private:
  /// The table was turned by a word of the CL file, and the program cuts on to `to`: how the rotary axes
  /// stand at the place that the tool comes back to. False: they cannot follow from there.
  bool take_turn(const path::Point& to);
  void tell_undone_turn(const path::Point& to);
  /// Why the safe height is none for this place; nothing: it is as far from the part, or farther.
  std::optional<std::string> above_safe_height(const JointVector& q) const;
  Result<void> rise_under_tcp(SourceRef where);
  Result<void> write_retract(nc::AxisLetter letter, double position_mm);
  Result<void> clamp_standing();
  JointVector above(const JointVector& q) const;

  ProgramInWork& work_;
  const PlaceWords& words_;
  CorrectedPlace& places_;
  BlockMaker& blocks_;
};

}  // namespace trunnion::post
