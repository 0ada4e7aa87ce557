#include "machine/smooth_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion {
namespace {

using PerAxis = std::array<double, kMaxAxes>;

// Shares of what an axis can that a corner may take at its largest speed; what is left is for getting up and
// down there. And of the jerk that is left, for accelerating along a curve: at first, and where it is known
// how much that accelerates. What these are makes the plan faster or slower, never too fast (README, "Jerk").
constexpr double kCornerAcceleration = 0.9;
constexpr double kCornerJerk = 0.85;
constexpr double kRampJerk = 0.85, kKnownRampJerk = 0.9;

constexpr double kCellShare = 0.25;  // of the way in which the acceleration gets to its largest
constexpr double kMostCells = 24.0;  // in a ramp
constexpr double kMostCornerCells = 16.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void SmoothPath::clear() {
  shapes_.clear();
  cells_.clear();
}

SmoothBounds SmoothPath::bounds(const SmoothShape& shape, double most2, double most_acceleration,
                                double more) const {
  SmoothBounds out{kInfinity, kInfinity, kInfinity};
  if (shape.is_straight) {
    double steepest = 0.0;
    double slowest = 0.0;
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      steepest = std::max(steepest, shape.steep[id]);
      slowest = std::max(slowest, shape.steep[id] * per_jerk_[id]);
    }
    return {1.0 / steepest, 1.0 / slowest, 1.0 / slowest};
  }
  const double speed = std::sqrt(most2);
  const double speed3 = most2 * speed;
  const double share = most_acceleration < kInfinity ? kKnownRampJerk : kRampJerk;
  // Most axes are not the one that bounds it: they need no division.
  const auto bound = [](double& most, double left, double each) {
    if (left < most * each) most = left / each;
  };
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double left = 1.0 - std::max(shape.twisted_up[id], shape.twisted_down[id]) * per_jerk_[id] * speed3;
    bound(out.acceleration, 1.0 - shape.curved[id] * most2, shape.steep[id]);
    bound(out.acceleration, share * left, 3.0 * shape.curved[id] * per_jerk_[id] * speed);
  }
  out.acceleration = std::min(out.acceleration, most_acceleration + more * out.acceleration);
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double left = 1.0 - 3.0 * shape.curved[id] * per_jerk_[id] * speed * out.acceleration;
    const double by_twist = per_jerk_[id] * speed3;
    const double steep = shape.steep[id] * per_jerk_[id];
    bound(out.jerk_up, left - shape.twisted_up[id] * by_twist, steep);
    bound(out.jerk_down, left - shape.twisted_down[id] * by_twist, steep);
  }
  return out;
}

double SmoothPath::most2(const SmoothShape& shape, double fastest2) const {
  double curved = 0.0;
  double twisted = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    curved = std::max(curved, shape.curved[id]);
    twisted = std::max(twisted, std::max(shape.twisted_up[id], shape.twisted_down[id]) * per_jerk_[id]);
  }
  const double most2 = std::min(fastest2, kCornerAcceleration / curved);  // over 0: no bound
  if (twisted * most2 * std::sqrt(most2) <= kCornerJerk) return most2;
  const double by_jerk = std::cbrt(kCornerJerk / twisted);
  return by_jerk * by_jerk;
}

SmoothPath::Half SmoothPath::half(const SmoothLeg& before, const SmoothLeg& leg, bool is_before) const {
  Half out;
  const SmoothLeg& own = is_before ? before : leg;
  const SmoothLeg& other = is_before ? leg : before;
  out.length = is_before ? leg.turns_before : leg.turns_behind;
  out.along = own.along;
  out.curve_outside = own.middle;
  const double length = leg.turns_before + leg.turns_behind;
  const double own_speed = std::sqrt(own.fastest2);
  const double other_speed = std::sqrt(other.fastest2);
  out.fastest2 = own.fastest2;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    out.curve_at[id] = 2.0 * leg.curve[id] -
                       (leg.turns_before * before.middle[id] + leg.turns_behind * leg.middle[id]) / length;
    const double turn = 0.5 * (out.curve_outside[id] + out.curve_at[id]) * out.length;
    out.at_corner[id] = out.along[id] + (is_before ? turn : -turn);
    // No axis is faster than in one of the two blocks.
    out.fastest[id] = std::max(std::abs(own.along[id]) * own_speed, std::abs(other.along[id]) * other_speed);
  }
  return out;
}

void SmoothPath::add_half(const Half& half, bool outwards, double ramp_s) {
  if (!(half.length > 0.0)) return;
  const auto shape_of = [&](double from, double to) {
    SmoothShape out;
    double fastest2 = half.fastest2;
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      const double by = half.curve_at[id] - half.curve_outside[id];
      out.curved[id] =
          std::max(std::abs(half.curve_outside[id] + from * by), std::abs(half.curve_outside[id] + to * by));
      const auto direction = [&](double at) {
        const double turned = at * (half.curve_outside[id] + 0.5 * at * by);
        const double whole = half.curve_outside[id] + 0.5 * by;
        const double share = whole != 0.0 ? turned / whole : at;
        return half.along[id] + share * (half.at_corner[id] - half.along[id]);
      };
      const double begin = direction(from), end = direction(to);
      out.steep[id] = std::max(std::abs(begin), std::abs(end));
      if (fastest2 * out.steep[id] * out.steep[id] > half.fastest[id] * half.fastest[id])
        fastest2 = half.fastest[id] * half.fastest[id] / (out.steep[id] * out.steep[id]);
      const double twist = (outwards ? -by : by) / half.length;
      if (begin * twist > 0.0 || end * twist > 0.0) out.twisted_up[id] = std::abs(twist);
      if (begin * twist < 0.0 || end * twist < 0.0) out.twisted_down[id] = std::abs(twist);
    }
    out.most2 = most2(out, fastest2);
    return out;
  };
  const SmoothShape whole = shape_of(0.0, 1.0);
  const double fits = half.length / (kCellShare * ramp_s * std::sqrt(whole.most2));
  const int count = fits > 1.0 ? static_cast<int>(std::min(std::ceil(fits), kMostCornerCells)) : 1;
  for (int i = 0; i < count; ++i) {
    const int place = outwards ? count - 1 - i : i;
    shapes_.push_back(count == 1 ? whole
                                 : shape_of(static_cast<double>(place) / count, (place + 1.0) / count));
    cells_.push_back({half.length / count, shapes_.size() - 1, false});
  }
}

// Short pieces where it may get up and down, longer ones between.
void SmoothPath::add_straight(const SmoothLeg& leg, double length, double ends2[2]) {
  if (!(length > 1e-9 * leg.length)) return;
  SmoothShape& shape = shapes_.emplace_back();
  shape.is_straight = true;
  shape.most2 = leg.fastest2;
  for (AxisId id = 0; id < kMaxAxes; ++id) shape.steep[id] = std::abs(leg.along[id]);
  const SmoothBounds most = bounds(shape, leg.fastest2, kInfinity, 0.0);
  const double ramp_s = most.acceleration / most.jerk_up;
  const double speed = std::sqrt(leg.fastest2);
  // From rest the acceleration gets up over this way.
  const double rest = most.acceleration * ramp_s * ramp_s / 6.0;
  const double ramp = 0.5 * leg.fastest2 / most.acceleration + 1.5 * speed * ramp_s;
  const auto shortest = [&](double end2, double at) {
    const double here =
        kCellShare * ramp_s * std::sqrt(std::min(leg.fastest2, end2 + most.acceleration * at));
    return std::max(here, std::min(ramp, length) / kMostCells);
  };
  const double least = std::min(0.125 * rest, length / 12.0);
  double at = 0.0;
  double last = ends2[0] > 0.0 ? kInfinity : least;
  while (at < length) {
    const double left = length - at;
    double here = at < ramp ? shortest(ends2[0], at) : std::max(shortest(ends2[0], at), 0.5 * at);
    const double to_ramp = left - ramp;
    here = std::min(here, std::max(shortest(ends2[1], left), 0.5 * to_ramp));
    here = std::min({here, at > 0.0 ? std::max(1.25 * last, least) : last, 0.25 * length});
    if (!(ends2[1] > 0.0)) here = std::min(here, std::max(0.2 * left, least));
    here = std::max(here, 1e-3 * length);
    if (left < 1.4 * here) here = left;
    cells_.push_back({here, shapes_.size() - 1, false});
    at += here;
    last = here;
    if (here == left) break;
  }
}

void SmoothPath::add(const SmoothLeg* before, const SmoothLeg& leg, const SmoothLeg* next) {
  const bool from_corner = before != nullptr && leg.begins == BlockBegin::at_corner;
  const bool to_corner = next != nullptr && next->begins == BlockBegin::at_corner;
  double slowest = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id)
    slowest = std::max(slowest, std::abs(leg.along[id]) * per_jerk_[id]);
  const double ramp_s = leg.acceleration * slowest;
  double straight = leg.length;
  double ends2[2] = {leg.begins == BlockBegin::at_rest ? 0.0 : leg.fastest2,
                     next != nullptr && next->begins == BlockBegin::unknown ? leg.fastest2 : 0.0};
  if (from_corner) {
    add_half(half(*before, leg, false), true, ramp_s);
    ends2[0] = shapes_.back().most2;
    straight -= leg.turns_behind;
  }
  if (!to_corner) {
    add_straight(leg, straight, ends2);
  } else {
    const Half end = half(leg, *next, true);
    straight -= next->turns_before;
    ends2[1] = end.fastest2;
    if (straight > 1e-9 * leg.length) {
      SmoothShape outside;
      for (AxisId id = 0; id < kMaxAxes; ++id) {
        outside.curved[id] = std::max(std::abs(end.curve_at[id]), std::abs(end.curve_outside[id]));
        outside.twisted_up[id] = std::abs(end.curve_at[id] - end.curve_outside[id]) / end.length;
      }
      ends2[1] = most2(outside, end.fastest2);
      add_straight(leg, straight, ends2);
    }
    add_half(end, false, ramp_s);
  }
  cells_.back().ends_block = true;
}

}  // namespace trunnion
