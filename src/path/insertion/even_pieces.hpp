#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "trunnion/base/lanes.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::path {

/// Rotary axes that turn less over a segment bend it evenly: pieces of one bow do. The straight joint path
/// and the great circle then need the same number of points.
inline constexpr Angle kSmallTurn = Angle::degrees(5.0);
/// No more even pieces than so many.
inline constexpr double kMostEvenPieces = 32.0;
/// A count that the bow misses by so little of a piece is tried first; the certificate decides.
inline constexpr double kCountSlack = 0.01;

/// Pieces of a segment that bends evenly: of one length where their ends are on the chord; where these stand
/// beside it, against the bow, those at the ends of the segment, which does not move, are shorter (README,
/// "Placement").
class EvenPieces {
 public:
  explicit EvenPieces(bool two_sided)
      : margin_(two_sided ? 0.25 * (2.0 - std::sqrt(2.0)) : 0.0), beside_(two_sided ? 0.5 : 0.0) {}

  bool two_sided() const { return beside_ > 0.0; }
  /// Whether the tip leads so little along the chord that ends beside it have their feet well on it, and that
  /// the bow of the segment is the one that its pieces have, on a larger scale. `along`:
  /// chord times the way from its middle to where the tip comes half way; `length2` of the chord. mm^2.
  template <class T>
  static auto bends_across(const T& along, const T& length2) {
    return 4.0 * lanes::abs(along) < length2;
  }
  /// The same for a whole tool, by the fraction of the segment at which it stands half way.
  template <class T>
  static auto bends_across(const T& nearest) {
    return 4.0 * lanes::abs(T(nearest - 0.5)) < 1.0;
  }
  /// As few as the bow of the segment asks for, a whole number. On the chord two, the fewest there can be,
  /// are tried before there is room for the rounding of the words, which leaves `tube_mm`. On both sides no
  /// end stands farther from the chord than that; where a plan may do with one piece less it is infinity.
  double count(double bow_mm, double tip_tolerance_mm, double tube_mm) const {
    if (!two_sided()) return bow_mm <= 4.0 * tip_tolerance_mm ? 2.0 : std::ceil(std::sqrt(bow_mm / tube_mm));
    const double exact = std::sqrt(beside_ * bow_mm / tube_mm) + 2.0 * margin_;
    const double wanted = std::max(2.0, std::ceil(exact));
    const bool one_less = wanted > 2.0 && exact - (wanted - 1.0) < kCountSlack;
    return one_less ? std::numeric_limits<double>::infinity() : wanted;
  }
  /// Fraction of the chord at which the piece of this number (from 1) ends, of `count`.
  double share(std::size_t number, std::size_t count) const {
    return (static_cast<double>(number) - margin_) / inner(count);
  }
  /// By how much of the bow of the segment their ends stand against it.
  double beside(std::size_t count) const { return beside_ / (inner(count) * inner(count)); }

 private:
  // Lengths of an inner piece that `count` pieces have.
  double inner(std::size_t count) const { return static_cast<double>(count) - 2.0 * margin_; }

  double margin_, beside_;
};

/// What a tolerance of the tip leaves for the bow when rounding of the words takes `word_error_mm`.
inline double tube_within(double tip_tolerance_mm, double word_error_mm) {
  const double left_mm = tip_tolerance_mm - word_error_mm;
  return left_mm < 0.5 * tip_tolerance_mm ? 0.5 * tip_tolerance_mm : left_mm;
}

}  // namespace trunnion::path
