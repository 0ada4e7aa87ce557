#pragma once
#include "trunnion/base/lanes.hpp"

namespace trunnion::path {

/// Largest value on [0, 1] of a (1 - t) + b t + 4 c t (1 - t), c > 0. T: Lanes, Quads.
template <class T>
T largest_bowed_of(const T& a, const T& b, const T& c) {
  const T slope = b - a;
  const T within = 0.5 * (a + b) + c + slope * slope / (16.0 * c);
  return lanes::select(lanes::abs(slope) >= 4.0 * c, lanes::larger(a, b), within);
}

/// A bound on the length of a (1 - t) + b t + 4 t (1 - t) bow over [0, 1]: along the bow the largest value,
/// across it that of an end.
template <class T>
T farthest_bowed(const lanes::Triple<T>& a, const lanes::Triple<T>& b, const lanes::Triple<T>& bow) {
  constexpr double kLeast = 1e-300;  // for a bow that is none, the ends tell
  const T size = lanes::larger(lanes::sqrt(T(lanes::squared(bow))), lanes::splat<T>(kLeast));
  const T x = lanes::dot(a, bow) / size;
  const T y = lanes::dot(b, bow) / size;
  const T along = lanes::larger(largest_bowed_of(x, y, size), lanes::larger(T(-x), T(-y)));
  const T beside2 =
      lanes::larger(T{}, lanes::larger(T(lanes::squared(a) - x * x), T(lanes::squared(b) - y * y)));
  return lanes::sqrt(T(along * along + beside2));
}

}  // namespace trunnion::path
