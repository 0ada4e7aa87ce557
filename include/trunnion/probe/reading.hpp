#pragma once
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/probe/sphere.hpp"
#include "trunnion/probe/strokes.hpp"

namespace trunnion::probe {

struct ReadingOptions {
  /// How far the effective radius may be from that of ball and stylus ball: what a probe travels before it
  /// says so.
  double radius_tolerance_mm = 0.05;
};

/// One pose as it was measured.
struct PoseReading {
  JointVector q;  // of all joints where the centre of the stylus ball would be that of the ball
  Sphere sphere;  // in the positions of the linear axes, mm
  double free_radius_mm = 0.0;
  Vec3 deviation_M = Vec3::Zero();  // of the tool relative to the part, mm
  Vec3 u_mm = Vec3::Zero();         // standard uncertainty of the centre along X, Y and Z of M
};

/// A part of what the probe travels before it says so that goes `count` times round the spindle: the centres
/// are farther apart where they touch by cos_mm cos(count a) + sin_mm sin(count a), a the direction of the
/// touch from the ball's centre about Z of M, from X. Reversal errors of X and Y that differ look like two
/// lobes.
struct Lobes {
  int count = 0;
  double cos_mm = 0.0, sin_mm = 0.0;
  double u_mm = 0.0;  // standard uncertainty of either
  double size_mm() const { return std::hypot(cos_mm, sin_mm); }
};

/// What a log tells.
struct ProbeReading {
  std::vector<PoseReading> poses;
  double radius_mm = 0.0;  // effective, one for all poses
  double u_radius_mm = 0.0;
  double scatter_mm = 0.0;         // standard deviation of one touch about its sphere
  double fast_less_slow_mm = 0.0;  // median way by which the fast touches went farther
  double u_common_z_mm = 0.0;      // what the radius' uncertainty shifts all centres by, along Z
  std::vector<Lobes> lobes;        // found, and taken out of all that stands here
  diagnosis::Dataset data;         // three displacements a pose, along X, Y and Z of M
};

/// The log of a program that `strokes` holds, as measurements. Everything that does not fit is refused with
/// wrong_input, the line and the pose: a line too many or too few, one that does not lie on its touch's way,
/// a fast and a slow touch of one line that are apart, a touch off its sphere, a radius that is not that of
/// the ball, a machine file by which the ball would lie far from where the program looked for it. Each limit
/// is eight times what the touches of all poses scatter by, and 5 um at least (12 um between a fast and a
/// slow touch).
Result<ProbeReading> read_touches(const Machine& machine, const Strokes& strokes, std::string_view log,
                                  const std::string& file, const ReadingOptions& options);

}  // namespace trunnion::probe
