// Zero offset of a rotary axis (ISO 230-7): the axis stands off by a constant angle from where its position
// says, A0A for A, B0B for B, C0C for C; about the axis in its positive sense.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ZeroOffset final : public StraightEffect {
 public:
  ZeroOffset(EffectInfo info, Link link, const Vec3& about)
      : StraightEffect(std::move(info), link), about_(about) {}

  DependsOn depends_on() const override { return DependsOn::nothing; }
  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = {Vec3::Zero(), about_};
  }

 private:
  Vec3 about_;
};

EffectInfo describe_zero_offset(const std::string& axis) {
  EffectInfo info;
  info.id = "zero_offset:" + axis;
  info.what = "The zero of " + axis + " is turned by a constant angle from where the control believes it";
  info.cause =
      "the reference mark or the encoder was set anew, a collision slipped the coupling, the table "
      "was aligned with another part";
  info.remedy =
      "align the axis' zero again (a straight edge or a bar on the table) and correct its reference";
  info.parameters = {linear(axis + "0" + axis, Unit::urad, 40.0)};
  return info;
}

}  // namespace

void make_zero_offset(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::rotary)) {
    const Axis& axis = builder.machine().axes[id];
    builder.add(
        std::make_shared<ZeroOffset>(describe_zero_offset(axis.name), joint_link(id), axis.direction));
  }
}

}  // namespace trunnion::effects
