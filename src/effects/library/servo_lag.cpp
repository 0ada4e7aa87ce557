// Following error of one axis: positioning -v tau along the axis' own positive sense (rotary: about +n), v
// the axis' velocity.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ServoLag final : public StraightEffect {
 public:
  ServoLag(EffectInfo info, Link link, const Axis& axis)
      : StraightEffect(std::move(info), link), positioning_(positioning_twist(axis)) {}

  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = positioning_ * -state.velocity[link().axis];
  }

 private:
  Twist positioning_;
};

}  // namespace

void make_servo_lag(const LibraryBuilder& builder) {
  for (AxisId id = 0; id < builder.machine().axes.size(); ++id) {
    const Axis& axis = builder.machine().axes[id];
    EffectInfo info;
    info.id = "servo_lag:" + axis.name;
    info.what = axis.name + " follows its command late: it stands back in proportion to its velocity";
    info.cause =
        "the position gain (Kv) of this axis differs from that of the others; missing velocity feed-forward";
    info.remedy = "match the gains of all axes, switch feed-forward on, or lower the feed";
    info.kind = EffectClass::dynamic;
    info.parameters = {linear("tau", Unit::ms, 0.1)};
    builder.add(std::make_shared<ServoLag>(std::move(info), joint_link(id), axis));
  }
}

}  // namespace trunnion::effects
