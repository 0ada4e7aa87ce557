#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/diagnosis/iso230_lines.hpp"

namespace trunnion::iso230 {

/// The editions of ISO 230-2 share these formulas; the year goes into every report, since older editions
/// differ.
inline constexpr std::string_view kPositioningStandard = "ISO 230-2:2014";

/// Travel beyond which the standard asks for one run per direction and gives no s, R, A (5.3.3).
inline constexpr double kLongLinearTravel_mm = 2000.0;
inline constexpr double kLongRotaryTravel_turns = 1.0;

/// What one direction of approach shows (mm or rad).
struct Unidirectional {
  std::vector<double> mean;           // x-bar_i, mean unidirectional positioning deviation at target i
  std::vector<double> s;              // s_i, estimator of the repeatability; empty without replicates
  std::vector<double> repeatability;  // R_i = 4 s_i; empty without replicates
  double E = 0.0;                     // max - min of the means
  std::optional<double> R;            // max R_i
  std::optional<double> A;            // max(mean + 2 s) - min(mean - 2 s)
};

/// All symbols of ISO 230-2 for one line (mm or rad). What needs both directions or replicates is absent
/// without them.
struct Positioning {
  std::string name;
  bool rotary = false;
  std::vector<double> target;
  std::size_t runs_up = 0, runs_down = 0;
  std::optional<Unidirectional> up, down;
  std::vector<double> mean;           // x-bar_i = (up + down) / 2
  std::vector<double> reversal;       // B_i = up - down, signed
  std::vector<double> repeatability;  // R_i = max(2 s_up + 2 s_down + |B_i|, R_i up, R_i down)
  std::optional<double> B;            // max |B_i|
  std::optional<double> B_mean;       // mean of B_i, signed
  std::optional<double> R, E, M, A;
  std::vector<std::string> notes;  // where the data do not meet the standard's test procedure
};

/// Evaluates a line by ISO 230-2:2014. With B_i = x-bar_i up - x-bar_i down:
///   R = max_i R_i;  E = max_i(x-bar up, x-bar down) - min_i(x-bar up, x-bar down);  M = max_i x-bar_i -
///   min_i x-bar_i; A = max_i(x-bar + 2 s, both directions) - min_i(x-bar - 2 s, both directions).
/// A travel above 2000 mm or 360 degrees has no s, R, A whatever the number of runs.
/// Fails when no direction has a reading at every target, or a direction has unequal numbers of runs.
Result<Positioning> evaluate_positioning(const LineTest& test);

/// ISO 230-6:2002: each diagonal by the procedure of ISO 230-2, and the largest value over the diagonals.
inline constexpr std::string_view kDiagonalStandard = "ISO 230-6:2002";
struct Diagonals {
  std::vector<Positioning> lines;
  std::vector<double> peak_to_valley;   // of all means, both directions: equal to E of that diagonal
  std::optional<double> E, R, B, A, M;  // largest over the diagonals; absent where any diagonal lacks it
  /// Angle between the two axes of a plane, minus 90 degrees, from the difference of the two face diagonals'
  /// slopes: (k2 - k1) L^2 / (2 L1 L2), first order, k1 on the diagonal whose axes rise together. > 0: the
  /// angle between the positive axes is above 90 degrees (rad).
  struct Squareness {
    std::string plane;  // "XY"
    double opening_rad = 0.0;
  };
  std::vector<Squareness> squareness;
};
Result<Diagonals> evaluate_diagonals(const std::vector<LineTest>& tests);

}  // namespace trunnion::iso230
