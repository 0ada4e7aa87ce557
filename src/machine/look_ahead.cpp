#include "machine/look_ahead.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {
namespace {

// Time of a piece along which the square of the speed runs evenly.
double evenly_s(double length, double from2, double to2) {
  return length > 0.0 ? 2.0 * length / (std::sqrt(from2) + std::sqrt(to2)) : 0.0;
}

}  // namespace

double SpeedProfile::straight() const {
  return std::max(0.0, length - behind - before);
}

double SpeedProfile::pace() const {
  if (!(length > 0.0)) return 1.0;
  return std::min(1.0, std::sqrt(std::max({begin2, middle2, end2}) / fastest2));
}

double SpeedProfile::seconds() const {
  if (!(length > 0.0)) return asked_s;
  double out = evenly_s(behind, begin2, behind2) + evenly_s(before, before2, end2);
  if (!(straight() > 0.0)) return out;
  const double up = 0.5 * (middle2 - behind2) / acceleration;
  const double down = 0.5 * (middle2 - before2) / acceleration;
  out += evenly_s(up, behind2, middle2) + evenly_s(down, before2, middle2);
  return out + std::max(0.0, straight() - up - down) / std::sqrt(middle2);
}

LookAhead::LookAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits)
    : axes_(machine.axes.size()), blend_mm_(blend_mm) {
  for (AxisId id = 0; id < axes_; ++id) {
    acceleration_[id] = *machine.axes[id].acceleration;
    is_linear_[id] = machine.axes[id].kind == AxisKind::linear;
    digits_[id] = digits[id] / acceleration_[id];
  }
}

void LookAhead::add(const JointVector& from, const JointVector& to, double seconds) {
  Leg& leg = legs_.emplace_back();
  const Leg& last = legs_.size() > 1 ? legs_[legs_.size() - 2] : settled_;
  double length2 = 0.0;
  for (AxisId id = 0; id < axes_; ++id) {
    leg.along[id] = (to[id] - from[id]) / acceleration_[id];
    length2 += leg.along[id] * leg.along[id];
  }
  leg.length = std::sqrt(length2);
  leg.asked_s = seconds;
  if (leg.length > 0.0) {
    double steepest = 0.0;
    for (AxisId id = 0; id < axes_; ++id) {
      leg.along[id] /= leg.length;
      steepest = std::max(steepest, std::abs(leg.along[id]));
    }
    leg.acceleration = 1.0 / steepest;
    leg.fastest2 = length2 / (seconds * seconds);
  }
  leg.begins = begins_;
  if (leg.begins == Begin::at_corner) {
    if (leg.length > 0.0 && last.length > 0.0)
      turn(last, leg);
    else
      leg.begins = Begin::at_rest;  // a block that goes nowhere
  }
  begins_ = Begin::at_corner;
}

void LookAhead::turn(const Leg& before, Leg& leg) const {
  Corner& corner = leg.corner;
  const double rounded = 1.0 / before.length + 1.0 / leg.length;
  double turn2_mm2 = 0.0;
  for (AxisId id = 0; id < axes_; ++id) {
    const double by = std::abs(leg.along[id] - before.along[id]);
    if (is_linear_[id]) turn2_mm2 += by * by * acceleration_[id] * acceleration_[id];
    corner.turn[id] = std::max(0.0, by - digits_[id] * rounded);
  }
  // A parabola over z on either side passes the corner at turn * z / 4.
  double most = std::numeric_limits<double>::infinity();
  if (blend_mm_ && turn2_mm2 > 0.0) most = 4.0 * *blend_mm_ / std::sqrt(turn2_mm2);
  corner.before = std::min(0.5 * before.length, most);
  corner.behind = std::min(0.5 * leg.length, most);
  double largest = 0.0;
  const double length = corner.before + corner.behind;
  for (AxisId id = 0; id < axes_; ++id) {
    const double middle = (before.along[id] * corner.behind + leg.along[id] * corner.before) / length;
    corner.steepest_before[id] = std::max(std::abs(before.along[id]), std::abs(middle));
    corner.steepest_behind[id] = std::max(std::abs(leg.along[id]), std::abs(middle));
    corner.turn[id] /= length;
    largest = std::max(largest, corner.turn[id]);
  }
  corner.fastest2 = 1.0 / largest;
}

// The most at one end of a piece of a corner with `slow2` at the other: with the path an axis turns by
// turn * speed2, along it it slows down by along * (speed2 - slow2) / 2 length, and the sum is at most 1
// where the speed is largest.
double LookAhead::over(double slow2, const PerAxis& steepest, const PerAxis& turn, double length) const {
  if (!(length > 0.0)) return slow2;
  double out = std::numeric_limits<double>::infinity();
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double needs = 2.0 * length * turn[id] + steepest[id];
    out = std::min(out, (2.0 * length + steepest[id] * slow2) / needs);  // over 0: no bound
  }
  return std::max(out, slow2);
}

const LookAhead::Corner& LookAhead::end_of(std::size_t i) const {
  static const Corner kStraight;
  return i + 1 < legs_.size() ? legs_[i + 1].corner : kStraight;
}

double LookAhead::most_at_end2(std::size_t i) const {
  if (i + 1 == legs_.size()) return 0.0;
  const Leg& next = legs_[i + 1];
  return next.begins == Begin::unknown ? legs_[i].fastest2 : next.begin2;
}

double LookAhead::straight(std::size_t i) const {
  return std::max(0.0, legs_[i].length - legs_[i].corner.behind - end_of(i).before);
}

void LookAhead::bound() {
  bool changed = true;
  for (std::size_t i = legs_.size(); i-- > 0;) {
    Leg& leg = legs_[i];
    // Nothing that bounds it is other than when it was bounded before, nor what bounds those before it.
    if (leg.is_bounded && !changed) return;
    const double last_begin2 = leg.begin2;
    const Corner& end = end_of(i);
    leg.before2 = std::min(leg.fastest2, over(most_at_end2(i), end.steepest_before, end.turn, end.before));
    leg.behind2 = std::min(leg.fastest2, leg.before2 + 2.0 * leg.acceleration * straight(i));
    leg.begin2 = leg.begins == Begin::at_rest ? 0.0 : leg.behind2;
    if (leg.begins == Begin::at_corner) {
      const double before2 = i > 0 ? legs_[i - 1].fastest2 : settled_.fastest2;
      leg.begin2 =
          std::min({leg.fastest2, leg.corner.fastest2, before2,
                    over(leg.behind2, leg.corner.steepest_behind, leg.corner.turn, leg.corner.behind)});
    }
    changed = !leg.is_bounded || leg.begin2 != last_begin2;
    // The last one gets another end when one is added.
    leg.is_bounded = i + 1 < legs_.size();
  }
}

SpeedProfile LookAhead::run(std::size_t i) {
  const Leg& leg = legs_[i];
  const Corner& end = end_of(i);
  SpeedProfile out{leg.length, leg.asked_s, leg.fastest2, leg.acceleration, leg.corner.behind, end.before};
  out.begin2 = leg.begins == Begin::at_corner ? std::min(speed2_, leg.begin2) : leg.begin2;
  out.behind2 =
      std::min(leg.behind2, over(out.begin2, leg.corner.steepest_behind, leg.corner.turn, leg.corner.behind));
  const double gain2 = leg.acceleration * out.straight();
  out.before2 = std::min(leg.before2, out.behind2 + 2.0 * gain2);
  out.middle2 = std::min(leg.fastest2, 0.5 * (out.behind2 + out.before2) + gain2);
  out.end2 = std::min(most_at_end2(i), over(out.before2, end.steepest_before, end.turn, end.before));
  speed2_ = out.end2;
  return out;
}

void LookAhead::settle(std::size_t count, std::vector<SpeedProfile>& out) {
  bound();
  if (count == 0) return;
  for (std::size_t i = 0; i < count; ++i) out.push_back(run(i));
  settled_ = legs_[count - 1];
  legs_.erase(legs_.begin(), legs_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace trunnion
