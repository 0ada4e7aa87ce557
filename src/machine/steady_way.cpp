#include "machine/steady_way.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {
namespace {

// Of what an axis can; the rest is for coming from here into what needs a plan.
constexpr double kMostShare = 0.9;

// Of the square of the speed that is asked for, on average: who loses more has a plan.
constexpr double kMostLost = 0.015;

double slope_of(const SmoothLeg& leg, const SmoothLeg& next) {
  return (next.corner.line2 - leg.corner.line2) * leg.per_length;
}

}  // namespace

// Where the lines turn upwards, the speed that rounds them is above them: by a quarter less than what they
// are lowered by for it.
void SteadyWay::draw(const SmoothLeg& before, SmoothLeg& leg, const SmoothLeg& next) {
  SteadyCorner& corner = leg.corner;
  corner.line2 = 0.0;
  if (!(corner.asked2 > 0.0) || !(before.corner.asked2 > 0.0) || !(next.corner.asked2 > 0.0)) return;
  const double turn = (next.corner.asked2 - corner.asked2) * leg.per_length -
                      (corner.asked2 - before.corner.asked2) * before.per_length;
  const double above = 0.25 * before.length * leg.length / (before.length + leg.length) * turn;
  corner.line2 = corner.asked2 - std::max(0.0, 4.0 / 3.0 * above);
}

void SteadyWay::judge(const SmoothLeg& before, SmoothLeg& leg, const SmoothLeg& next) const {
  SteadyCorner& corner = leg.corner;
  corner.is_steady = false;
  if (!(corner.line2 > 0.0) || !(before.corner.line2 > 0.0) || !(next.corner.line2 > 0.0)) return;
  const double slope_before = slope_of(before, leg);
  const double slope_behind = slope_of(leg, next);
  const double length = before.length + leg.length;
  corner.slope = (slope_before * before.length + slope_behind * leg.length) / length;
  corner.speed2 = corner.line2 + 0.25 * before.length * leg.length / length * (slope_behind - slope_before);
  const double middle2 = 0.5 * (before.corner.line2 + corner.line2);
  const double mean2 = (before.corner.speed2 + 4.0 * middle2 + corner.speed2) / 6.0;  // Simpson
  corner.is_steady =
      mean2 >= (1.0 - kMostLost) * before.fastest2 &&
      half_is_steady(corner, slope_before, middle2, 0.5 * before.length) &&
      half_is_steady(corner, slope_behind, 0.5 * (next.corner.line2 + corner.line2), 0.5 * leg.length);
}

// A half of a block, from the corner to its middle or the other way: the slope changes evenly.
bool SteadyWay::half_is_steady(const SteadyCorner& corner, double slope, double middle2, double half) const {
  const double most2 = std::max({corner.asked2, corner.line2, middle2});
  const double speed = std::sqrt(most2);
  const double per_half = 1.0 / half;
  const double along = 0.5 * std::max(std::abs(slope), std::abs(corner.slope));  // s''
  const double bend = std::abs(corner.slope - slope) * per_half;                 // 2 s''' / s'
  // The curvature is twice that of the corner at most, or none, and runs evenly over the half.
  const double curve = 2.0 * corner.curve, curve_s = 2.0 * corner.curve_s;
  const double acceleration = along + curve * most2;
  const double jerk =
      speed * (0.5 * longest_ramp_s_ * bend + 3.0 * curve_s * along + curve_s * per_half * most2);
  return acceleration <= kMostShare && jerk <= kMostShare;
}

std::array<SpeedPiece, 2> SteadyWay::along(const SmoothLeg& leg, const SmoothLeg& next) {
  const double half = 0.5 * leg.length;
  const double middle2 = 0.5 * (leg.corner.line2 + next.corner.line2);
  const double slope = slope_of(leg, next);
  const auto bend = [&](double from, double to) { return (to - from) * 2.0 * leg.per_length; };
  using Kind = SpeedPiece::Kind;
  return {{{half, leg.corner.speed2, middle2, leg.corner.slope, bend(leg.corner.slope, slope), Kind::between,
            false},
           {half, middle2, next.corner.speed2, slope, bend(slope, next.corner.slope), Kind::between, true}}};
}

}  // namespace trunnion
