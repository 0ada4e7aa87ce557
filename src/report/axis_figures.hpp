#pragma once
#include "trunnion/machine/machine.hpp"
#include "trunnion/post/verify.hpp"
#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// What the axes do along a program: positions with limits, velocities, distance from the pole with branch
/// changes, travel. `report.blocks` must not be empty.
Section axes_section(const Machine& machine, const post::VerifyReport& report);

/// How far a block is from the pole, where the inner rotary axis cannot change the tool direction:
/// |k . (n0 x n1)| is the sine of that angle (k the spindle, n0 and n1 the rotary axes, all as turned at the
/// block). The sign tells the two rotary solutions apart: their Jacobian's determinant changes it where they
/// meet.
struct PolePlace {
  double distance_rad = 0.0;  // 0 at the pole
  int branch = 0;             // +1, -1; 0 at the pole (below the rounding of the words)
};
/// Of every block; empty for machines without two rotary axes.
std::vector<PolePlace> pole_places(const Machine& machine, const post::VerifyReport& report);

}  // namespace trunnion::report
