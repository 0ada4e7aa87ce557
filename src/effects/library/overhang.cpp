// Bending of an overhanging ram: rotations about X and about Y, each proportional to z_max - z, how far the Z
// slide stands out.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Overhang final : public StraightEffect {
 public:
  Overhang(EffectInfo info, Link link, double z_max) : StraightEffect(std::move(info), link), z_max_(z_max) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const double out_by = z_max_ - state.q[link().axis];
    out[0] = unit_twist('A') * out_by;
    out[1] = unit_twist('B') * out_by;
  }

 private:
  double z_max_;
};

}  // namespace

void make_overhang(const LibraryBuilder& builder) {
  const auto id = builder.machine().axis("Z");
  if (!id || builder.machine().axes[*id].kind != AxisKind::linear) return;
  EffectInfo info;
  info.id = "overhang:Z";
  info.what = "The Z slide tilts the more, the farther it stands out of its guide";
  info.cause = "the weight and the soft guide of an overhanging ram or quill";
  info.remedy =
      "work with the slide drawn in (longer tool, higher part); check the gibs; enter an angular table over "
      "Z";
  info.parameters = {linear("A", Unit::urad_per_m, 40.0), linear("B", Unit::urad_per_m, 40.0)};
  builder.add(std::make_shared<Overhang>(std::move(info), joint_link(*id), builder.machine().axes[*id].max));
}

}  // namespace trunnion::effects
