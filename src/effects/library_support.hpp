#pragma once
#include <array>
#include <string>
#include <vector>

#include "trunnion/effects/library.hpp"

namespace trunnion::effects {

/// What a library file gets to make its instances from. A file `backlash.cpp` defines `void
/// make_backlash(const LibraryBuilder&)`; the build lists and calls all of them.
class LibraryBuilder {
 public:
  /// `equivalents`: also variants that the data cannot tell from another one (a model file may name either).
  LibraryBuilder(const Machine& machine, const EffectContext& context, bool equivalents,
                 std::vector<EffectFamily>& out)
      : machine_(machine), context_(context), equivalents_(equivalents), out_(out) {}
  bool equivalents() const { return equivalents_; }
  const Machine& machine() const { return machine_; }
  const EffectContext& context() const { return context_; }

  std::vector<AxisId> axes(AxisKind kind) const;
  /// Index of a temperature among the context's; nothing when the data do not have it.
  std::optional<std::size_t> temperature(const std::string& name) const;

  void add(std::shared_ptr<const Effect> effect) const { out_.push_back({{std::move(effect)}}); }
  /// Variants of one id, at least one.
  void add(std::vector<std::shared_ptr<const Effect>> variants) const {
    out_.push_back({std::move(variants)});
  }

 private:
  const Machine& machine_;
  const EffectContext& context_;
  bool equivalents_;
  std::vector<EffectFamily>& out_;
};

/// Where the effects of the library keep what they say of themselves.
class LibraryEffect : public Effect {
 public:
  LibraryEffect(EffectInfo info, Link link) : info_(std::move(info)), link_(link) {}
  const EffectInfo& info() const override { return info_; }
  Link link() const override { return link_; }

 private:
  EffectInfo info_;
  Link link_;
};

/// An effect whose twist is an affine function of the position (or does not depend on it): no bend.
class StraightEffect : public LibraryEffect {
 public:
  using LibraryEffect::LibraryEffect;
  std::optional<TwistBend> bend(const MachineState&, const MachineState&,
                                std::span<const double>) const override {
    return TwistBend{};
  }
};

/// Bound on how far amplitude * sin(phase + const) leaves its chord over a turn of the phase.
double harmonic_bend(double amplitude, double turn);
/// `size` as a bend in the direction of a unit twist.
TwistBend bend_along(const Twist& unit, double size);
/// Largest |P_n''| on the interval between a and b, n = 1 ... 4.
double largest_legendre_second(int n, double a, double b);

inline Link joint_link(AxisId id) {
  return {Link::Kind::joint, id};
}
inline constexpr Link kSpindleLink{Link::Kind::spindle, 0};
inline constexpr Link kPartLink{Link::Kind::part, 0};

/// Unit positioning error along the axis' own positive sense (rotary: about +n): mm of a mm, rad of a rad.
inline Twist positioning_twist(const Axis& axis) {
  return axis.kind == AxisKind::linear ? Twist{axis.direction, Vec3::Zero()}
                                       : Twist{Vec3::Zero(), axis.direction};
}
/// Unit twist of an ISO direction letter: X Y Z translations along, A B C rotations about M's axes.
Twist unit_twist(char letter);
inline bool is_rotation(char letter) {
  return letter >= 'A' && letter <= 'C';
}
/// um for the letters X Y Z, urad for A B C.
inline Unit unit_of_letter(char letter) {
  return is_rotation(letter) ? Unit::urad : Unit::um;
}

/// `usual` in the printed unit.
Parameter linear(std::string name, Unit unit, double usual);
/// `usual`, `min`, `max` in the printed unit.
Parameter shape(std::string name, Unit unit, double usual, double min, double max);
/// The time constant of a first-order lag: 300 to 15 000 s, from a spindle's bearing to a cast column.
Parameter lag_time();

/// Two rotary axes of one machine, one of which tilts (A, B) while the other turns about the machine's Z (C).
struct TiltAndTurn {
  AxisId tilt = 0;
  AxisId turn = 0;
  bool turn_below = false;  // C carries the tilting axis; else the tilting axis carries C

  /// sin t cos r, sin t sin r, cos t cos r, cos t sin r at the angles t, r of this state.
  std::array<double, 4> products(const MachineState& state) const;
  /// Bound on how far `amplitude` times sin t or cos t times cos (r + const) leaves its chord over a motion.
  double bend(double amplitude, const MachineState& from, const MachineState& to) const;
};
std::vector<TiltAndTurn> tilts_and_turns(const Machine& machine);

/// The parameter of a Legendre argument: x on [min, max] of the axis mapped to [-1, 1].
double normalised_position(const Axis& axis, double x);
/// P_n(t), n = 1 ... 4.
double legendre(int n, double t);

}  // namespace trunnion::effects
