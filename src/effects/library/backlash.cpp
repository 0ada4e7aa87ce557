// Backlash: the carried body lags by half the lost motion b behind the sense of the axis' last motion: -b/2 *
// direction along the axis' own positive sense (rotary: about +n). b > 0 is lost motion.
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Backlash final : public StraightEffect {
 public:
  Backlash(EffectInfo info, Link link, const Axis& axis)
      : StraightEffect(std::move(info), link), sense_(positioning_twist(axis)) {}

  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = sense_ * (-0.5 * state.direction[link().axis]);
  }
  // The sense is that of the whole motion.
  std::optional<TwistRange> range(std::span<const double> p, std::span<const Axis>) const override {
    TwistRange out;
    out.largest = bend_along(sense_, 0.5 * std::abs(p[0]));
    return out;
  }

 private:
  Twist sense_;
};

EffectInfo describe_backlash(const Axis& axis) {
  EffectInfo info;
  info.id = "backlash:" + axis.name;
  info.what = "Lost motion of " + axis.name + ": it stops short by half of it from either side";
  info.cause =
      "play or wind-up in nut, bearing, worm or clamp; friction that the control does not see (motor "
      "encoder)";
  info.remedy =
      "take up the preload; enter the reversal value in the control (a negative one means it is "
      "over-compensated)";
  const bool rotary = axis.kind == AxisKind::rotary;
  info.parameters = {linear("b", rotary ? Unit::urad : Unit::um, rotary ? 20.0 : 5.0)};
  return info;
}

}  // namespace

void make_backlash(const LibraryBuilder& builder) {
  for (AxisId id = 0; id < builder.machine().axes.size(); ++id) {
    const Axis& axis = builder.machine().axes[id];
    builder.add(std::make_shared<Backlash>(describe_backlash(axis), joint_link(id), axis));
  }
}

}  // namespace trunnion::effects
