#pragma once
#include <cmath>

#include "trunnion/base/units.hpp"

namespace trunnion::path {

/// Rotary axes that turn less over a segment bend it evenly: pieces of one length do. The straight joint path
/// and the great circle then need the same number of points.
inline constexpr Angle kSmallTurn = Angle::degrees(5.0);
/// No more even pieces than so many.
inline constexpr double kMostEvenPieces = 16.0;

/// As few even pieces as the bow of a segment asks for, a whole number: a piece of n has n^2 times less bow
/// than the whole. Two, the fewest there can be, are tried before there is room for the rounding of the
/// words, which leaves `tube_mm`.
inline double even_pieces(double bow_mm, double tip_tolerance_mm, double tube_mm) {
  return bow_mm <= 4.0 * tip_tolerance_mm ? 2.0 : std::ceil(std::sqrt(bow_mm / tube_mm));
}

/// What a tolerance of the tip leaves for the bow when rounding of the words takes `word_error_mm`.
inline double tube_within(double tip_tolerance_mm, double word_error_mm) {
  const double left_mm = tip_tolerance_mm - word_error_mm;
  return left_mm < 0.5 * tip_tolerance_mm ? 0.5 * tip_tolerance_mm : left_mm;
}

}  // namespace trunnion::path
