#include "trunnion/path/error_course.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {
namespace {

// What a rotary axis does over the motion.
struct Turn {
  const AxisTurn& axis;
  double by;
  double sin0, cos0, sin1, cos1;
  Vec3 back(const Vec3& v, double sin, double cos) const { return axis.turned(v, -sin, cos); }
};

double larger_norm(const Vec3& a, const Vec3& b) {
  return std::sqrt(std::max(a.squaredNorm(), b.squaredNorm()));
}

// A nominal vector that the chain carries: its values at the ends of the motion, and bounds on its first and
// second derivative over it.
struct Carried {
  Vec3 at0, at1;
  double slope = 0.0;
  double bend = 0.0;

  double largest() const { return larger_norm(at0, at1) + bend / 8.0; }
  void shift(const Vec3& by) {
    at0 += by;
    at1 += by;
  }
  void move(const Vec3& direction, double from, double to) {
    at0 += from * direction;
    at1 += to * direction;
    slope += std::abs(to - from);
  }
  void turn_back(const Turn& turn) {
    const double arm = largest();
    bend += turn.by * (2.0 * slope + turn.by * arm);
    slope += turn.by * arm;
    at0 = turn.back(at0, turn.sin0, turn.cos0);
    at1 = turn.back(at1, turn.sin1, turn.cos1);
  }
};

// How large the twist of a link is over the motion, and how far it goes: of the rotation and the translation.
struct TwistSize {
  TwistSize(const Twist& e0, const Twist& e1)
      : th(larger_norm(e0.rot_rad, e1.rot_rad)),
        th1((e1.rot_rad - e0.rot_rad).norm()),
        T(larger_norm(e0.trans_mm, e1.trans_mm)),
        T1((e1.trans_mm - e0.trans_mm).norm()) {}
  double th, th1, T, T1;
};

// Sums over the links, from the tool to the part. Every link adds A (E - 1) B: B the nominal vector before
// it, A what follows, with errors (a telescoping sum), so that its second derivative is at most W^2 |.| + 2 W
// |.'| + |.''|, W the rate of all rotations that follow.
class Sum {
 public:
  void turn(double g) { rate_ += g; }

  void link(const Carried& x, const TwistSize& e, const TwistBend& rest, bool is_point) {
    const double P = x.largest();
    const double T = is_point ? e.T : 0.0;
    const double T1 = is_point ? e.T1 : 0.0;
    Term& t = terms_[count_++];
    t.value = e.th * P + T;
    t.slope = e.th1 * (P + T) + T1 + e.th * x.slope;
    t.bend = e.th1 * (e.th1 * (P + T) + T1) + 2.0 * e.th1 * x.slope + e.th * x.bend;
    t.rate_before = rate_ + e.th1;
    rate_ += e.th1;
    const double rest_mm = is_point ? rest.trans_mm : 0.0;
    const double unknown = rest.rot_rad * (P + moved_ + T + rest_mm) + rest_mm;
    rest_ += unknown;
    moved_ += t.value + unknown;
  }

  // Largest distance from the straight course.
  double bound() const {
    double second = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Term& t = terms_[i];
      const double W = rate_ - t.rate_before;
      second += W * (W * t.value + 2.0 * t.slope) + t.bend;
    }
    return second / 8.0 + rest_;
  }

 private:
  struct Term {
    double value, slope, bend;
    double rate_before;  // of the rotations up to this link
  };
  std::array<Term, kMaxAxes + 2> terms_;
  std::size_t count_ = 0;
  double rate_ = 0.0;
  double rest_ = 0.0;   // from what the twists themselves leave of a straight course
  double moved_ = 0.0;  // by the errors so far
};

}  // namespace

ErrorCourse::ErrorCourse(const Machine& machine, const Vec3& tool_mm, const ModelEvaluator& model)
    : machine_(machine), tool_mm_(tool_mm), model_(model) {
  for (const AxisId id : machine.part_chain) {
    if (machine.axes[id].kind == AxisKind::rotary) turns_.emplace_back(machine.axes[id].direction);
  }
}

ErrorCourse::Bend ErrorCourse::over(const MachineState& from, const MachineState& to,
                                    std::span<const double> lagged) const {
  RotarySines sines0;
  RotarySines sines1;
  std::size_t k = 0;
  for (const AxisId id : machine_.part_chain) {
    if (machine_.axes[id].kind != AxisKind::rotary) continue;
    sines0.sin[k] = std::sin(from.q[id]);
    sines0.cos[k] = std::cos(from.q[id]);
    sines1.sin[k] = std::sin(to.q[id]);
    sines1.cos[k++] = std::cos(to.q[id]);
  }
  const ChainErrors errors0 = model_.errors(from, lagged);
  const ChainErrors errors1 = model_.errors(to, lagged);
  return over({from, sines0, errors0}, {to, sines1, errors1});
}

ErrorCourse::Bend ErrorCourse::over(const End& from, const End& to) const {
  const ChainBends bends = model_.bends(from.state, to.state);
  if (bends.unbounded != nullptr) return {0.0, 0.0, bends.unbounded};
  const JointVector& q0 = from.state.q;
  const JointVector& q1 = to.state.q;
  const ChainErrors& e0 = from.errors;
  const ChainErrors& e1 = to.errors;
  Carried tip{tool_mm_, tool_mm_};
  Carried axis{Vec3::UnitZ(), Vec3::UnitZ()};
  Sum tips;
  Sum axes;
  // In the part's chain the twists act backwards, which changes no size.
  const auto link = [&](const Twist& a, const Twist& b, const TwistBend& rest) {
    if (a.is_zero() && b.is_zero() && rest.is_zero()) return;
    const TwistSize size(a, b);
    tips.link(tip, size, rest, true);
    if (size.th > 0.0 || rest.rot_rad > 0.0) axes.link(axis, size, rest, false);
  };
  link(e0.spindle, e1.spindle, bends.spindle);
  for (auto id = machine_.tool_chain.rbegin(); id != machine_.tool_chain.rend(); ++id) {
    const Axis& joint = machine_.axes[*id];
    tip.shift(-joint.point_mm);
    link(e0.joint[*id], e1.joint[*id], bends.joint[*id]);
    tip.shift(joint.point_mm);
    tip.move(joint.direction, q0[*id], q1[*id]);
  }
  std::size_t k = 0;
  for (const AxisId id : machine_.part_chain) {
    const Axis& joint = machine_.axes[id];
    const bool rotary = joint.kind == AxisKind::rotary;
    if (!rotary) tip.move(joint.direction, -q0[id], -q1[id]);
    tip.shift(-joint.point_mm);
    link(e0.joint[id], e1.joint[id], bends.joint[id]);
    if (rotary) {
      const Turn turn{turns_[k],         std::abs(q1[id] - q0[id]), from.sines.sin[k],
                      from.sines.cos[k], to.sines.sin[k],           to.sines.cos[k]};
      ++k;
      tip.turn_back(turn);
      axis.turn_back(turn);
      tips.turn(turn.by);
      axes.turn(turn.by);
    }
    tip.shift(joint.point_mm);
  }
  tip.shift(-machine_.part_zero_mm);
  link(e0.part, e1.part, bends.part);
  return {tips.bound(), axes.bound(), nullptr};
}

}  // namespace trunnion::path
