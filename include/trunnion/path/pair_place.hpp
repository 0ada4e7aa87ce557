#pragma once
#include <array>

#include "trunnion/base/lanes.hpp"

namespace trunnion::path {

/// Two positions side by side, and what the bounds of the motions that end there are made of. For machines
/// that TableKinematics evaluates side by side.
struct PairPlace {
  std::array<Lanes, 2> angle;    // of the outer and the inner axis
  lanes::Triple<Lanes> w;        // TableKinematics::w
  Lanes arm2_outer, arm2_inner;  // squared, as in Station
  Lanes size_mm;                 // for the rounding
};

}  // namespace trunnion::path
