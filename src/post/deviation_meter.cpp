#include "post/deviation_meter.hpp"

#include <array>

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

ToolPose DeviationMeter::pose(const MachineState& state) const {
  ToolPose pose;
  if (truth_ == nullptr) {
    pose = kinematics().pose(state.q);
  } else {
    pose = tool_pose(forward(machine_, state.q, tool_mm_, truth_->errors(state)));
    pose.tip_P -= datum_P_;
  }
  if (offsets_ != nullptr) pose.tip_P += offsets_->deviation_P(part_in_machine(machine_, state.q).R);
  return pose;
}

void DeviationMeter::place(Vertex& vertex, const MachineState& state) const {
  vertex.q = state.q;
  if (certify_) {
    vertex.station = path::station(kinematics(), state.q);
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
  // Golden section: on a nearly straight piece the distance has one minimum.
  constexpr double kGolden = 0.6180339887498949;
  double a = 0.0;
  double b = 1.0;
  double u = b - kGolden * (b - a);
  double w = a + kGolden * (b - a);
  double du = distance(u);
  double dw = distance(w);
  while (b - a > 1e-9) {
    if (du < dw) {
      b = w;
      w = u;
      dw = du;
      u = b - kGolden * (b - a);
      du = distance(u);
    } else {
      a = u;
      u = w;
      du = dw;
      w = a + kGolden * (b - a);
      dw = distance(w);
    }
  }
  return at(0.5 * (a + b));
}

DeviationMeter::Deviation DeviationMeter::of(const Vertex& from, const Vertex& to, const Target& a,
                                             const Target& b, const ProgramState& program,
                                             const Deviation& uninteresting) const {
  if (!certify_) return sampled(from, to, a, b, program);
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

DeviationMeter::Deviation DeviationMeter::sampled(const Vertex& from, const Vertex& to, const Target& a,
                                                  const Target& b, const ProgramState& program) const {
  double tip = 0.0;
  double axis = 0.0;
  // Lost motion that is taken up counts at its end only.
  const bool take_up = truth_ != nullptr && is_take_up(machine_, from.q, to.q) &&
                       program.towards(to.q, to.q).direction != program.now().direction;
  for (int i = take_up ? kSamples : 0; i <= kSamples; ++i) {
    const JointVector q = between(from, to, static_cast<double>(i) / kSamples);
    const ToolPose pose = this->pose(program.towards(to.q, q));
    tip = std::max(tip, distance_to_segment(pose.tip_P, a.tip_P, b.tip_P));
    axis = std::max(axis, angle_to_arc(pose.axis_P, a.axis_P, b.axis_P));
  }
  return {{tip, tip}, {axis, axis}};
}

}  // namespace trunnion::post
