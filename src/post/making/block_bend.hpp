#pragma once
#include <optional>

#include "post/making/place_words.hpp"

namespace trunnion::post {

/// Whether the tool, with the machine's errors, leaves the path on the way of a block that begins where the
/// text has come to, and what then stands between its ends.
class BlockBend {
 public:
  BlockBend(ProgramInWork& work, const PlaceWords& words) : work_(work), words_(words) {}

  /// By more than the tolerance, on the block to `q`, the place of `to`. `bounded`: norms were asked
  /// beforehand.
  bool leaves_path(const path::Point& to, const JointVector& q, bool bounded = false);
  /// What a piece over several segments leaves of the tolerance to the errors.
  path::Tolerance span_tolerance() const;
  /// Half way to `to`, nominal.
  path::Point middle_before(const path::Point& to) const;
  /// `q` with the linear words of the block before, where these differ by rounding only and the tip stays
  /// within the tolerance; nothing else.
  std::optional<JointVector> without_idle_digits(const path::Point& to, const JointVector& q) const;

 private:
  bool stays_surely(const path::Point& to, const JointVector& q, double limit_mm, bool bounded);
  /// Once, where the rotary axes leave the flute's end off by so much.
  void say_what_stays(const path::Point& to, double off_mm);
  bool span_leaves_path(const path::Point& to, const JointVector& q) const;
  double strays_mm(const path::Point& to, const JointVector& q, double t) const;
  /// With the machine's errors, at the fraction t of the block to `q`.
  Vec3 actual_tip_P(const JointVector& q, double t) const;

  ProgramInWork& work_;
  const PlaceWords& words_;
};

}  // namespace trunnion::post
