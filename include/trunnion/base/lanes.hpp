#pragma once
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "trunnion/base/units.hpp"

/// Two or four doubles that are calculated with together. Templates over `double`, `Lanes` and `Quads` are
/// one formula for one value, for two and for four: every operation is that of IEEE 754 on each lane, so that
/// all give the same bits.
namespace trunnion {

using Lanes = double __attribute__((vector_size(16)));
using LaneMask = std::int64_t __attribute__((vector_size(16)));  // all bits of a lane set: true
using Quads = double __attribute__((vector_size(32)));
using QuadMask = std::int64_t __attribute__((vector_size(32)));

/// Before a function that calculates with Quads: it is compiled for processors with AVX2, together with all
/// that it calls, and may be called where lanes::four_at_a_time() says so. It must not take or give Quads by
/// value, and calls nothing that cannot be put in its place. TRUNNION_FOUR_IN_32: the same for
/// Way::four_in_32.
#if defined(__x86_64__) && defined(__OPTIMIZE__)
#define TRUNNION_FOUR __attribute__((target("avx2"), flatten))
#define TRUNNION_FOUR_IN_32 __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw"), flatten))
#else
#define TRUNNION_FOUR
#define TRUNNION_FOUR_IN_32
#endif

namespace lanes {

/// How a processor may calculate: four at a time in 16 registers (AVX2) or in 32 (AVX-512VL), which fewer
/// numbers have to leave for memory.
enum class Way : std::uint8_t { two, four, four_in_32 };

/// The last way that this processor knows, and that it was not told to leave.
Way way();
/// For tests that hold all ways to the same: none beyond this one. What exists already goes on as it began.
void calculate(Way most);
/// So many at a time.
inline std::size_t count_of(Way way) {
  return way == Way::two ? 2 : 4;
}
inline bool four_at_a_time() {
  return way() != Way::two;
}

template <class F>
[[gnu::flatten]] void with_two(const F& f) {
  f.template operator()<Lanes>();
}
template <class F>
TRUNNION_FOUR void with_four_in_16(const F& f) {
  f.template operator()<Quads>();
}
template <class F>
TRUNNION_FOUR_IN_32 void with_four_in_32(const F& f) {
  f.template operator()<Quads>();
}
/// f<T>(), T for four at a time.
template <class F>
void with_four(Way way, const F& f) {
  if (way == Way::four_in_32) {
    with_four_in_32(f);
  } else {
    with_four_in_16(f);
  }
}
/// f<T>(), T for as many as `way` says.
template <class F>
void at_a_time(Way way, const F& f) {
  if (way == Way::two) {
    with_two(f);
  } else {
    with_four(way, f);
  }
}

/// How many there are side by side.
template <class T>
inline constexpr std::size_t kCount = sizeof(T) / sizeof(double);
template <class T>
struct MaskOfLanes;
template <>
struct MaskOfLanes<Lanes> {
  using Type = LaneMask;
  using Whole = std::int32_t __attribute__((vector_size(8)));
};
template <>
struct MaskOfLanes<Quads> {
  using Type = QuadMask;
  using Whole = std::int32_t __attribute__((vector_size(16)));
};
/// What belongs to T of what there is for two lanes and for four.
template <class T, class Two, class Four>
auto& of_lanes(Two& two, Four& four) {
  if constexpr (kCount<T> == 2) {
    return two;
  } else {
    return four;
  }
}
/// What a comparison of T gives.
template <class T>
using Mask = typename MaskOfLanes<T>::Type;

inline double select(bool mask, double a, double b) {
  return mask ? a : b;
}
inline Lanes select(const LaneMask& mask, const Lanes& a, const Lanes& b) {
  return mask ? a : b;
}
inline Quads select(const QuadMask& mask, const Quads& a, const Quads& b) {
  return mask ? a : b;
}
inline bool any(bool mask) {
  return mask;
}
inline bool any(const LaneMask& mask) {
  return (mask[0] | mask[1]) != 0;
}
inline bool any(const QuadMask& mask) {
  return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
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
inline Quads sqrt(const Quads& x) {
  return Quads{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};  // one instruction
}
inline double abs(double x) {
  return std::abs(x);
}
template <class T>
T abs(const T& x) {
  constexpr std::int64_t kNoSign = 0x7fffffffffffffff;
  return std::bit_cast<T>(std::bit_cast<Mask<T>>(x) & (Mask<T>{} + kNoSign));
}
inline double copysign(double size, double sign) {
  return std::copysign(size, sign);
}
template <class T>
T copysign(const T& size, const T& sign) {
  constexpr std::int64_t kNoSign = 0x7fffffffffffffff;
  const Mask<T> rest = Mask<T>{} + kNoSign;
  return std::bit_cast<T>((std::bit_cast<Mask<T>>(size) & rest) | (std::bit_cast<Mask<T>>(sign) & ~rest));
}
/// Of two numbers that are no NaN.
template <class T>
T smaller(const T& a, const T& b) {
  return select(b < a, b, a);
}
template <class T>
T larger(const T& a, const T& b) {
  return select(a > b, a, b);
}
/// So many as follow one another in memory.
template <class T = Lanes>
T load(const double* from) {
  T out;
  std::memcpy(&out, from, sizeof(out));
  return out;
}
/// Of whole numbers.
template <class T>
T load_whole(const std::int32_t* from) {
  typename MaskOfLanes<T>::Whole out;
  std::memcpy(&out, from, sizeof(out));
  return __builtin_convertvector(out, T);
}
template <class T>
void store(double* to, const T& value) {
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
template <class T>
SinCos<T> sincos(const T& x) {
  if (any(Mask<T>(~(abs(x) <= kLargestAngle)))) {
    SinCos<T> out;
    for (int k = 0; k < static_cast<int>(kCount<T>); ++k) {
      const SinCos<double> one = sincos(x[k]);
      out.sin[k] = one.sin;
      out.cos[k] = one.cos;
    }
    return out;
  }
  return sincos_within(x);
}

/// A vector of doubles, or several vectors side by side.
template <class T>
struct Triple {
  T x, y, z;
};
/// Of two vectors that say x(), y() and z().
template <class V>
Triple<Lanes> side_by_side(const V& a, const V& b) {
  return {Lanes{a.x(), b.x()}, Lanes{a.y(), b.y()}, Lanes{a.z(), b.z()}};
}
/// The last of those before, and all but the last of the next: of motions that follow one another, where
/// they begin.
inline Lanes across(const Lanes& before, const Lanes& now) {
  return Lanes{before[1], now[0]};
}
inline Quads across(const Quads& before, const Quads& now) {
  return Quads{before[3], now[0], now[1], now[2]};
}
/// The same vector so many times.
template <class T, class V>
Triple<T> splat_vector(const V& v) {
  return {splat<T>(v.x()), splat<T>(v.y()), splat<T>(v.z())};
}
/// One from each of as many as T holds: `of(k)` of the k-th, a double.
template <class T, class Of>
T collect(const Of& of) {
  if constexpr (kCount<T> == 2) {
    return T{of(0), of(1)};
  } else {
    return T{of(0), of(1), of(2), of(3)};
  }
}
/// `of(k)` of the k-th: a vector that says x(), y() and z().
template <class T, class Of>
Triple<T> collect_vectors(const Of& of) {
  return {collect<T>([&](std::size_t k) { return of(k).x(); }),
          collect<T>([&](std::size_t k) { return of(k).y(); }),
          collect<T>([&](std::size_t k) { return of(k).z(); })};
}
/// Of three columns so many rows from `row` on.
template <class T, class Columns>
Triple<T> load_vectors(const Columns& columns, std::size_t row) {
  return {load<T>(&columns[0][row]), load<T>(&columns[1][row]), load<T>(&columns[2][row])};
}
template <class T, class Columns>
void store_vectors(Columns& columns, std::size_t row, const Triple<T>& v) {
  store(&columns[0][row], v.x);
  store(&columns[1][row], v.y);
  store(&columns[2][row], v.z);
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
