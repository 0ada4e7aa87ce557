#pragma once
// The one place where unit factors stand. Inside the library: mm, rad, s, K, mm/s, rad/s, rad (not deg) and
// so on.
#include <compare>

namespace trunnion {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTwoPi = 2.0 * kPi;

inline constexpr double kMmPerInch = 25.4;  // exact by definition (ISO 31-1)
inline constexpr double kMmPerFoot = 12.0 * kMmPerInch;
inline constexpr double kMmPerUm = 1e-3;
inline constexpr double kRadPerUrad = 1e-6;
inline constexpr double kRadPerDegree = kPi / 180.0;
inline constexpr double kDegreePerRad = 180.0 / kPi;
inline constexpr double kSecondsPerMinute = 60.0;

/// A plane angle. Public signatures take and return `Angle`; raw radians live inside formulas only.
/// `Angle::degrees(x)` of a multiple of 90 gives exactly the same double as the matching multiple of pi/2.
class Angle {
 public:
  constexpr Angle() = default;
  static constexpr Angle radians(double rad) { return Angle{rad}; }
  static constexpr Angle degrees(double deg) { return Angle{deg * kRadPerDegree}; }
  constexpr double rad() const { return rad_; }
  constexpr double deg() const { return rad_ * kDegreePerRad; }
  constexpr auto operator<=>(const Angle&) const = default;
  constexpr Angle operator-() const { return Angle{-rad_}; }
  constexpr Angle operator+(Angle other) const { return Angle{rad_ + other.rad_}; }
  constexpr Angle operator-(Angle other) const { return Angle{rad_ - other.rad_}; }
  constexpr Angle operator*(double factor) const { return Angle{rad_ * factor}; }

 private:
  explicit constexpr Angle(double rad) : rad_{rad} {}
  double rad_ = 0.0;
};

namespace literals {
consteval Angle operator""_deg(long double deg) {
  return Angle::degrees(static_cast<double>(deg));
}
consteval Angle operator""_deg(unsigned long long deg) {
  return Angle::degrees(static_cast<double>(deg));
}
/// Lengths are plain doubles in mm.
consteval double operator""_um(long double um) {
  return static_cast<double>(um) * kMmPerUm;
}
consteval double operator""_um(unsigned long long um) {
  return static_cast<double>(um) * kMmPerUm;
}
}  // namespace literals

}  // namespace trunnion
