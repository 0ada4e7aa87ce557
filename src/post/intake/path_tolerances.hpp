#pragma once
#include "trunnion/path/nonlinear.hpp"
#include "trunnion/post/post.hpp"

namespace trunnion::post {

/// Tolerances of the path as the options and the words of the CL file (LINTOL) have them. On a machine with
/// errors a share of the tool axis' tolerance is left to them: five axes correct the tip and the direction of
/// the tool at the points, and nothing between them.
class PathTolerances {
 public:
  PathTolerances(const PostJob& job, const PostOptions& options);
  void take(const cl::Tolerance& word);
  /// The tolerance of the path holds up to here along the tool; 0: for its tip alone.
  void set_flute(double length_mm);
  const path::Tolerance& cutting() const { return cutting_; }
  /// Of the tip of a cut, as the options and LINTOL ask for it.
  double tolerance_mm() const { return asked_mm_; }
  /// Of rapids only the tip is held to its line.
  const path::Tolerance& rapid() const { return rapid_; }

 private:
  const PostOptions& options_;
  double axis_share_;
  Angle axis_given_;
  double tip_share_;
  double tip_given_mm_;
  double word_error_mm_;  // of the tip's own words, which are rounded behind the insertion
  double flute_share_;
  double asked_mm_;
  double turn_error_;  // by which the rounding of the rotary words turns a corrected tool, rad
  path::Tolerance cutting_;
  double rapid_given_mm_;
  path::Tolerance rapid_;
};

}  // namespace trunnion::post
