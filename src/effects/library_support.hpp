#pragma once
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

inline Link joint_link(AxisId id) {
  return {Link::Kind::joint, id};
}
inline constexpr Link kSpindleLink{Link::Kind::spindle, 0};
inline constexpr Link kPartLink{Link::Kind::part, 0};

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

/// The parameter of a Legendre argument: x on [min, max] of the axis mapped to [-1, 1].
double normalised_position(const Axis& axis, double x);
/// P_n(t), n = 1 ... 4.
double legendre(int n, double t);

}  // namespace trunnion::effects
