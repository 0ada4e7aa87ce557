#pragma once
#include "trunnion/diagnosis/iso230_4.hpp"

namespace trunnion::iso230 {

inline constexpr std::string_view kRotationStandard = "ISO 230-7:2015";

enum class ErrorMotionKind { radial, axial, tilt };
std::string_view text_of(ErrorMotionKind kind);

/// Readings of one error motion over several turns: at angle k of every turn (mm, or rad for tilt).
struct ErrorMotion {
  std::string axis;  // "C"
  ErrorMotionKind kind = ErrorMotionKind::radial;
  std::string direction;  // of sensitivity: "X", "Y", "Z" fixed in the machine; "rotating" with the table
  std::vector<double> angle_rad;              // ascending in [0, 2 pi)
  std::vector<std::vector<double>> readings;  // [angle][turn]
};

/// The error motions of each rotary axis that a file holds. Readings of n = the axis are axial, across it
/// radial; rotations across it are tilt. Two fixed radial directions at right angles also give the rotating
/// one, r = dx cos + dy sin (tilt alike). Fails when no rotary axis turns, or turns of one motion have
/// different angles.
Result<std::vector<ErrorMotion>> error_motions(const Readings& readings);

/// ISO 230-7 values. The radial motion loses its fundamental first (it is the eccentricity of the target, not
/// of the axis); axial and tilt keep theirs, a residual synchronous value without it is added.
struct ErrorMotionValues {
  double total = 0.0;                          // width of the total error motion
  double synchronous = 0.0;                    // width of the mean over the turns
  double asynchronous = 0.0;                   // largest scatter over the turns at one angle
  std::optional<double> residual_synchronous;  // axial and tilt: synchronous without the fundamental
  double fundamental = 0.0;                    // amplitude of the once-per-turn part
  std::size_t turns = 0;
  Centre centre = Centre::least_squares;
};
/// `centre` nothing: LSC for a radial motion, the polar chart's centre for axial and tilt.
Result<ErrorMotionValues> evaluate_error_motion(const ErrorMotion& motion,
                                                std::optional<Centre> centre = std::nullopt);

}  // namespace trunnion::iso230
