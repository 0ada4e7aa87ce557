#include "machine/look_ahead.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {
namespace {

// Time of a piece along which the square of the speed runs evenly.
double evenly_s(double length, double from2, double to2) {
  return length > 0.0 ? 2.0 * length / (std::sqrt(from2) + std::sqrt(to2)) : 0.0;
}

using PerAxis = std::array<double, kMaxAxes>;

// The most at one end of a piece of a corner with `slow2` at the other: with the path an axis turns by
// turn * speed2, along it it slows down by along * (speed2 - slow2) / 2 length, and the sum is at most 1
// where the speed is largest.
double over(double slow2, const PerAxis& steepest, const PerAxis& turn, double length) {
  if (!(length > 0.0)) return slow2;
  double out = std::numeric_limits<double>::infinity();
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double needs = 2.0 * length * turn[id] + steepest[id];
    out = std::min(out, (2.0 * length + steepest[id] * slow2) / needs);  // over 0: no bound
  }
  return std::max(out, slow2);
}

}  // namespace

double SpeedProfile::straight() const {
  return std::max(0.0, length - behind - before);
}

double SpeedProfile::pace() const {
  if (!(length > 0.0)) return 1.0;
  const double most2 = std::max({begin2, middle2, end2});
  return most2 < fastest2 ? std::sqrt(most2 / fastest2) : 1.0;
}

double SpeedProfile::seconds() const {
  if (!(length > 0.0) || std::min({begin2, behind2, before2, end2}) == fastest2) return asked_s;
  double out = evenly_s(behind, begin2, behind2) + evenly_s(before, before2, end2);
  if (!(straight() > 0.0)) return out;
  const double up = 0.5 * (middle2 - behind2) / acceleration;
  const double down = 0.5 * (middle2 - before2) / acceleration;
  out += evenly_s(up, behind2, middle2) + evenly_s(down, before2, middle2);
  return out + std::max(0.0, straight() - up - down) / std::sqrt(middle2);
}

LookAhead::LookAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits,
                     PlanOf what)
    : blend_mm_(blend_mm), what_(what), legs_(machine, digits) {}

void LookAhead::add(const JointVector& from, const JointVector& to, double seconds) {
  if (!legs_.add(from, to, seconds)) return;
  const std::size_t last = legs_.size() - 1;
  begin_at_corner(legs_.before(last), legs_[last]);
}

void LookAhead::begin_at_corner(const Leg& before, Leg& leg) const {
  double most = std::numeric_limits<double>::infinity();
  if (blend_mm_) {
    const double turn_mm = legs_.ways().linear_turn(before, leg);
    // A parabola over z on either side passes the corner at turn * z / 4.
    if (turn_mm > 0.0) most = 4.0 * *blend_mm_ / turn_mm;
  }
  leg.turns_before = std::min(0.5 * before.length, most);
  leg.turns_behind = std::min(0.5 * leg.length, most);
  double largest = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) largest = std::max(largest, legs_.ways().turn_of(id, before, leg));
  // `over` for all axes at once: none is steeper than 1.
  const double fast2 = std::max(before.fastest2, leg.fastest2);
  const double slow2 = std::min(before.fastest2, leg.fastest2);
  const double length = leg.turns_before + leg.turns_behind;
  const double shorter = std::min(leg.turns_before, leg.turns_behind);
  leg.is_free = largest * fast2 * shorter + 0.5 * (fast2 - slow2) * length <= length * shorter;
}

LookAhead::Corner LookAhead::corner(const Leg& before, const Leg& leg) const {
  Corner out;
  double largest = 0.0;
  const double length = leg.turns_before + leg.turns_behind;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double middle = (before.along[id] * leg.turns_behind + leg.along[id] * leg.turns_before) / length;
    out.steepest_before[id] = std::max(std::abs(before.along[id]), std::abs(middle));
    out.steepest_behind[id] = std::max(std::abs(leg.along[id]), std::abs(middle));
    out.turn[id] = legs_.ways().turn_of(id, before, leg) / length;
    largest = std::max(largest, out.turn[id]);
  }
  out.fastest2 = 1.0 / largest;  // over 0: no bound
  return out;
}

// Length over which the path turns already at the end of a block.
double LookAhead::turns_at_end(std::size_t i) const {
  return i + 1 < legs_.size() ? legs_[i + 1].turns_before : 0.0;
}

double LookAhead::most_at_end2(std::size_t i) const {
  if (i + 1 == legs_.size()) return 0.0;
  const Leg& next = legs_[i + 1];
  return next.begins == BlockBegin::unknown ? legs_[i].fastest2 : next.begin2;
}

double LookAhead::straight(std::size_t i) const {
  return std::max(0.0, legs_[i].length - legs_[i].turns_behind - turns_at_end(i));
}

void LookAhead::bound() {
  bool changed = true;
  for (std::size_t i = legs_.size(); i-- > 0;) {
    Leg& leg = legs_[i];
    // Nothing that bounds it is other than when it was bounded before, nor what bounds those before it.
    if (leg.is_bounded && !changed) return;
    const double last_begin2 = leg.begin2;
    const Leg* next = i + 1 < legs_.size() ? &legs_[i + 1] : nullptr;
    if (next == nullptr || next->begins != BlockBegin::at_corner) {
      leg.before2 = std::min(leg.fastest2, most_at_end2(i));
    } else if (next->is_free && next->behind2 == next->fastest2) {
      leg.before2 = leg.fastest2;
    } else {
      const Corner end = corner(leg, *next);
      leg.before2 =
          std::min(leg.fastest2, over(next->begin2, end.steepest_before, end.turn, next->turns_before));
    }
    leg.behind2 = std::min(leg.fastest2, leg.before2 + 2.0 * leg.acceleration * straight(i));
    leg.begin2 = leg.begins == BlockBegin::at_rest ? 0.0 : leg.behind2;
    if (leg.begins == BlockBegin::at_corner) {
      leg.begin2 = std::min(leg.fastest2, legs_.before(i).fastest2);
      if (!leg.is_free || leg.behind2 != leg.fastest2) {
        const Corner begin = corner(legs_.before(i), leg);
        leg.begin2 = std::min({leg.begin2, begin.fastest2,
                               over(leg.behind2, begin.steepest_behind, begin.turn, leg.turns_behind)});
      }
    }
    changed = !leg.is_bounded || leg.begin2 != last_begin2;
    // The last one gets another end when one is added.
    leg.is_bounded = next != nullptr;
  }
}

SpeedProfile LookAhead::run(std::size_t i) {
  const Leg& leg = legs_[i];
  SpeedProfile out{leg.length,       leg.asked_s,      leg.fastest2,
                   leg.acceleration, leg.turns_behind, turns_at_end(i)};
  out.begin2 = leg.begins == BlockBegin::at_corner ? std::min(speed2_, leg.begin2) : leg.begin2;
  out.behind2 = leg.behind2;
  if (leg.begins != BlockBegin::at_corner) {
    out.behind2 = std::min(leg.behind2, out.begin2);
  } else if (!leg.is_free || out.begin2 < leg.begin2 || leg.behind2 != leg.fastest2) {
    const Corner begin = corner(legs_.before(i), leg);
    out.behind2 =
        std::min(leg.behind2, over(out.begin2, begin.steepest_behind, begin.turn, leg.turns_behind));
  }
  const double gain2 = leg.acceleration * out.straight();
  out.before2 = std::min(leg.before2, out.behind2 + 2.0 * gain2);
  out.middle2 = std::min(leg.fastest2, 0.5 * (out.behind2 + out.before2) + gain2);
  out.end2 = most_at_end2(i);
  // At the end of a corner it may be as fast as before it, where nothing behind it says otherwise.
  if (out.before2 < out.end2) {
    out.end2 = out.before2;
    if (turns_at_end(i) > 0.0) {
      const Corner end = corner(leg, legs_[i + 1]);
      out.end2 = std::min(most_at_end2(i), over(out.before2, end.steepest_before, end.turn, turns_at_end(i)));
    }
  }
  speed2_ = out.end2;
  return out;
}

void LookAhead::settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedProfile>* profiles) {
  bound();
  if (count == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    const SpeedProfile profile = run(i);
    out.push_back({profile.pace(), what_ == PlanOf::paces ? 0.0 : profile.seconds()});
    if (profiles != nullptr) profiles->push_back(profile);
  }
  legs_.forget(count);
}

}  // namespace trunnion
