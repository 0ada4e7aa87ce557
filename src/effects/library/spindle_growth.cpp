// Growth of the spindle with its speed: translations of S along Z and Y, proportional to the speed through
// one first-order lag.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class SpindleGrowth final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  std::vector<LagRequest> lags(std::span<const double> shape) const override {
    return {{{Signal::Kind::spindle_rpm, 0}, shape[0]}};
  }
  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState&, std::span<const double> lagged, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = unit_twist('Z') * lagged[0];
    out[1] = unit_twist('Y') * lagged[0];
  }
};

}  // namespace

void make_spindle_growth(const LibraryBuilder& builder) {
  EffectInfo info;
  info.id = "spindle_growth";
  info.what = "The spindle grows along Z and bends the head along Y while it warms up with its speed";
  info.cause = "heat of the bearings and of the motor, which follows the speed with a lag";
  info.remedy = "warm the spindle up before cutting; check the chiller; compensate with a thermal model";
  info.kind = EffectClass::thermal;
  info.parameters = {linear("Z", Unit::um_per_krpm, 2.0), linear("Y", Unit::um_per_krpm, 1.0), lag_time()};
  builder.add(std::make_shared<SpindleGrowth>(std::move(info), kSpindleLink));
}

}  // namespace trunnion::effects
