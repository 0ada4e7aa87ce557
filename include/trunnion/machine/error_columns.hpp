#pragma once
#include <array>
#include <cstddef>

#include "trunnion/base/lanes.hpp"
#include "trunnion/machine/kinematics.hpp"

/// Positions and errors of a few places side by side: T is `Lanes` or `Quads`.
namespace trunnion {

/// Joint positions, mm and rad, by axis.
template <class T>
using JointsOf = std::array<T, kMaxAxes>;

/// Twist.
template <class T>
struct TwistOf {
  lanes::Triple<T> trans_mm, rot_rad;
  bool turns;  // else the rotation is zero at all of them

  TwistOf() {}  // the numbers come when they are known
  TwistOf(const lanes::Triple<T>& trans, const lanes::Triple<T>& rot, bool does_turn)
      : trans_mm(trans), rot_rad(rot), turns(does_turn) {}
  /// The same at all places.
  explicit TwistOf(const Twist& one)
      : trans_mm(lanes::splat_vector<T>(one.trans_mm)),
        rot_rad(lanes::splat_vector<T>(one.rot_rad)),
        turns(!one.rot_rad.isZero(0.0)) {}

  /// 0 to 2 of the translation, 3 to 5 of the rotation.
  T* component(int i) {
    lanes::Triple<T>& of = i < 3 ? trans_mm : rot_rad;
    return i % 3 == 0 ? &of.x : i % 3 == 1 ? &of.y : &of.z;
  }
};

/// ChainErrors.
template <class T>
struct ChainErrorsOf {
  std::array<TwistOf<T>, kMaxAxes> joint;
  TwistOf<T> spindle, part;

  /// At one of the places, all from 0 on, of the links that `varying` has.
  void put(int lane, const ChainErrors& errors, const ChainLinks& varying) {
    const auto vector = [lane](lanes::Triple<T>& to, const Vec3& from) {
      to.x[lane] = from.x();
      to.y[lane] = from.y();
      to.z[lane] = from.z();
    };
    const auto twist = [lane, &vector](TwistOf<T>& to, const Twist& from) {
      to.turns = (lane > 0 && to.turns) || !from.rot_rad.isZero(0.0);
      vector(to.trans_mm, from.trans_mm);
      vector(to.rot_rad, from.rot_rad);
    };
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      if (varying.joint[id]) twist(joint[id], errors.joint[id]);
    }
    if (varying.spindle) twist(spindle, errors.spindle);
    if (varying.part) twist(part, errors.part);
  }
};

}  // namespace trunnion
