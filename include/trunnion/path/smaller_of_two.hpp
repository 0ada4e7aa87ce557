#pragma once
#include "trunnion/base/lanes.hpp"

namespace trunnion::path {

/// Fraction by which to go on along a segment, where two points of a tool are then off by the lengths of
/// x0 - d b0 and x1 - d b1: the larger of both is smallest there. T: double, Lanes, Quads.
template <class T>
T smaller_of_two(const lanes::Triple<T>& x0, const lanes::Triple<T>& b0, const lanes::Triple<T>& x1,
                 const lanes::Triple<T>& b1) {
  constexpr double kLeast = 1e-300;
  const T one = lanes::splat<T>(1.0);
  const auto share = [&](const T& a, const T& b) -> T {
    return a / lanes::select(lanes::abs(b) > kLeast, b, one);
  };
  const T b0b0 = lanes::squared(b0);
  const T b1b1 = lanes::squared(b1);
  const T x0b0 = lanes::dot(x0, b0);
  const T x1b1 = lanes::dot(x1, b1);
  // A point that does not move has no best place of its own.
  const T of0 = share(x0b0, b0b0);
  const T of1 = share(x1b1, b1b1);
  const T best0 = lanes::select(b0b0 > kLeast, of0, of1);
  const T best1 = lanes::select(b1b1 > kLeast, of1, of0);
  // The difference of both squares is A d^2 - 2 B d + C: they are equal at a root of it, between the two.
  const T A = b0b0 - b1b1;
  const T B = x0b0 - x1b1;
  const T C = lanes::squared(x0) - lanes::squared(x1);
  const auto ahead = [&](const T& d) -> T { return (A * d - 2.0 * B) * d + C; };
  const T root = lanes::sqrt(lanes::larger<T>(T{}, B * B - A * C));
  const T sum = B + lanes::select(B < 0.0, T(-root), root);
  const T first = share(C, sum);
  const T low = lanes::smaller<T>(best0, best1);
  const T high = lanes::larger<T>(best0, best1);
  const T equal = lanes::select((first >= low) & (first <= high), first, share(sum, A));
  const T between = lanes::select(equal < low, low, lanes::select(equal > high, high, equal));
  return lanes::select(ahead(best0) >= 0.0, best0, lanes::select(ahead(best1) <= 0.0, best1, between));
}

}  // namespace trunnion::path
