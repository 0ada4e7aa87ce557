#pragma once
#include <optional>
#include <string>

#include "post/making/posting.hpp"
#include "post/offset_tracker.hpp"
#include "post/work_shift.hpp"

namespace trunnion::post {

/// Thermal offsets in the text of a program, in each of the four manners (OffsetOutput): followed at every
/// point, one shift of the work offset for each operation, or values that the control takes at run time.
/// Without offsets nothing of it is written.
class ThermalOutput {
 public:
  explicit ThermalOutput(Posting& posting);

  /// Fails with wrong_use where the control has no words for it.
  Result<void> begin();
  bool has_offsets() const { return tracker_.has_value(); }
  /// Corrected axis values at every point.
  bool follows() const { return has_offsets() && !is_by_operation(); }
  bool shifts() const { return has_offsets() && is_by_operation(); }
  bool is_at_run_time() const {
    return has_offsets() && posting_.job.offset_output == OffsetOutput::variables;
  }
  /// What is followed at every point; else null.
  const OffsetTracker* followed() const { return follows() ? &*tracker_ : nullptr; }
  /// Deviation of the tool from the part, in P, at joint positions `q` now; only with offsets.
  Vec3 deviation_P(const JointVector& q) const {
    return tracker_->deviation_P(part_in_machine(posting_.machine, q).R);
  }
  /// By how much the axes may stand beside the words of the program, mm.
  double room_mm() const { return shifts() ? 2.0 * posting_.job.offset_limits.clamp_mm : 0.0; }

  void begin_operation(const std::string& name);
  void advance(double seconds) {
    if (tracker_) tracker_->advance(seconds);
  }
  /// The program calls this work offset. Fails where a shift must set it and the control's words do not reach
  /// it.
  Result<void> call(const nc::WorkOffset& offset) {
    shift_.read(offset);
    const bool sets = shifts() && !is_at_run_time() && kind_ == nc::OffsetShift::Kind::set;
    return sets ? shift_.may_set() : Result<void>{};
  }
  /// The shift of an operation that has begun is not written yet.
  bool waits() const { return due_; }
  const std::string& operation() const { return operation_; }
  /// Before the first motion of an operation, to `q`: decides on its shift, which `write_shift` writes. True
  /// when the tool must be away from the part for it.
  bool prepare_shift(const JointVector& q);
  Result<void> write_shift();
  /// At a rapid: values of the control that are old are taken anew.
  void renew();
  /// The motion to `q` with its terms of values at run time, where it names X, Y and Z.
  Result<void> write_motion(const nc::Motion& motion, const JointVector& q);
  /// What the machine's position is for words that mean `q`, while a shift is in force; notes the shift's
  /// error there.
  JointVector shifted(const JointVector& q);
  /// Warnings, and the block that ends all shifts.
  Result<void> finish();

 private:
  bool is_by_operation() const { return posting_.job.offset_output != OffsetOutput::axis_values; }
  void tell_what_is_not_covered();
  Result<void> latch();
  Result<void> write_calculation(bool first);
  nc::VariableMotion with_terms(const nc::Motion& motion, const JointVector& q) const;
  /// The most that the terms of a motion can do, for the report.
  void note_terms(const nc::VariableMotion& motion, const JointVector& q);

  Posting& posting_;
  std::optional<OffsetTracker> tracker_;
  WorkShift shift_;
  nc::OffsetShift::Kind kind_ = nc::OffsetShift::Kind::add;
  std::optional<nc::OffsetShift> prepared_;  // to be written
  std::optional<nc::OffsetShift> written_;   // the last one
  bool due_ = false;
  double latched_s_ = -1.0;         // when the values at run time were last taken; below zero: never
  std::optional<Mat3> terms_R_MP_;  // where the last motion with terms ended
  bool terms_beyond_ = false;       // with drift as large as the clamp an axis leaves its travel
  std::string operation_;
  std::size_t operations_named_ = 0;      // by the table of offsets
  std::vector<std::string> without_row_;  // operations that it does not name
};

}  // namespace trunnion::post
