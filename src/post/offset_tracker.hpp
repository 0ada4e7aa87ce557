#pragma once
#include <limits>
#include <string>

#include "trunnion/thermal/offsets.hpp"

namespace trunnion::post {

/// Limits of a machine's own drift: it knows no clamp. The dead band stays: what is below it counts as
/// corrected.
inline thermal::OffsetLimits unlimited(thermal::OffsetLimits limits) {
  limits.clamp_mm = std::numeric_limits<double>::infinity();
  limits.slew_mm_s = std::numeric_limits<double>::infinity();
  return limits;
}

/// Thermal offsets along a program: what they are at the present moment, under their limits. The pipeline
/// (what is corrected) and the verification (where the machine stands) each have one and step it by the same
/// durations, those of the NC blocks as the control runs them.
class OffsetTracker {
 public:
  enum class Follow {
    always,     // as time goes on
    operations  // taken at the calls of `hold` only
  };
  OffsetTracker(const thermal::OffsetTable& table, const thermal::OffsetLimits& limits,
                Follow follow = Follow::always)
      : table_(table), follower_(limits), follow_(follow) {
    // What a table by operation wants first is not known before the first operation.
    if (over_time()) hold();
  }

  void advance(double seconds) {
    time_s_ += seconds;
    since_s_ += seconds;
    if (follow_ == Follow::always && (over_time() || begun_)) hold();
  }
  /// An operation begins; one that the table does not name leaves the offset as it is. While it runs the
  /// table by operation wants what it wanted: the slew limit counts the time since the operation before.
  void operation(const std::string& name) { begin(table_.of_operation(name)); }
  /// The same, said by a comment of a program that was read back.
  void comment(const std::string& text) { begin(table_.of_comment(text)); }
  /// Takes what is wanted now, as far as the limits allow.
  void hold() {
    now_mm_ = follower_.follow(over_time() ? table_.at_time(time_s_) : operation_mm_, since_s_);
    since_s_ = 0.0;
  }
  /// Deviation of the tool relative to the part in the table's frame, and in P with `R_MP` of the present
  /// pose, mm.
  const Vec3& now() const { return now_mm_; }
  Vec3 deviation_P(const Mat3& R_MP) const {
    return table_.frame == thermal::OffsetFrame::part ? now_mm_ : Vec3(R_MP.transpose() * now_mm_);
  }
  bool clamped() const { return follower_.clamped(); }
  bool slew_limited() const { return follower_.slew_limited(); }

 private:
  bool over_time() const { return table_.key == thermal::OffsetTable::Key::time; }
  void begin(const thermal::Offset* row) {
    if (row == nullptr) return;
    begun_ = true;
    operation_mm_ = row->deviation_mm;
    if (follow_ == Follow::operations) return;
    since_s_ = time_s_ - operation_s_;
    operation_s_ = time_s_;
    hold();
  }

  const thermal::OffsetTable& table_;
  thermal::OffsetFollower follower_;
  Follow follow_;
  double time_s_ = 0.0;
  double since_s_ = 0.0;  // since the offset was last taken
  double operation_s_ = 0.0;
  bool begun_ = false;  // an operation of the table
  Vec3 operation_mm_ = Vec3::Zero();
  Vec3 now_mm_ = Vec3::Zero();
};

}  // namespace trunnion::post
