#include "post/deviation_meter.hpp"

#include <array>
#include <boost/math/tools/minima.hpp>

namespace trunnion::post {
namespace {

// Samples of a motion where no proof is available.
constexpr int kSamples = 16;

// Angle from u to the arc of the great circle from a to b.
double angle_to_arc(const Vec3& u, const Vec3& a, const Vec3& b) {
  const double to_ends = std::min(angle_between(u, a).rad(), angle_between(u, b).rad());
  const Vec3 n = a.cross(b);
  if (n.norm() < 1e-12) return to_ends;
  const Vec3 unit = n.normalized();
  const Vec3 foot = u - unit.dot(u) * unit;
  const bool inside = a.cross(foot).dot(unit) >= 0.0 && foot.cross(b).dot(unit) >= 0.0;
  return inside ? std::asin(std::min(1.0, std::abs(unit.dot(u)))) : to_ends;
}

}  // namespace

ToolPose DeviationMeter::pose_with_errors(const MachineState& state) const {
  ToolPose pose = with_errors_.pose(state.q, truth_->errors(state));
  pose.tip_P -= datum_P_;
  return pose;
}

ToolPose DeviationMeter::pose(const MachineState& state) const {
  ToolPose pose = truth_ == nullptr ? kinematics().pose(state.q) : pose_with_errors(state);
  if (offsets_ != nullptr) pose.tip_P += offsets_->deviation_P(part_in_machine(machine_, state.q).R);
  return pose;
}

void DeviationMeter::place(Vertex& vertex, const MachineState& state) const {
  vertex.q = state.q;
  vertex.time_s = state.time_s;
  if (certify_ || truth_ != nullptr) vertex.station = path::station(kinematics(), state.q);
  if (certify_) {
    vertex.tip_P = vertex.station.tip_P;
    vertex.axis_P = vertex.station.axis_P;
    return;
  }
  const ToolPose at = pose(state);
  vertex.tip_P = at.tip_P;
  vertex.axis_P = at.axis_P;
}

JointVector DeviationMeter::between(const Vertex& from, const Vertex& to, double t) const {
  JointVector q = JointVector::interpolate(from.q, to.q, t);
  if (!to.tcp || !from.tcp) return q;
  // The control keeps the tip of the nominal machine on the line.
  const auto tip = [&](const Vertex& v) { return kinematics().pose(v.q).tip_P; };
  kinematics().solve_linear((1.0 - t) * tip(from) + t * tip(to), kinematics().sines(q), q);
  return q;
}

Vertex DeviationMeter::nearest_between(const Vertex& from, const Vertex& to, const Target& corner,
                                       const ProgramState& program) const {
  const auto at = [&](double t) {
    Vertex x = to;
    place(x, program.towards(to.q, between(from, to, t)));
    return x;
  };
  const auto distance = [&](double t) { return combined_distance(at(t), corner.tip_P, corner.axis_P); };
  // On a nearly straight piece the distance has one minimum, and its square is nearly a parabola.
  constexpr int kBits = 26;  // half the digits of a double: what a minimum can be told by
  std::uintmax_t most = 64;
  const double t = boost::math::tools::brent_find_minima(
                       [&](double x) {
                         const double d = distance(x);
                         return d * d;
                       },
                       0.0, 1.0, kBits, most)
                       .first;
  return at(t);
}

DeviationMeter::Deviation DeviationMeter::of(const Vertex& from, const Vertex& to, const Target& a,
                                             const Target& b, const ProgramState& program,
                                             const Deviation& uninteresting) const {
  if (!certify_) {
    if (surely_within(from, to, a, b, program, uninteresting)) {
      return {{0.0, uninteresting.tip_mm.upper}, {0.0, uninteresting.axis_rad.upper}};
    }
    return sampled(from, to, a, b, program);
  }
  const path::Reference reference{a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  return {tip_interval(from, to, reference, uninteresting.tip_mm.upper),
          axis_interval(from, to, reference, uninteresting.axis_rad.upper)};
}

DeviationMeter::Interval DeviationMeter::tip_interval(const Vertex& from, const Vertex& to,
                                                      const path::Reference& reference,
                                                      double uninteresting_mm) const {
  using path::Within;
  if (from.tcp && to.tcp) {
    // A straight line: the distance from a segment is convex, so it is largest at an end.
    const double largest = std::max(distance_to_segment(from.tip_P, reference.tip0_P, reference.tip1_P),
                                    distance_to_segment(to.tip_P, reference.tip0_P, reference.tip1_P));
    return {largest, largest};
  }
  const auto within = [&](double limit_mm) {
    return limit_mm > 0.0 &&
           certifier_.tip_within(from.station, to.station, reference, limit_mm) == Within::yes;
  };
  if (within(uninteresting_mm)) return {0.0, uninteresting_mm};
  const path::Bound bound = certifier_.tip(from.station, to.station, reference);
  // A proved bound is a little above the truth; where it straddles the tolerance the question is decided.
  const bool straddles = bound.lower <= tolerance_mm_ && bound.upper > tolerance_mm_;
  return {bound.lower, straddles && within(tolerance_mm_) ? tolerance_mm_ : bound.upper};
}

DeviationMeter::Interval DeviationMeter::axis_interval(const Vertex& from, const Vertex& to,
                                                       const path::Reference& reference,
                                                       double uninteresting_rad) const {
  const auto within = [&](double limit_rad) {
    return limit_rad > 0.0 && certifier_.axis_within(from.station, to.station, reference,
                                                     Angle::radians(limit_rad)) == path::Within::yes;
  };
  if (within(uninteresting_rad)) return {0.0, uninteresting_rad};
  const path::Bound bound = certifier_.axis(from.station, to.station, reference);
  const double tolerance = axis_tolerance_.rad();
  const bool straddles = bound.lower <= tolerance && bound.upper > tolerance;
  return {bound.lower, straddles && within(tolerance) ? tolerance : bound.upper};
}

// Lost motion that is taken up counts at its end only.
bool DeviationMeter::take_up(const Vertex& from, const Vertex& to, const ProgramState& program) const {
  return truth_ != nullptr && is_take_up(machine_, from.q, to.q) &&
         program.towards(to.q, to.q).direction != program.now().direction;
}

// Truth p(t) = n(t) + e(t), n on the nominal machine. With the errors e linear between the ends, p would
// leave its chord as n leaves its own, by at most the bow; what is left is how far e is from its chord.
bool DeviationMeter::surely_within(const Vertex& from, const Vertex& to, const Target& a, const Target& b,
                                   const ProgramState& program, const Deviation& limit) const {
  if (truth_ == nullptr || offsets_ != nullptr || (from.tcp && to.tcp)) return false;
  if (!(limit.tip_mm.upper > 0.0) || !(limit.axis_rad.upper > 0.0)) return false;
  const MachineState half_way = program.towards(to.q, JointVector::interpolate(from.q, to.q, 0.5));
  constexpr double kSameTime_s = 1.0;  // temperatures do not change in it
  if (half_way.direction != program.now().direction || half_way.time_s - from.time_s > kSameTime_s)
    return false;
  const double ends_mm = std::max(distance_to_segment(from.tip_P, a.tip_P, b.tip_P),
                                  distance_to_segment(to.tip_P, a.tip_P, b.tip_P));
  const double bow_mm = certifier_.bow_from_norms(from.station, to.station);
  if (ends_mm + bow_mm > limit.tip_mm.upper) return false;
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn += std::abs(kinematics().angle(to.q, k) - kinematics().angle(from.q, k));
  // sin x >= 2x/pi up to a right angle.
  const double axis_bow = 0.5 * kPi * turn * turn / 8.0;
  const double ends_rad =
      std::max(angle_to_arc(from.axis_P, a.axis_P, b.axis_P), angle_to_arc(to.axis_P, a.axis_P, b.axis_P));
  if (ends_rad + axis_bow > limit.axis_rad.upper) return false;
  const ToolPose real = pose_with_errors(half_way);
  const ToolPose nominal = kinematics().pose(half_way.q);
  const auto bend = [](const Vec3& middle, const Vec3& e0, const Vec3& e1) {
    constexpr double kElsewhere = 2.0;  // where a table has its kink
    return kElsewhere * (middle - 0.5 * (e0 + e1)).norm();
  };
  const double tip_bend =
      bend(real.tip_P - nominal.tip_P, from.tip_P - from.station.tip_P, to.tip_P - to.station.tip_P);
  const double axis_bend =
      bend(real.axis_P - nominal.axis_P, from.axis_P - from.station.axis_P, to.axis_P - to.station.axis_P);
  return ends_mm + bow_mm + tip_bend <= limit.tip_mm.upper &&
         ends_rad + axis_bow + 0.5 * kPi * axis_bend <= limit.axis_rad.upper;
}

DeviationMeter::Deviation DeviationMeter::sampled(const Vertex& from, const Vertex& to, const Target& a,
                                                  const Target& b, const ProgramState& program) const {
  double tip = 0.0;
  double axis = 0.0;
  for (int i = take_up(from, to, program) ? kSamples : 0; i <= kSamples; ++i) {
    const JointVector q = between(from, to, static_cast<double>(i) / kSamples);
    const ToolPose pose = this->pose(program.towards(to.q, q));
    tip = std::max(tip, distance_to_segment(pose.tip_P, a.tip_P, b.tip_P));
    axis = std::max(axis, angle_to_arc(pose.axis_P, a.axis_P, b.axis_P));
  }
  return {{tip, tip}, {axis, axis}};
}

}  // namespace trunnion::post
