// Tilt of the spindle against the machine's Z: constant rotations of S about X and about Y.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class SpindleTilt final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  DependsOn depends_on() const override { return DependsOn::nothing; }
  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = unit_twist('A');
    out[1] = unit_twist('B');
  }
};

}  // namespace

void make_spindle_tilt(const LibraryBuilder& builder) {
  EffectInfo info;
  info.id = "spindle_tilt";
  info.what = "The spindle's axis is not parallel to Z";
  info.cause = "head out of tram after a collision or a repair; a bent column";
  info.remedy = "tram the head; two tool lengths show it, one does not";
  info.parameters = {linear("A0S", Unit::urad, 50.0), linear("B0S", Unit::urad, 50.0)};
  builder.add(std::make_shared<SpindleTilt>(std::move(info), kSpindleLink));
}

}  // namespace trunnion::effects
