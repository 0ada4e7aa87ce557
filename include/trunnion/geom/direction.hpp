#pragma once
#include <cmath>
#include <optional>

#include "trunnion/geom/vec.hpp"

namespace trunnion {

/// A unit vector. Made only through its factories, so that a Direction is always of length 1 within rounding.
class Direction {
 public:
  /// Largest | |v| - 1 | that `from` takes: the rounding of four printed decimals in each component stays
  /// below it.
  static constexpr double kMaxLengthError = 1e-4;

  Direction() = default;  // +Z
  /// `v` normalised; nothing when its length is not 1 within kMaxLengthError.
  static std::optional<Direction> from(const Vec3& v) {
    if (!(std::abs(v.norm() - 1.0) <= kMaxLengthError)) return std::nullopt;
    return Direction(v.normalized());
  }
  /// `v` normalised; nothing for a zero or non-finite vector.
  static std::optional<Direction> normalised(const Vec3& v) {
    const double length = v.norm();
    if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
    return Direction(v / length);
  }
  const Vec3& vec() const { return unit_; }

 private:
  explicit Direction(const Vec3& unit) : unit_(unit) {}
  Vec3 unit_ = Vec3::UnitZ();
};

}  // namespace trunnion
