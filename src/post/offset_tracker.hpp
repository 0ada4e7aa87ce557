#pragma once
#include <string>

#include "trunnion/thermal/offsets.hpp"

namespace trunnion::post {

/// Thermal offsets along a program: what they are at the present moment, under their limits. The pipeline and
/// the verification each have one and step it by the same durations, those of the NC blocks as the control
/// runs them.
class OffsetTracker {
 public:
  OffsetTracker(const thermal::OffsetTable& table, const thermal::OffsetLimits& limits)
      : table_(table), follower_(limits) {
    advance(0.0);
  }

  void advance(double seconds) {
    time_s_ += seconds;
    const bool over_time = table_.key == thermal::OffsetTable::Key::time;
    now_mm_ = follower_.follow(over_time ? table_.at_time(time_s_) : operation_mm_, seconds);
  }
  /// An operation begins; one that the table does not name leaves the offset as it is. A comment of the
  /// program may name it.
  void operation(const std::string& name) {
    if (const thermal::Offset* row = table_.of_operation(name)) operation_mm_ = row->deviation_mm;
  }
  /// Deviation of the tool relative to the part in P, mm; `R_MP` of the present pose.
  Vec3 deviation_P(const Mat3& R_MP) const {
    return table_.frame == thermal::OffsetFrame::part ? now_mm_ : Vec3(R_MP.transpose() * now_mm_);
  }
  bool clamped() const { return follower_.clamped(); }
  bool slew_limited() const { return follower_.slew_limited(); }

 private:
  const thermal::OffsetTable& table_;
  thermal::OffsetFollower follower_;
  double time_s_ = 0.0;
  Vec3 operation_mm_ = Vec3::Zero();
  Vec3 now_mm_ = Vec3::Zero();
};

}  // namespace trunnion::post
