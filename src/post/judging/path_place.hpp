#pragma once
#include <algorithm>
#include <cstddef>
#include <limits>

#include "trunnion/base/units.hpp"

#include "post/judging/deviation_meter.hpp"

// Private to the verifier: where the blocks of the program read back end on the CL path.
namespace trunnion::post {

/// A place on the CL path: segment `segment` runs from target `segment` to target `segment + 1`.
struct Place {
  std::size_t segment = 0;
  double t = 0.0;
  double distance = std::numeric_limits<double>::infinity();  // combined measure, mm
  // Of the position that was found to be there; of none: infinite.
  double off_tip_mm = std::numeric_limits<double>::infinity();
  double off_axis = std::numeric_limits<double>::infinity();  // length of a vector
};

/// What a block must stay below to change no figure of the report; sines of the axis' angles.
struct KnownFigures {
  double tip_mm = 0.0;
  double axis = 0.0;        // that is in the report already
  double axis_limit = 0.0;  // that may come into it
  double flute_mm = 0.0;    // VerifyOptions, and what its points must stay below where it is not 0
  double flute_limit_mm = 0.0;
  double axis_at_tip = 0.0;  // that is in the report already, of the axis where the tip is
};

/// What the places of a program on its CL path are looked for with.
struct FollowLimits {
  double tolerance_mm = 0.0;
  double axis_tolerance_rad = 0.0;
  double pole_tolerance_rad = 0.0;  // beyond that, in the pole's cone
  bool on_truth = false;            // on a machine with errors
  // Of the pole's cone, where one has a tolerance of its own: its direction in P, the cosine of its angle.
  bool has_cone = false;
  Vec3 cone_axis_P = Vec3::UnitZ();
  double cone_cosine = 1.0;

  bool in_cone(const Vec3& axis_P) const {
    return has_cone && std::abs(cone_axis_P.dot(axis_P)) >= cone_cosine;
  }
};

/// Two positions that differ by the rounding of words only.
inline constexpr double kSamePoint_mm = 5e-4;
/// A later place must be nearer by more than rounding.
inline constexpr double kNearer_mm = 1e-7;
/// Of the turn's weight: where the tip moves less, rounding of XYZ would decide.
inline constexpr double kStill_mm = 1e-3 * kAxisWeight_mm;
/// Beyond it the tip tells the place, whatever the turn.
inline constexpr double kTipTells_mm = kStill_mm * kPi;
/// Squared chord between tool axes below which the arc's fraction is the chord's within 1e-6.
inline constexpr double kNearChord2 = 2.5e-3;
/// The cosine, squared, of what may be a way out along the tool axis.
inline constexpr double kAlong2 = 0.99;
/// A way of so many times kSamePoint_mm is none of the tool axis alone.
inline constexpr double kTellsPoints = 20.0;

/// How far along a-b a position is. Where the tip stands nearly still the tool axis tells.
inline double fraction_of(const ToolPose& v, const Target& a, const Target& b) {
  const Vec3 d = b.tip_P - a.tip_P;
  const double l2 = d.squaredNorm();
  // No turn is above half a one: mostly that decides.
  double turn = kPi;
  if (l2 <= kStill_mm * turn * kStill_mm * turn) turn = b.turn;
  if (l2 > kStill_mm * turn * kStill_mm * turn) {
    return l2 > 0.0 ? std::clamp((v.tip_P - a.tip_P).dot(d) / l2, 0.0, 1.0) : 1.0;
  }
  return turn > 0.0 ? std::clamp(angle_between(a.axis_P, v.axis_P).rad() / turn, 0.0, 1.0) : 1.0;
}

/// How far the tip stands behind fraction t of the way from a to b: 0 where it does not tell.
inline double back_mm(const ToolPose& v, const Target& a, const Target& b, double t) {
  const Vec3 d = b.tip_P - a.tip_P;
  const double length_mm = d.norm();
  if (!(length_mm > kTipTells_mm)) return 0.0;
  return std::max(0.0, t * length_mm - std::max(0.0, (v.tip_P - a.tip_P).dot(d) / length_mm));
}

/// How much farther off than the chord between two tool axes, its square given, the arc between them may be
/// from a plane sector: seen from the centre it runs along the chord, at 1 / cos(theta / 2) at most.
template <class T>
T arc_beyond_chord(const T& chord2) {
  return 1.0 + chord2 / 6.0;
}
/// By how much more the tool axis of a block, its chord between ends that are off the path's by `off` at
/// most, may be off that of the path where the tip is: the path's arc bows, too.
template <class T>
T path_bow(const T& chord2, const T& off) {
  const T turn = lanes::sqrt(chord2) + 2.0 * off;
  const T turn2 = turn * turn;
  return turn2 * (0.125 + 0.015 * turn2);
}
/// How far a block goes: its tip and its tool axis.
struct Way {
  double tip_mm = 0.0;
  double axis_rad = 0.0;
};
/// How far ahead along the path a block may end that came so far: of the tip, mm, or of the axis, rad.
template <class T>
T reach_of(const T& way, double tolerance) {
  return 1.1 * way + 4.0 * tolerance;
}

}  // namespace trunnion::post
