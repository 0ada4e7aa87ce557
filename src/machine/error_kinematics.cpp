#include "trunnion/machine/error_kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

lanes::Triple<double> triple(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
// Of a vector by which only the point goes on.
lanes::Triple<Lanes> of_point(const Vec3& v) {
  return {Lanes{v.x(), 0.0}, Lanes{v.y(), 0.0}, Lanes{v.z(), 0.0}};
}
Vec3 lane(const lanes::Triple<Lanes>& at, int i) {
  return {at.x[i], at.y[i], at.z[i]};
}

bool turns_nothing(const Vec3& rot_rad) {
  return rot_rad.x() == 0.0 && rot_rad.y() == 0.0 && rot_rad.z() == 0.0;
}

// exp(twist) v = v + t + K (a v + b t + K (b v + c t)), K u = w x u.
template <class T>
struct Series {
  explicit Series(const lanes::Triple<T>& rot_rad) : w(rot_rad), x2(lanes::squared(w)) {
    a = 1.0 - x2 * (1.0 / 6.0) * (1.0 - x2 * (1.0 / 20.0));
    b = 0.5 - x2 * (1.0 / 24.0) * (1.0 - x2 * (1.0 / 30.0));
    c = 1.0 / 6.0 - x2 * (1.0 / 120.0);
  }
  // The series of `exp` (geom) below this angle; errors of machines are far below it.
  bool is_near() const {
    constexpr double kSeries = 1e-2;
    return !lanes::any(x2 >= kSeries * kSeries);
  }
  template <class V>
  [[gnu::always_inline]] V displaced(const V& at, const V& t) const {
    const V inner = lanes::cross(w, b * at + c * t);
    return at + (t + lanes::cross(w, a * at + b * t + inner));
  }
  template <class V>
  [[gnu::always_inline]] V turned(const V& u) const {
    const V inner = lanes::cross(w, b * u);
    return u + lanes::cross(w, a * u + inner);
  }

  lanes::Triple<T> w;
  T x2, a, b, c;
};

}  // namespace

// The tool at one position: its point and its direction side by side, in this order.
struct ErrorKinematics::OneTool {
  const JointVector& q;
  const RotarySines& sines;
  const ChainErrors& errors;
  lanes::Triple<Lanes> at;

  [[gnu::always_inline]] void move(const Vec3& v) { at = at + of_point(v); }
  [[gnu::always_inline]] void advance(const Joint& joint, double sign) {
    move(sign * q[joint.id] * joint.turn.direction());
  }
  [[gnu::always_inline]] void turn_back(const AxisTurn& axis, std::size_t k) {
    at = axis.turned(at, lanes::splat<Lanes>(-sines.sin[k]), lanes::splat<Lanes>(sines.cos[k]));
  }
  [[gnu::always_inline]] void apply(const Held& held) {
    if (held.turns) at = held.turned(at);
    move(held.shift_mm);
  }
  // exp(sign * twist) applied to both; the sign is -1 on the way back through a joint, whose inverse it is.
  template <class TwistOf>
  [[gnu::always_inline]] void displace(const TwistOf& twist_of, double sign) {
    const Twist& twist = twist_of(errors);
    const lanes::Triple<Lanes> t = of_point(sign * twist.trans_mm);
    // Most errors do not turn anything.
    if (turns_nothing(twist.rot_rad)) {
      at = at + t;
      return;
    }
    const Series<double> series(sign * triple(twist.rot_rad));
    if (series.is_near()) {
      at = series.displaced(at, t);
      return;
    }
    const Pose X = exp(twist * sign);
    const Vec3 p = X * lane(at, 0);
    const Vec3 u = X.R * lane(at, 1);
    at = {Lanes{p.x(), u.x()}, Lanes{p.y(), u.y()}, Lanes{p.z(), u.z()}};
  }
};

// The tool at two positions side by side.
struct ErrorKinematics::TwoTools {
  const std::array<JointVector, 2>& q;
  const TableKinematics::SinesOf<Lanes>& sines;
  const std::array<ChainErrors, 2>& errors;
  lanes::Triple<Lanes> tip, axis;
  bool near = true;  // the series did for all errors

  [[gnu::always_inline]] void move(const Vec3& v) { tip = tip + triple(v); }
  [[gnu::always_inline]] void advance(const Joint& joint, double sign) {
    const Lanes by = sign * Lanes{q[0][joint.id], q[1][joint.id]};
    tip = tip + by * triple(joint.turn.direction());
  }
  [[gnu::always_inline]] void turn_back(const AxisTurn& turn, std::size_t k) {
    const Lanes sin = -sines.sin[k];
    tip = turn.turned(tip, sin, sines.cos[k]);
    axis = turn.turned(axis, sin, sines.cos[k]);
  }
  [[gnu::always_inline]] void apply(const Held& held) {
    if (held.turns) {
      tip = held.turned(tip);
      axis = held.turned(axis);
    }
    move(held.shift_mm);
  }
  template <class TwistOf>
  [[gnu::always_inline]] void displace(const TwistOf& twist_of, double sign) {
    const Twist& a = twist_of(errors[0]);
    const Twist& b = twist_of(errors[1]);
    const auto both = [sign](const Vec3& u, const Vec3& v) { return sign * lanes::side_by_side(u, v); };
    const auto t = both(a.trans_mm, b.trans_mm);
    if (turns_nothing(a.rot_rad) && turns_nothing(b.rot_rad)) {
      tip = tip + t;
      return;
    }
    const Series<Lanes> series(both(a.rot_rad, b.rot_rad));
    tip = series.displaced(tip, t);
    axis = series.turned(axis);
    near = near && series.is_near();
  }
};

// The joint poses of `forward` (kinematics.cpp): Trans(q e) Trans(o) Exp(xi) Trans(-o) for a linear axis,
// Trans(a) Exp(xi) Rot(n, q) Trans(-a) for a rotary one; the part's chain is undone from the bed outwards.
template <class Tool>
[[gnu::flatten]] void ErrorKinematics::carry(Tool& tool) const {
  const auto pass = [&](const Held& held, const Vec3& point_mm, double sign, const auto& twist_of) {
    if (held.known) {
      tool.apply(held);
      return;
    }
    if (!point_mm.isZero(0.0)) tool.move(-point_mm);
    tool.displace(twist_of, sign);
  };
  const auto of_joint = [](AxisId id) {
    return [id](const ChainErrors& e) -> const Twist& { return e.joint[id]; };
  };
  pass(spindle_, Vec3::Zero(), 1.0, [](const ChainErrors& e) -> const Twist& { return e.spindle; });
  for (const Joint& joint : tool_chain_) {
    pass(joint.held, joint.point_mm, 1.0, of_joint(joint.id));
    if (joint.has_point) tool.move(joint.point_mm);
    tool.advance(joint, 1.0);
  }
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) tool.advance(joint, -1.0);
    pass(joint.held, joint.point_mm, -1.0, of_joint(joint.id));
    if (joint.rotary) tool.turn_back(joint.turn, k++);
    if (joint.has_point) tool.move(joint.point_mm);
  }
  pass(part_, part_zero_mm_, -1.0, [](const ChainErrors& e) -> const Twist& { return e.part; });
}

ErrorKinematics::Held::Held(const Twist& twist, double sign, const Vec3& point_mm) : known(true) {
  const Pose X = exp(twist * sign);
  turns = !turns_nothing(twist.rot_rad);
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j)
      rotation[static_cast<std::size_t>(3 * i + j)] = lanes::splat<Lanes>(X.R(i, j));
  }
  shift_mm = X.p - (turns ? Vec3(X.R * point_mm) : point_mm);
}

void ErrorKinematics::hold(const ChainErrors& constant, const ChainLinks& varying) {
  if (!varying.spindle) spindle_ = Held(constant.spindle, 1.0, Vec3::Zero());
  if (!varying.part) part_ = Held(constant.part, -1.0, part_zero_mm_);
  for (auto* chain : {&tool_chain_, &part_chain_}) {
    const double sign = chain == &tool_chain_ ? 1.0 : -1.0;
    for (Joint& joint : *chain) {
      if (!varying.joint[joint.id]) joint.held = Held(constant.joint[joint.id], sign, joint.point_mm);
    }
  }
}

std::vector<ErrorKinematics::Joint> ErrorKinematics::joints_of(const Machine& machine,
                                                               const std::vector<AxisId>& chain) {
  std::vector<Joint> out;
  out.reserve(chain.size());
  for (const AxisId id : chain) {
    const Axis& axis = machine.axes[id];
    out.push_back({id,
                   axis.kind == AxisKind::rotary,
                   AxisTurn(axis.direction),
                   axis.point_mm,
                   !axis.point_mm.isZero(0.0),
                   {}});
  }
  return out;
}

ErrorKinematics::ErrorKinematics(const Machine& machine, const Vec3& tool_mm)
    : tool_chain_(joints_of(machine, machine.tool_chain)),
      part_chain_(joints_of(machine, machine.part_chain)),
      tool_mm_(tool_mm),
      part_zero_mm_(machine.part_zero_mm) {
  std::reverse(tool_chain_.begin(), tool_chain_.end());
  for (const Joint& joint : tool_chain_) TRUNNION_EXPECTS(!joint.rotary);
}

ToolPose ErrorKinematics::pose(const JointVector& q, const ChainErrors& errors) const {
  RotarySines sines;
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) continue;
    sines.sin[k] = std::sin(q[joint.id]);
    sines.cos[k++] = std::cos(q[joint.id]);
  }
  return pose(q, sines, errors);
}

ToolPose ErrorKinematics::pose(const JointVector& q, const RotarySines& sines,
                               const ChainErrors& errors) const {
  OneTool tool{
      q, sines, errors, {Lanes{tool_mm_.x(), 0.0}, Lanes{tool_mm_.y(), 0.0}, Lanes{tool_mm_.z(), 1.0}}};
  carry(tool);
  return {lane(tool.at, 0), lane(tool.at, 1)};
}

std::array<ToolPose, 2> ErrorKinematics::pose_pair(const std::array<JointVector, 2>& q,
                                                   const TableKinematics::SinesOf<Lanes>& sines,
                                                   const std::array<ChainErrors, 2>& errors) const {
  const auto splat = [](double x) { return lanes::splat<Lanes>(x); };
  TwoTools tools{q,
                 sines,
                 errors,
                 {splat(tool_mm_.x()), splat(tool_mm_.y()), splat(tool_mm_.z())},
                 {splat(0.0), splat(0.0), splat(1.0)}};
  carry(tools);
  const auto one = [&](std::size_t i) {
    const int at = static_cast<int>(i);
    if (tools.near) return ToolPose{lane(tools.tip, at), lane(tools.axis, at)};
    return pose(q[i], {{sines.sin[0][at], sines.sin[1][at]}, {sines.cos[0][at], sines.cos[1][at]}},
                errors[i]);
  };
  return {one(0), one(1)};
}

}  // namespace trunnion
