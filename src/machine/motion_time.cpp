#include "trunnion/machine/motion_time.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

namespace trunnion {

bool MotionTime::is_known(const Machine& machine) {
  return std::all_of(machine.axes.begin(), machine.axes.end(),
                     [](const Axis& axis) { return axis.acceleration.has_value(); });
}

double MotionTime::Block::acceleration() const {
  const bool halved = end == End::blends || end == End::stops;
  return length / (halved ? 2.0 * square_s : square_s);
}

double MotionTime::Block::speed() const {
  const double reached2 = 0.5 * (begins_at * begins_at + ends_at * ends_at) + acceleration() * length;
  return std::min(length / asked_s, std::sqrt(reached2));
}

MotionTime::Block MotionTime::block_of(const JointVector& from, const JointVector& to, double seconds) const {
  Block out;
  out.asked_s = seconds;
  double linear2_mm2 = 0.0;
  double rotary2_rad2 = 0.0;
  Vec3 way = Vec3::Zero();
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const Axis& axis = machine_.axes[id];
    const double by = to[id] - from[id];
    out.square_s = std::max(out.square_s, std::abs(by) / *axis.acceleration);
    if (axis.kind == AxisKind::linear) {
      linear2_mm2 += by * by;
      way += by * axis.direction;
    } else {
      rotary2_rad2 += by * by;
      out.turns = out.turns || by != 0.0;
    }
  }
  out.length = linear2_mm2 > 0.0 ? std::sqrt(linear2_mm2) : std::sqrt(rotary2_rad2) * kDegreePerRad;
  if (linear2_mm2 > 0.0 && way.norm() > 0.0) out.direction = way.normalized();
  return out;
}

void MotionTime::go(const JointVector& from, const JointVector& to, double seconds,
                    std::vector<BlockRun>& out) {
  Block block = block_of(from, to, seconds);
  // One that goes nowhere takes its time between two stops.
  if (block.square_s == 0.0) {
    stop(out);
    out.push_back({1.0, seconds});
    return;
  }
  if (count_ > 0) {
    Block& before = waiting_[count_ - 1];
    const End end = end_between(before, block);
    if (end == End::rounds) before.ends_at = block.begins_at = rounding_speed(before, block);
    end_last(end, out);
  }
  waiting_[count_++] = block;
}

void MotionTime::stop(std::vector<BlockRun>& out) {
  if (count_ > 0) end_last(blend_mm_ ? End::stops : End::rests, out);
}

void MotionTime::rest(std::vector<BlockRun>& out) {
  if (count_ > 0) end_last(End::rests, out);
}

void MotionTime::lose(std::vector<BlockRun>& out) {
  if (count_ > 0) end_last(End::is_lost, out);
}

MotionTime::End MotionTime::end_between(const Block& before, const Block& next) const {
  if (!blend_mm_) return End::rests;
  return before.turns || next.turns ? End::blends : End::rounds;
}

void MotionTime::end_last(End end, std::vector<BlockRun>& out) {
  Block& last = waiting_[count_ - 1];
  last.end = end;
  if (end == End::is_lost) last.ends_at = last.length / last.asked_s;
  if (count_ == 2) out.push_back(run_of(waiting_[0], &last));
  if (end == End::blends || end == End::rounds) {
    waiting_[0] = last;
    count_ = 1;
  } else {
    out.push_back(run_of(last, nullptr));
    count_ = 0;
  }
}

BlockRun MotionTime::run_of(const Block& block, const Block* next) const {
  const double speed = block.speed();
  BlockRun out{std::min(1.0, speed * block.asked_s / block.length)};
  if (what_ == PlanOf::paces) return out;
  // A ramp from v to the speed takes (speed - v)^2 / (2 a speed) more than the same way at the speed.
  const auto ramp_s = [&](double from) {
    const double by = std::max(0.0, speed - from);
    return 0.5 * by * by / (block.acceleration() * speed);
  };
  out.seconds = block.length / speed + ramp_s(block.begins_at) + ramp_s(block.ends_at);
  if (block.end == End::blends && next != nullptr)
    out.seconds -= blending_speed(block, *next) / block.acceleration();
  return out;
}

double MotionTime::blending_speed(const Block& before, const Block& next) const {
  // Neither block gives more than half of itself to the corner; beyond the longer of the two ramps there is
  // nothing to be gained.
  const double room_s = std::min(before.lasts_s(), next.lasts_s());
  const double ramps_s = std::max(before.speed() / before.acceleration(), next.speed() / next.acceleration());
  double speed = std::min(before.speed(), before.acceleration() * std::min(room_s, ramps_s));
  // Slowing down from v takes d = v^2 / 2a. Where the next block begins there the tool passes the corner at
  // d cos(half the angle between the blocks) / 2.
  const double cosine = std::sqrt(std::max(0.0, 0.5 * (1.0 - before.direction.dot(next.direction))));
  if (cosine * speed * speed > 4.0 * before.acceleration() * *blend_mm_)
    speed = 2.0 * std::sqrt(before.acceleration() * *blend_mm_ / cosine);
  return speed;
}

double MotionTime::rounding_speed(const Block& before, const Block& next) const {
  const double fastest = std::min(before.length / before.asked_s, next.length / next.asked_s);
  // An arc of radius r passes a corner that turns by t at r (1 / cos(t / 2) - 1), and takes r tan(t / 2) of
  // either block: half of it at most.
  const double cosine = std::sqrt(std::max(0.0, 0.5 * (1.0 + before.direction.dot(next.direction))));
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  if (!(sine > 0.0)) return fastest;
  const double radius = std::min(*blend_mm_ * cosine / (1.0 - cosine),
                                 0.5 * std::min(before.length, next.length) * cosine / sine);
  const double acceleration = std::min(before.length / before.square_s, next.length / next.square_s);
  return std::min(fastest, std::sqrt(acceleration * radius));
}

}  // namespace trunnion
