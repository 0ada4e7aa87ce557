#pragma once
#include <algorithm>
#include <cmath>

#include "trunnion/path/certificate.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion::path {

/// Of the rotary axes from `a` to `b`, rad.
inline double largest_turn(const TableKinematics& kinematics, const JointVector& a, const JointVector& b) {
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn = std::max(turn, std::abs(kinematics.angle(b, k) - kinematics.angle(a, k)));
  return turn;
}

/// One segment as it is refined: its programmed ends, and where they stand when they were moved.
struct SegmentEnds {
  const Point* a = nullptr;  // as programmed
  const Point* b = nullptr;
  const Station* at_a = nullptr;  // where the machine stands
  const Station* at_b = nullptr;
  bool moved = false;

  /// Of the rotary axes from end to end, rad.
  double turn(const TableKinematics& kinematics) const { return largest_turn(kinematics, at_a->q, at_b->q); }
};

}  // namespace trunnion::path
