#pragma once
#include <array>

#include "trunnion/base/lanes.hpp"

namespace trunnion::path {

/// Turns of both rotary axes, the outer one first, rad, that move the tool axis in P by `off`, to first
/// order: u(A, C) moves by u x n_A for each radian of A and by u x n_C for each of C. `outer_P`: n_A where C
/// stands.
///
/// The outer axis tilts the tool in one plane. Across that plane the inner one moves it by `lever` for each
/// radian, which is the sine of the tilt on axes at right angles, and nothing at the pole. It turns by no
/// more than that lever, so that the correction nowhere turns it faster than the tool is tilted: an `off`
/// across of d rad is taken out whole where the lever is the root of d or more (100 urad: 0.6 deg), of the
/// rest a share that goes to nothing at the pole. What is left there no rotary axis can put right.
template <class T, class Inner>
std::array<T, 2> turns_towards(const lanes::Triple<T>& off, const lanes::Triple<T>& axis_P,
                               const lanes::Triple<T>& outer_P, const lanes::Triple<Inner>& inner_P) {
  const lanes::Triple<T> a = lanes::cross(axis_P, outer_P);
  const lanes::Triple<T> c = lanes::cross(axis_P, inner_P);
  const lanes::Triple<T> across = lanes::cross(axis_P, a);  // as long as a
  const T aa = lanes::squared(a);
  const T way = lanes::dot(off, across);
  const T lever = lanes::dot(c, across);
  // A turn of the inner axis by what the lever allows, rad.
  const T most = lanes::abs(lever) / lanes::sqrt(aa);
  const T inner = lanes::select(lanes::abs(way) < most * lanes::abs(lever), T(way / lever),
                                lanes::select(way * lever < T{}, T(-most), most));
  return {T((lanes::dot(off, a) - lanes::dot(a, c) * inner) / aa), inner};
}

}  // namespace trunnion::path
