#pragma once
#include <array>
#include <vector>

#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/error_columns.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion {

/// `forward` with errors for one machine and tool, prepared for many evaluations: tip and axis of the tool
/// are carried through the chain as two vectors, joint by joint, instead of products of poses. Equal to
/// `tool_pose(forward(machine, q, tool_mm, errors))` within rounding (tests: 1e-10 mm, 1e-13).
class ErrorKinematics {
 public:
  /// @param tool_mm  vector from S to the tip, mm
  ErrorKinematics(const Machine& machine, const Vec3& tool_mm);

  /// Where the tool really is in P at the joint positions `q` (mm, rad) of the chain with `errors`.
  ToolPose pose(const JointVector& q, const ChainErrors& errors) const;
  /// The same where the sines of the rotary positions are known.
  ToolPose pose(const JointVector& q, const RotarySines& sines, const ChainErrors& errors) const;
  /// A few positions side by side, in little more time than one: T is `Lanes` or `Quads`. Equal to `pose`
  /// within rounding. Only errors of links that are not held are looked at.
  template <class T>
  struct PosesOf {
    lanes::Triple<T> tip_P;  // mm
    lanes::Triple<T> axis_P;
    lanes::Mask<T> known;  // else an error turns by too much for this: `pose` has it
  };
  template <class T>
  PosesOf<T> poses(const JointsOf<T>& q, const TableKinematics::SinesOf<T>& sines,
                   const ChainErrorsOf<T>& errors) const;

  /// The tips alone.
  template <class T>
  struct TipsOf {
    lanes::Triple<T> tip_P;  // mm
    lanes::Mask<T> known;    // else an error turns by too much for this: `pose` has it
  };
  template <class T>
  TipsOf<T> tips(const JointsOf<T>& q, const TableKinematics::SinesOf<T>& sines,
                 const ChainErrorsOf<T>& errors) const;

  /// The axes alone: of the errors only what turns is looked at.
  template <class T>
  struct AxesOf {
    lanes::Triple<T> axis_P;
    lanes::Mask<T> known;  // else an error turns by too much for this: `pose` has it
  };
  template <class T>
  AxesOf<T> axes(const TableKinematics::SinesOf<T>& sines, const ChainErrorsOf<T>& errors) const;

  /// From now on the errors of all links but these are taken from here, not from what `pose` is given: what
  /// never changes is worked out once.
  void hold(const ChainErrors& constant, const ChainLinks& varying);

 private:
  /// What a link always does: v -> rotation v + shift, from before its point is left to behind its error.
  struct Held {
    Held() = default;
    /// `point_mm`: where the error acts.
    Held(const Twist& twist, double sign, const Vec3& point_mm);
    template <class V>
    V turned(const V& v) const {
      const auto row = [&](std::size_t i) {
        return rotation[i] * v.x + rotation[i + 1] * v.y + rotation[i + 2] * v.z;
      };
      return {row(0), row(3), row(6)};
    }
    bool known = false;
    bool turns = false;
    bool moves = false;
    std::array<double, 9> rotation{};  // by rows
    lanes::Triple<double> shift_mm{};
  };
  struct Joint {
    AxisId id = 0;
    bool rotary = false;
    AxisTurn turn;  // its direction, for a linear joint too
    Vec3 point_mm = Vec3::Zero();
    bool has_point = false;  // that is not zero
    Held held;
  };
  template <class T>
  struct Series;
  struct OneTool;
  template <class T, bool kWithTip, bool kWithAxis>
  struct ToolsOf;
  template <class Tool>
  void carry(Tool& tool) const;
  static std::vector<Joint> joints_of(const Machine& machine, const std::vector<AxisId>& chain);

  std::vector<Joint> tool_chain_;  // from the tool inwards
  std::vector<Joint> part_chain_;  // from the bed outwards
  Held spindle_, part_;
  Vec3 tool_mm_;
  Vec3 part_zero_mm_;
};

// exp(twist) v = v + t + K (a v + b t + K (b v + c t)), K u = w x u.
template <class T>
struct ErrorKinematics::Series {
  explicit Series(const lanes::Triple<T>& rot_rad) : w(rot_rad), x2(lanes::squared(w)) {
    a = 1.0 - x2 * (1.0 / 6.0) * (1.0 - x2 * (1.0 / 20.0));
    b = 0.5 - x2 * (1.0 / 24.0) * (1.0 - x2 * (1.0 / 30.0));
    c = 1.0 / 6.0 - x2 * (1.0 / 120.0);
  }
  // The series of `exp` (geom) below this angle; errors of machines are far below it.
  auto is_near() const {
    constexpr double kSeries = 1e-2;
    return x2 < kSeries * kSeries;
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

// The tool at a few positions side by side.
template <class T, bool kWithTip, bool kWithAxis>
struct ErrorKinematics::ToolsOf {
  const JointsOf<T>* q;  // none where no tip is carried
  const TableKinematics::SinesOf<T>& sines;
  const ChainErrorsOf<T>& errors;
  lanes::Triple<T> tip, axis;
  lanes::Mask<T> near = ~lanes::Mask<T>{};  // the series did for all errors

  template <class V>
  [[gnu::always_inline]] void move(const V& v) {
    if (kWithTip) tip = tip + v;
  }
  [[gnu::always_inline]] void advance(const Joint& joint, double sign) {
    if (!kWithTip) return;
    const Vec3& n = joint.turn.direction();
    const T by = sign * (*q)[joint.id];
    tip = tip + by * lanes::Triple<double>{n.x(), n.y(), n.z()};
  }
  [[gnu::always_inline]] void turn_back(const AxisTurn& turn, std::size_t k) {
    const T sin = -sines.sin[k];
    if (kWithTip) tip = turn.turned(tip, sin, sines.cos[k]);
    if (kWithAxis) axis = turn.turned(axis, sin, sines.cos[k]);
  }
  [[gnu::always_inline]] void apply(const Held& held) {
    if (held.turns) {
      if (kWithTip) tip = held.turned(tip);
      if (kWithAxis) axis = held.turned(axis);
    }
    if (held.moves) move(held.shift_mm);
  }
  // exp(sign * twist) applied to all; the sign is -1 on the way back through a joint, whose inverse it is.
  template <class TwistAt>
  [[gnu::always_inline]] void displace(const TwistAt& twist_at, double sign) {
    const TwistOf<T>& twist = twist_at(errors);
    const lanes::Triple<T> t = sign * twist.trans_mm;
    // Most errors do not turn anything.
    if (!twist.turns) {
      move(t);
      return;
    }
    const Series<T> series(sign * twist.rot_rad);
    if (kWithTip) tip = series.displaced(tip, t);
    if (kWithAxis) axis = series.turned(axis);
    near &= series.is_near();
  }
};

// The joint poses of `forward` (kinematics.cpp): Trans(q e) Trans(o) Exp(xi) Trans(-o) for a linear axis,
// Trans(a) Exp(xi) Rot(n, q) Trans(-a) for a rotary one; the part's chain is undone from the bed outwards.
template <class Tool>
[[gnu::always_inline]] inline void ErrorKinematics::carry(Tool& tool) const {
  const auto triple = [](const Vec3& v) { return lanes::Triple<double>{v.x(), v.y(), v.z()}; };
  const auto pass = [&](const Held& held, bool has_point, const Vec3& point_mm, double sign,
                        const auto& twist_at) {
    if (held.known) {
      tool.apply(held);
      return;
    }
    if (has_point) tool.move(triple(-point_mm));
    tool.displace(twist_at, sign);
  };
  const auto of_joint = [](AxisId id) {
    return [id](const auto& e) -> const auto& {
      return e.joint[id];
    };
  };
  pass(
      spindle_, false, tool_mm_, 1.0, [](const auto& e) -> const auto& { return e.spindle; });
  for (const Joint& joint : tool_chain_) {
    pass(joint.held, joint.has_point, joint.point_mm, 1.0, of_joint(joint.id));
    if (joint.has_point) tool.move(triple(joint.point_mm));
    tool.advance(joint, 1.0);
  }
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) tool.advance(joint, -1.0);
    pass(joint.held, joint.has_point, joint.point_mm, -1.0, of_joint(joint.id));
    if (joint.rotary) tool.turn_back(joint.turn, k++);
    if (joint.has_point) tool.move(triple(joint.point_mm));
  }
  pass(
      part_, true, part_zero_mm_, -1.0, [](const auto& e) -> const auto& { return e.part; });
}

template <class T>
ErrorKinematics::PosesOf<T> ErrorKinematics::poses(const JointsOf<T>& q,
                                                   const TableKinematics::SinesOf<T>& sines,
                                                   const ChainErrorsOf<T>& errors) const {
  ToolsOf<T, true, true> tools{&q, sines, errors, lanes::splat_vector<T>(tool_mm_),
                               lanes::splat_vector<T>(Vec3::UnitZ())};
  carry(tools);
  return {tools.tip, tools.axis, tools.near};
}

template <class T>
ErrorKinematics::TipsOf<T> ErrorKinematics::tips(const JointsOf<T>& q,
                                                 const TableKinematics::SinesOf<T>& sines,
                                                 const ChainErrorsOf<T>& errors) const {
  const auto splat = [](double x) { return lanes::splat<T>(x); };
  ToolsOf<T, true, false> tools{
      &q, sines, errors, {splat(tool_mm_.x()), splat(tool_mm_.y()), splat(tool_mm_.z())}, {}};
  carry(tools);
  return {tools.tip, tools.near};
}

template <class T>
ErrorKinematics::AxesOf<T> ErrorKinematics::axes(const TableKinematics::SinesOf<T>& sines,
                                                 const ChainErrorsOf<T>& errors) const {
  ToolsOf<T, false, true> tools{nullptr, sines, errors, {}, lanes::splat_vector<T>(Vec3::UnitZ())};
  carry(tools);
  return {tools.axis, tools.near};
}

}  // namespace trunnion
