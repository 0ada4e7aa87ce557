#include "path/choice/pole_settler.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {

void PoleSettler::settle(std::span<const ChoicePoint> points, std::span<ChosenPoint> chosen,
                         ChoiceSummary& summary, const std::function<Ahead()>& look_ahead) {
  if (kinematics_.rotary_count() < 2) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (left_ == 0) {
      if (!chosen[i].singular) continue;
      if (i > 0) {
        before_ = chosen[i - 1];
        before_axis_P_ = points[i - 1].pose.axis_P;
      }
      begin(points.subspan(i), chosen.subspan(i), look_ahead);
    }
    place(points[i], chosen[i], summary);
    --left_;
  }
  if (points.empty()) return;
  before_ = chosen[points.size() - 1];
  before_axis_P_ = points.back().pose.axis_P;
}

// C where the great circle between the pole and `axis_P`, where the axes stand at `q`, ends at the pole.
// There n1 x n2 is the way by which the outer axis tilts the tool axis, seen from the inner one's carrier.
double PoleSettler::led_by(const Vec3& pole_axis_P, const JointVector& at_pole, const Vec3& axis_P,
                           const JointVector& q) const {
  constexpr double kNoWay = 1e-9;
  constexpr double kStill_rad = 1e-9;  // axes at right angles
  const AxisId inner = kinematics_.rotary(1);
  const double tilts_by = q[kinematics_.rotary(0)] - at_pole[kinematics_.rotary(0)];
  const Vec3& n2 = kinematics_.direction(1);
  const Vec3 pole = n2.dot(pole_axis_P) >= 0.0 ? n2 : Vec3(-n2);
  const Vec3 way = axis_P - pole.dot(axis_P) * pole;
  const Vec3 tilt = (tilts_by >= 0.0 ? -1.0 : 1.0) * kinematics_.direction(0).cross(pole);
  if (way.norm() < kNoWay || tilt.norm() < kNoWay) return q[inner];
  const double angle = std::atan2(n2.dot(way.cross(tilt)), way.dot(tilt));
  const double by = std::remainder(angle - q[inner], kTwoPi);
  if (std::abs(by) < kStill_rad) return q[inner];
  const Axis& axis = machine_.axes[inner];
  return axis.has_limits() ? std::clamp(q[inner] + by, axis.min, axis.max) : q[inner] + by;
}

// The stretch that begins at the first of these points.
void PoleSettler::begin(std::span<const ChoicePoint> points, std::span<const ChosenPoint> chosen,
                        const std::function<Ahead()>& look_ahead) {
  left_ = 1;
  way_mm_ = 0.0;
  for (; left_ < points.size() && goes_on(points[left_], chosen[left_]); ++left_)
    way_mm_ += (points[left_].pose.tip_P - points[left_ - 1].pose.tip_P).norm();
  std::optional<ChosenPoint> next;
  Vec3 next_axis_P = Vec3::UnitZ();
  bool next_rapid = false;
  if (left_ < points.size()) {
    next = chosen[left_];
    next_axis_P = points[left_].pose.axis_P;
    next_rapid = points[left_].rapid;
  } else {
    const Ahead ahead = look_ahead();
    left_ += ahead.points;
    way_mm_ += ahead.way_mm;
    next = ahead.next;
    next_axis_P = ahead.next_axis_P;
    next_rapid = ahead.next_rapid;
  }
  first_ = true;
  by_rapid_ = points[0].rapid;
  turn_ = gone_mm_ = 0.0;
  const Vec3& pole_axis_P = points[0].pose.axis_P;
  const JointVector& q = chosen[0].q;
  const AxisId inner = kinematics_.rotary(1);
  in_ = q[inner];
  if (before_ && !by_rapid_ && !chosen[0].reconfigure && !before_->singular)
    in_ = led_by(pole_axis_P, q, before_axis_P_, before_->q_leave);
  // Nothing follows that asks for a position, or C turns on the way there.
  if (!next || next->singular || next_rapid || next->reconfigure) return;
  turn_ = led_by(pole_axis_P, q, next_axis_P, next->q) - in_;
}

void PoleSettler::place(const ChoicePoint& point, ChosenPoint& chosen, ChoiceSummary& summary) {
  if (!first_) gone_mm_ += (point.pose.tip_P - tip_before_P_).norm();
  tip_before_P_ = point.pose.tip_P;
  const bool first = first_;
  first_ = false;
  const double came = chosen.q[kinematics_.rotary(1)];
  if (turn_ == 0.0 && in_ == came) return;
  if (by_rapid_) {
    chosen.q = at(point, chosen.q, in_ + turn_);
  } else if (way_mm_ > 0.0) {
    if (!first || in_ != came) chosen.q = at(point, chosen.q, in_ + turn_ * gone_mm_ / way_mm_);
  } else {
    if (in_ != came) chosen.q = chosen.q_leave = at(point, chosen.q, in_);
    if (left_ > 1 || turn_ == 0.0) return;
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
