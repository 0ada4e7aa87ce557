#include "trunnion/path/error_course.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/machine/axis_turn.hpp"

namespace trunnion::path {
namespace {

// What a rotary axis does over the motion.
struct Turn {
  Turn(const Vec3& direction, double from, double to)
      : axis(direction),
        by(std::abs(to - from)),
        sin0(std::sin(from)),
        cos0(std::cos(from)),
        sin1(std::sin(to)),
        cos1(std::cos(to)) {}
  Vec3 back(const Vec3& v, double sin, double cos) const { return axis.turned(v, -sin, cos); }
  AxisTurn axis;
  double by;
  double sin0, cos0, sin1, cos1;
};

// A nominal vector that the chain carries: its values at the ends of the motion, and bounds on its first and
// second derivative over it.
struct Carried {
  Vec3 at0, at1;
  double slope = 0.0;
  double bend = 0.0;

  double largest() const { return std::max(at0.norm(), at1.norm()) + bend / 8.0; }
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

// Sums over the links, from the tool to the part. Every link adds A (E - 1) B: B the nominal vector before
// it, A what follows, with errors (a telescoping sum), so that its second derivative is at most W^2 |.| + 2 W
// |.'| + |.''|, W the rate of all rotations that follow.
class Sum {
 public:
  void turn(double g) { rate_ += g; }

  void link(const Carried& x, const Twist& e0, const Twist& e1, const TwistBend& rest, bool is_point) {
    if (e0.is_zero() && e1.is_zero() && rest.is_zero()) return;
    const double P = x.largest();
    const double th = std::max(e0.rot_rad.norm(), e1.rot_rad.norm());
    const double th1 = (e1.rot_rad - e0.rot_rad).norm();
    const double T = is_point ? std::max(e0.trans_mm.norm(), e1.trans_mm.norm()) : 0.0;
    const double T1 = is_point ? (e1.trans_mm - e0.trans_mm).norm() : 0.0;
    Term& t = terms_[count_++];
    t.value = th * P + T;
    t.slope = th1 * (P + T) + T1 + th * x.slope;
    t.bend = th1 * (th1 * (P + T) + T1) + 2.0 * th1 * x.slope + th * x.bend;
    t.rate_before = rate_ + th1;
    rate_ += th1;
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
    double value = 0.0, slope = 0.0, bend = 0.0;
    double rate_before = 0.0;  // of the rotations up to this link
  };
  std::array<Term, kMaxAxes + 2> terms_{};
  std::size_t count_ = 0;
  double rate_ = 0.0;
  double rest_ = 0.0;   // from what the twists themselves leave of a straight course
  double moved_ = 0.0;  // by the errors so far
};

Twist opposite(const Twist& t) {
  return t * -1.0;
}

}  // namespace

ErrorCourse::Bend ErrorCourse::over(const MachineState& from, const MachineState& to,
                                    std::span<const double> lagged) const {
  const ChainBends bends = model_.bends(from, to);
  if (bends.unbounded != nullptr) return {0.0, 0.0, bends.unbounded};
  const ChainErrors e0 = model_.errors(from, lagged);
  const ChainErrors e1 = model_.errors(to, lagged);
  Carried tip{tool_mm_, tool_mm_};
  Carried axis{Vec3::UnitZ(), Vec3::UnitZ()};
  Sum tips;
  Sum axes;
  const auto link = [&](const Twist& a, const Twist& b, const TwistBend& rest) {
    tips.link(tip, a, b, rest, true);
    axes.link(axis, a, b, rest, false);
  };
  link(e0.spindle, e1.spindle, bends.spindle);
  for (auto id = machine_.tool_chain.rbegin(); id != machine_.tool_chain.rend(); ++id) {
    const Axis& joint = machine_.axes[*id];
    tip.shift(-joint.point_mm);
    link(e0.joint[*id], e1.joint[*id], bends.joint[*id]);
    tip.shift(joint.point_mm);
    tip.move(joint.direction, from.q[*id], to.q[*id]);
  }
  for (const AxisId id : machine_.part_chain) {
    const Axis& joint = machine_.axes[id];
    const bool rotary = joint.kind == AxisKind::rotary;
    if (!rotary) tip.move(joint.direction, -from.q[id], -to.q[id]);
    tip.shift(-joint.point_mm);
    link(opposite(e0.joint[id]), opposite(e1.joint[id]), bends.joint[id]);
    if (rotary) {
      const Turn turn(joint.direction, from.q[id], to.q[id]);
      tip.turn_back(turn);
      axis.turn_back(turn);
      tips.turn(turn.by);
      axes.turn(turn.by);
    }
    tip.shift(joint.point_mm);
  }
  tip.shift(-machine_.part_zero_mm);
  link(opposite(e0.part), opposite(e1.part), bends.part);
  return {tips.bound(), axes.bound(), nullptr};
}

}  // namespace trunnion::path
