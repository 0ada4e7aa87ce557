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

  // Over the motion, from a point.
  double largest_from(const Vec3& point) const { return larger_norm(at0 - point, at1 - point) + bend / 8.0; }
  void move(const Vec3& direction, double from, double to) {
    at0 += from * direction;
    at1 += to * direction;
    slope += std::abs(to - from);
  }
  // About an axis through `point`.
  void turn_back(const Turn& turn, const Vec3& point) {
    const double arm = largest_from(point);
    bend += turn.by * (2.0 * slope + turn.by * arm);
    slope += turn.by * arm;
    at0 = point + turn.back(at0 - point, turn.sin0, turn.cos0);
    at1 = point + turn.back(at1 - point, turn.sin1, turn.cos1);
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

  // P: the largest that `x` is, from where the twist acts.
  void link(double P, const Carried& x, const TwistSize& e, const TwistBend& rest, bool is_point) {
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
    : model_(model),
      tool_mm_(tool_mm),
      part_zero_mm_(machine.part_zero_mm),
      range_(model.range(machine.axes)),
      constant_mm_(tool_mm.norm() + machine.part_zero_mm.norm()) {
  const auto joint = [&](AxisId id) {
    const Axis& axis = machine.axes[id];
    // Turned about a point, a vector grows by twice its distance at most.
    constant_mm_ += 2.0 * axis.point_mm.norm();
    return Joint{id,
                 axis.kind == AxisKind::rotary,
                 AxisTurn(axis.direction),
                 axis.point_mm,
                 axis.min,
                 axis.max,
                 range_ ? range_->per_unit[id] : TwistBend{}};
  };
  tool_chain_.reserve(machine.tool_chain.size());
  part_chain_.reserve(machine.part_chain.size());
  for (auto id = machine.tool_chain.rbegin(); id != machine.tool_chain.rend(); ++id)
    tool_chain_.push_back(joint(*id));
  for (const AxisId id : machine.part_chain) part_chain_.push_back(joint(id));
  for (const auto* chain : {&tool_chain_, &part_chain_}) {
    for (const Joint& j : *chain)
      (j.rotary ? rotary_shares_ : linear_shares_).push_back({j.id, j.per_unit, j.min, j.max});
  }
  find_change_per_mm();
}

ErrorCourse::Bend ErrorCourse::over(const MachineState& from, const MachineState& to,
                                    std::span<const double> lagged) const {
  RotarySines sines0;
  RotarySines sines1;
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) continue;
    sines0.sin[k] = std::sin(from.q[joint.id]);
    sines0.cos[k] = std::cos(from.q[joint.id]);
    sines1.sin[k] = std::sin(to.q[joint.id]);
    sines1.cos[k++] = std::cos(to.q[joint.id]);
  }
  const ChainErrors errors0 = model_.errors(from, lagged);
  const ChainErrors errors1 = model_.errors(to, lagged);
  return over({from, sines0, errors0}, {to, sines1, errors1});
}

// The sums of `over` with all links alike: the tip S from each of them at most, the twists as large and as
// steep as they are anywhere. What turns before a link (b, its vector's slope way + b S and bend 2 b way +
// b^2 S) and what turns behind it (w) are together the motion's turn: w^2 S + 2 w (way + b S) + 2 b way + b^2
// S = (w + b)^2 S + 2 (w + b) way. What a twist of slope h leaves of a straight course over a motion d is at
// most h d / 2.
template <class T>
std::optional<std::array<T, 2>> ErrorCourse::largest(const std::array<T, kMaxAxes>& q0,
                                                     const std::array<T, kMaxAxes>& q1) const {
  if (!range_) return std::nullopt;
  T S = lanes::splat<T>(constant_mm_);
  T way{};   // of the linear axes
  T turn{};  // of the rotary ones
  T th1{};
  T T1{};
  auto beyond = T{} > 0.0;
  const auto change = [&](const Share& axis, const T& a, const T& b) {
    const T low = lanes::select(a < b, a, b);
    const T high = lanes::select(a < b, b, a);
    beyond |= (low < axis.min) | (high > axis.max);
    const T d = high - low;
    th1 += axis.per_unit.rot_rad * d;
    T1 += axis.per_unit.trans_mm * d;
    return d;
  };
  for (const Share& axis : linear_shares_) {
    const T a = q0[axis.id];
    const T b = q1[axis.id];
    way += change(axis, a, b);
    S += lanes::larger<T>(lanes::abs(a), lanes::abs(b));
  }
  for (const Share& axis : rotary_shares_) turn += change(axis, q0[axis.id], q1[axis.id]);
  const double th = range_->largest.rot_rad;
  const double largest_mm = range_->largest.trans_mm;
  const T W = turn + th1;
  // The vector that is carried, moved by the errors and the rests of the links before, is no longer than
  // twice the nominal one: else the rests would be more than is taken here.
  if (lanes::any(beyond) || lanes::any(th * S + 2.0 * largest_mm + th1 * S + T1 > S) ||
      lanes::any(th + th1 > 1.0))
    return std::nullopt;
  const auto bound = [&](const T& arm, const T& linear, double t, const T& t1) {
    const T second = W * (W * (th * arm + t) + 2.0 * (th1 * (arm + t) + t1 + th * linear)) +
                     th1 * (th1 * (arm + t) + t1 + 2.0 * (linear + turn * arm));
    return T(second / 8.0 + 0.5 * (th1 * 2.0 * arm + t1));
  };
  return std::array<T, 2>{bound(S, way, largest_mm, T1), bound(lanes::splat<T>(1.0), T{}, 0.0, T{})};
}

std::optional<ErrorCourse::Bend> ErrorCourse::at_most(const JointVector& q0, const JointVector& q1) const {
  std::array<double, kMaxAxes> from{};
  std::array<double, kMaxAxes> to{};
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    from[id] = q0[id];
    to[id] = q1[id];
  }
  const auto bounds = largest(from, to);
  return bounds ? std::optional(Bend{(*bounds)[0], (*bounds)[1], nullptr}) : std::nullopt;
}

bool ErrorCourse::at_most(const Columns& q, std::size_t motions, double* tip_mm, double* axis_rad) const {
  bool known = true;
  lanes::at_a_time(way_, [&]<class T>() {
    std::array<T, kMaxAxes> from;
    std::array<T, kMaxAxes> to;
    for (std::size_t row = 0; row < motions && known; row += lanes::kCount<T>) {
      for (AxisId id = 0; id < kMaxAxes; ++id) {
        from[id] = lanes::load<T>(q[id] + row);
        to[id] = lanes::load<T>(q[id] + row + 1);
      }
      const auto bounds = largest<T>(from, to);
      known = bounds.has_value();
      if (!known) continue;
      lanes::store(tip_mm + row, (*bounds)[0]);
      lanes::store(axis_rad + row, (*bounds)[1]);
    }
  });
  return known;
}

// A twist of the rates h and t over a motion d moves a vector of length p, itself moved by the errors before
// it, by (h (p + T) + t) d at most: the differential of exp is no longer than its argument's. The motion
// itself goes on through the links behind it, whose rotations turn it by th d.
void ErrorCourse::find_change_per_mm() {
  if (!range_) return;
  double S = constant_mm_;
  for (const Share& axis : linear_shares_) S += std::max(std::abs(axis.min), std::abs(axis.max));
  const double th = range_->largest.rot_rad;
  const double T = range_->largest.trans_mm;
  // As above: then the vector that is carried is no longer than twice the nominal one. No travel, no bound.
  knows_change_ = th * S + 2.0 * T <= S && th <= 1.0 && std::isfinite(S);
  for (Share& axis : linear_shares_)
    axis.change_per_mm = axis.per_unit.rot_rad * (2.0 * S + T) + axis.per_unit.trans_mm + th;
}

ErrorCourse::Bend ErrorCourse::over(const End& from, const End& to) const {
  const ChainBends bends = model_.bends(from.state, to.state);
  if (bends.unbounded != nullptr) return {0.0, 0.0, bends.unbounded};
  const JointVector& q0 = from.state.q;
  const JointVector& q1 = to.state.q;
  Carried tip{tool_mm_, tool_mm_};
  Carried axis{Vec3::UnitZ(), Vec3::UnitZ()};
  Sum tips;
  Sum axes;
  // Twists act at `point`. In the part's chain they act backwards, which changes no size.
  const auto link = [&](const Twist& a, const Twist& b, const TwistBend& rest, const Vec3& point) {
    if (a.is_zero() && b.is_zero() && rest.is_zero()) return;
    const TwistSize size(a, b);
    tips.link(tip.largest_from(point), tip, size, rest, true);
    if (size.th > 0.0 || rest.rot_rad > 0.0)
      axes.link(axis.largest_from(Vec3::Zero()), axis, size, rest, false);
  };
  const auto link_of = [&](const Joint& joint) {
    link(from.errors.joint[joint.id], to.errors.joint[joint.id], bends.joint[joint.id], joint.point_mm);
  };
  link(from.errors.spindle, to.errors.spindle, bends.spindle, Vec3::Zero());
  for (const Joint& joint : tool_chain_) {
    link_of(joint);
    tip.move(joint.turn.direction(), q0[joint.id], q1[joint.id]);
  }
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) {
      tip.move(joint.turn.direction(), -q0[joint.id], -q1[joint.id]);
      link_of(joint);
      continue;
    }
    link_of(joint);
    const Turn turn{joint.turn,        std::abs(q1[joint.id] - q0[joint.id]),
                    from.sines.sin[k], from.sines.cos[k],
                    to.sines.sin[k],   to.sines.cos[k]};
    ++k;
    tip.turn_back(turn, joint.point_mm);
    axis.turn_back(turn, Vec3::Zero());
    tips.turn(turn.by);
    axes.turn(turn.by);
  }
  link(from.errors.part, to.errors.part, bends.part, part_zero_mm_);
  return {tips.bound(), axes.bound(), nullptr};
}

}  // namespace trunnion::path
