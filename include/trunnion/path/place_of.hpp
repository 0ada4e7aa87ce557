#pragma once
#include <array>

#include "trunnion/base/lanes.hpp"

namespace trunnion::path {

/// A few positions side by side, and what the bounds of the motions that end there are made of. For machines
/// that TableKinematics evaluates side by side.
template <class T>
struct PlaceOf {
  std::array<T, 2> angle;    // of the outer and the inner axis
  lanes::Triple<T> w;        // TableKinematics::w
  T arm2_outer, arm2_inner;  // squared, as in Station
  T size_mm;                 // for the rounding
};

}  // namespace trunnion::path
