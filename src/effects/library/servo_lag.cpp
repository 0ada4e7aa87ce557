// Following error of one axis: positioning -v tau along the axis' own positive sense, v the axis' velocity.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ServoLag final : public StraightEffect {
 public:
  ServoLag(EffectInfo info, Link link, const Vec3& along)
      : StraightEffect(std::move(info), link), along_(along) {}

  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = {along_ * -state.velocity[link().axis], Vec3::Zero()};
  }

 private:
  Vec3 along_;
};

}  // namespace

void make_servo_lag(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::linear)) {
    const Axis& axis = builder.machine().axes[id];
    EffectInfo info;
    info.id = "servo_lag:" + axis.name;
    info.what = axis.name + " follows its command late: it stands back in proportion to its velocity";
    info.cause =
        "the position gain (Kv) of this axis differs from that of the others; missing velocity feed-forward";
    info.remedy = "match the gains of all axes, switch feed-forward on, or lower the feed";
    info.kind = EffectClass::dynamic;
    info.parameters = {linear("tau", Unit::ms, 0.1)};
    builder.add(std::make_shared<ServoLag>(std::move(info), joint_link(id), axis.direction));
  }
}

}  // namespace trunnion::effects
