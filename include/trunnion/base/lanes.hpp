#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "trunnion/base/units.hpp"

/// Two doubles that are calculated with together. Templates over `double` and `Lanes` are one formula for one
/// value and for two: every operation is that of IEEE 754 on each lane, so that both give the same bits.
namespace trunnion {

using Lanes = double __attribute__((vector_size(16)));
using LaneMask = std::int64_t __attribute__((vector_size(16)));  // all bits of a lane set: true

namespace lanes {

inline double select(bool mask, double a, double b) {
  return mask ? a : b;
}
inline Lanes select(const LaneMask& mask, const Lanes& a, const Lanes& b) {
  return mask ? a : b;
}
inline bool any(bool mask) {
  return mask;
}
inline bool any(const LaneMask& mask) {
  return (mask[0] | mask[1]) != 0;
}
inline double sqrt(double x) {
  return std::sqrt(x);
}
inline Lanes sqrt(const Lanes& x) {
#if defined(__SSE2__)
  return _mm_sqrt_pd(x);
#else
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1])};
#endif
}
inline double abs(double x) {
  return std::abs(x);
}
inline Lanes abs(const Lanes& x) {
  constexpr std::int64_t kNoSign = 0x7fffffffffffffff;
  return std::bit_cast<Lanes>(std::bit_cast<LaneMask>(x) & LaneMask{kNoSign, kNoSign});
}
inline double copysign(double size, double sign) {
  return std::copysign(size, sign);
}
inline Lanes copysign(const Lanes& size, const Lanes& sign) {
  constexpr std::int64_t kNoSign = 0x7fffffffffffffff;
  const LaneMask rest{kNoSign, kNoSign};
  return std::bit_cast<Lanes>((std::bit_cast<LaneMask>(size) & rest) |
                              (std::bit_cast<LaneMask>(sign) & ~rest));
}
/// Of two numbers that are no NaN.
template <class T>
T larger(const T& a, const T& b) {
  return select(a > b, a, b);
}
/// Two that follow one another in memory.
inline Lanes load(const double* from) {
  Lanes out;
  std::memcpy(&out, from, sizeof(out));
  return out;
}
inline void store(double* to, const Lanes& value) {
  std::memcpy(to, &value, sizeof(value));
}
template <class T>
T splat(double x) {
  return T{} + x;
}
/// Nearest whole number, halves to even, for |x| < 2^51.
template <class T>
T nearest(const T& x) {
  constexpr double kNoFraction = 6755399441055744.0;  // 1.5 * 2^52 leaves no bit for a fraction
  return (x + kNoFraction) - kNoFraction;
}

/// The arctangent of a vector, before it is known in which quadrant it points: `at(y, x)` of it and of the
/// ones that it is mirrored to.
template <class T>
class Arctangent {
 public:
  Arctangent(const T& y, const T& x) {
    constexpr double kTanEighth = 0.41421356237309503;  // of an eighth of a turn's half: tan(pi / 8)
    const T ax = abs(x);
    const T ay = abs(y);
    const auto steep = ay > ax;
    const T least = select(steep, ax, ay);
    const T most = select(steep, ay, ax);
    const auto wide = least > kTanEighth * most;
    const T over = select(wide, least - most, least);
    const T under = select(wide, least + most, most);
    const T z = over / select(under > 0.0, under, splat<T>(1.0));
    const T u = z * z;
    // (atan(z)/z - 1)/z^2 through its values at the eleven Chebyshev nodes of u in [0, tan(pi/8)^2]; 7e-18
    // off.
    T p = splat<T>(-0.019176886573127324);
    for (const double c :
         {0.03923165784980771, -0.05085449722509816, 0.05858148909853524, -0.06664511447042512,
          0.07692183190801989, -0.09090904578122865, 0.11111111015256336, -0.14285714284666542,
          0.1999999999999552, -0.3333333333333333}) {
      p = p * u + c;
    }
    rest_ = z + z * (u * p);
    // So many eighths of a turn and z on or back from there.
    const T one = splat<T>(1.0);
    eighths_ = select(wide, one, T{});
    way_ = select(steep, -one, one);
    eighths_ = select(steep, 2.0 - eighths_, eighths_);
  }
  /// As std::atan2; 0 for (0, 0) whatever the signs. `y` and `x` as given or with other signs.
  T at(const T& y, const T& x) const {
    // pi / 4 in a piece of 33 bits and the rest.
    constexpr double kEighth1 = 0x1.921fb544p-1, kEighth2 = 3.038550253253096e-11;
    const auto back = x < 0.0;
    const T eighths = select(back, 4.0 - eighths_, eighths_);
    const T way = select(back, -way_, way_);
    const T angle = eighths * kEighth1 + (eighths * kEighth2 + way * rest_);
    return copysign(angle, y);
  }

 private:
  T eighths_, way_, rest_;
};

/// As std::atan2 within 3.5e-16 (tests: of long doubles, 4e6 cases); 0 for (0, 0) whatever the signs.
template <class T>
T atan2(const T& y, const T& x) {
  return Arctangent<T>(y, x).at(y, x);
}

template <class T>
struct SinCos {
  T sin, cos;
};

/// Beyond it `sincos` is that of the standard library.
inline constexpr double kLargestAngle = 1e5;

/// As std::sin and std::cos within 3e-16 for |x| <= kLargestAngle.
template <class T>
SinCos<T> sincos_within(const T& x) {
  // pi/2 in pieces of 33 bits: their products with less than 2^17 quarter turns are exact.
  constexpr double kQuarter1 = 0x1.921fb544p+0, kQuarter2 = 0x1.0b4611a6p-34,
                   kQuarter3 = 2.0222662487959506e-21;
  const T k = nearest<T>(x * (2.0 / kPi));
  const T r = ((x - k * kQuarter1) - k * kQuarter2) - k * kQuarter3;
  const T u = r * r;
  // Taylor's series; the first terms left out are below 1e-17 up to pi/4.
  T s = splat<T>(-1.0 / 1307674368000.0);
  for (const double c :
       {1.0 / 6227020800.0, -1.0 / 39916800.0, 1.0 / 362880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0})
    s = s * u + c;
  s = r + r * (u * s);
  T c = splat<T>(1.0 / 20922789888000.0);
  for (const double term :
       {-1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0, 1.0 / 40320.0, -1.0 / 720.0, 1.0 / 24.0})
    c = c * u + term;
  c = (1.0 - 0.5 * u) + u * (u * c);
  const T turn = k - 4.0 * nearest<T>(0.25 * k);  // quarter turns, -2 to 2
  const auto odd = abs(turn) == 1.0;
  const T sin = select(odd, c, s);
  const T cos = select(odd, s, c);
  const auto sin_back = abs(turn - 0.5) > 1.0;  // 2, -2, -1
  const auto cos_back = abs(turn + 0.5) > 1.0;  // 1, 2, -2
  return {select(sin_back, -sin, sin), select(cos_back, -cos, cos)};
}

inline SinCos<double> sincos(double x) {
  if (!(std::abs(x) <= kLargestAngle)) return {std::sin(x), std::cos(x)};
  return sincos_within(x);
}
inline SinCos<Lanes> sincos(const Lanes& x) {
  if (!(std::abs(x[0]) <= kLargestAngle && std::abs(x[1]) <= kLargestAngle)) {
    const SinCos<double> a = sincos(x[0]);
    const SinCos<double> b = sincos(x[1]);
    return {Lanes{a.sin, b.sin}, Lanes{a.cos, b.cos}};
  }
  return sincos_within(x);
}

/// A vector of doubles, or two vectors side by side.
template <class T>
struct Triple {
  T x, y, z;
};
/// Of two vectors that say x(), y() and z().
template <class V>
Triple<Lanes> side_by_side(const V& a, const V& b) {
  return {Lanes{a.x(), b.x()}, Lanes{a.y(), b.y()}, Lanes{a.z(), b.z()}};
}
template <class A, class B>
auto operator+(const Triple<A>& a, const Triple<B>& b) {
  return Triple<decltype(a.x + b.x)>{a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class A, class B>
auto operator-(const Triple<A>& a, const Triple<B>& b) {
  return Triple<decltype(a.x - b.x)>{a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S, class A>
auto operator*(const S& s, const Triple<A>& a) {
  return Triple<decltype(s * a.x)>{s * a.x, s * a.y, s * a.z};
}
template <class A, class B>
auto dot(const Triple<A>& a, const Triple<B>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
T squared(const Triple<T>& a) {
  return dot(a, a);
}
template <class A, class B>
auto cross(const Triple<A>& a, const Triple<B>& b) {
  return Triple<decltype(a.x * b.x)>{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace lanes
}  // namespace trunnion
