#include "path/pole_settler.hpp"

namespace trunnion::path {

void PoleSettler::settle(std::span<const ChoicePoint> points, std::span<ChosenPoint> chosen,
                         ChoiceSummary& summary, const std::function<Ahead()>& look_ahead) {
  if (kinematics_.rotary_count() < 2) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (left_ == 0) {
      if (!chosen[i].singular) continue;
      begin(points.subspan(i), chosen.subspan(i), look_ahead);
    }
    place(points[i], chosen[i], summary);
    --left_;
  }
}

// The stretch that begins at the first of these points.
void PoleSettler::begin(std::span<const ChoicePoint> points, std::span<const ChosenPoint> chosen,
                        const std::function<Ahead()>& look_ahead) {
  left_ = 1;
  way_mm_ = 0.0;
  for (; left_ < points.size() && goes_on(points[left_], chosen[left_]); ++left_)
    way_mm_ += (points[left_].pose.tip_P - points[left_ - 1].pose.tip_P).norm();
  std::optional<ChosenPoint> next;
  bool next_rapid = false;
  if (left_ < points.size()) {
    next = chosen[left_];
    next_rapid = points[left_].rapid;
  } else {
    const Ahead ahead = look_ahead();
    left_ += ahead.points;
    way_mm_ += ahead.way_mm;
    next = ahead.next;
    next_rapid = ahead.next_rapid;
  }
  first_ = true;
  by_rapid_ = points[0].rapid;
  turn_ = gone_mm_ = 0.0;
  // Nothing follows that asks for a position, or C turns on the way there.
  if (!next || next->singular || next_rapid || next->reconfigure) return;
  const AxisId inner = kinematics_.rotary(1);
  in_ = chosen[0].q[inner];
  turn_ = next->q[inner] - in_;
}

void PoleSettler::place(const ChoicePoint& point, ChosenPoint& chosen, ChoiceSummary& summary) {
  if (!first_) gone_mm_ += (point.pose.tip_P - tip_before_P_).norm();
  tip_before_P_ = point.pose.tip_P;
  const bool first = first_;
  first_ = false;
  if (turn_ == 0.0) return;
  if (by_rapid_) {
    chosen.q = at(point, chosen.q, in_ + turn_);
  } else if (way_mm_ > 0.0) {
    if (!first) chosen.q = at(point, chosen.q, in_ + turn_ * gone_mm_ / way_mm_);
  } else {
    if (left_ > 1) return;
    chosen.q_leave = at(point, chosen.q, in_ + turn_);
    ++summary.turns_in_place;
    return;
  }
  chosen.q_leave = chosen.q;
}

JointVector PoleSettler::at(const ChoicePoint& point, const JointVector& q, double inner) const {
  JointVector out = q;
  out[kinematics_.rotary(1)] = inner;
  kinematics_.solve_linear(point.pose.tip_P, kinematics_.sines(out), out);
  return out;
}

}  // namespace trunnion::path
