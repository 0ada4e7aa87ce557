#pragma once
#include <cstdint>

#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

/// A piece of path as the control runs it (q linear between q0 and q1), and what it must keep to: the segment
/// from `tip0_P` to `tip1_P` and the great circle from `axis0_P` to `axis1_P` (unit vectors, not opposite).
/// The ends of the piece need not lie on them.
struct Piece {
  JointVector q0, q1;
  Vec3 tip0_P, tip1_P;
  Vec3 axis0_P, axis1_P;
};

/// A proved interval for the largest deviation of a piece: the truth is in [lower, upper] (mm, or rad for the
/// axis).
struct Bound {
  double lower = 0.0;
  double upper = 0.0;
  std::uint32_t evaluations = 0;  // of the curve or of its polynomial
};

/// Answer of a decision: `yes` and `no` are proved; `unknown` only when the work limit was met.
enum class Within : std::uint8_t { yes, no, unknown };

/// Proved bounds on the nominal machine (README of this layer: mathematics and proof). Thread-safe, no
/// allocation.
class Certifier {
 public:
  /// Keeps a copy of `kinematics`.
  explicit Certifier(const TableKinematics& kinematics) : kinematics_(kinematics) {}

  /// Largest distance of the tip from the segment, mm; upper <= ratio * lower, or upper below `floor_mm`.
  Bound tip(const Piece& piece, double ratio = 1.05, double floor_mm = 1e-7) const;
  /// Largest angle of the tool axis from the arc of the great circle, rad.
  Bound axis(const Piece& piece, double ratio = 1.05, double floor_rad = 1e-9) const;

  /// Is the piece within the tolerance? Cheap forms first, the next only while undecided.
  Within tip_within(const Piece& piece, double tolerance_mm) const;
  Within axis_within(const Piece& piece, Angle tolerance) const;

  const TableKinematics& kinematics() const { return kinematics_; }

 private:
  TableKinematics kinematics_;
};

}  // namespace trunnion::path
