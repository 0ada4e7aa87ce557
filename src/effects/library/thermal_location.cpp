// Drift of a rotary axis with a temperature: translations of its joint along Y and Z (A), X and Z (B), X and
// Y (C), proportional to a lagged sensor. Variants: the sensor.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ThermalLocation final : public StraightEffect {
 public:
  ThermalLocation(EffectInfo info, Link link, std::string letters, std::size_t sensor)
      : StraightEffect(std::move(info), link), letters_(std::move(letters)), sensor_(sensor) {}

  std::vector<LagRequest> lags(std::span<const double> shape) const override {
    return {{{Signal::Kind::temperature, sensor_}, shape[0]}};
  }
  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState&, std::span<const double> lagged, std::span<const double>,
               std::span<Twist> out) const override {
    for (std::size_t k = 0; k < letters_.size(); ++k) out[k] = unit_twist(letters_[k]) * lagged[0];
  }

 private:
  std::string letters_;
  std::size_t sensor_;
};

EffectInfo describe_thermal_location(const std::string& axis, const std::string& letters,
                                     const std::string& sensor) {
  EffectInfo info;
  info.id = "thermal_location:" + axis;
  info.what = "The centre of " + axis + " moves with the temperature of '" + sensor + "', with a lag";
  info.cause = "heat of the table drive or of coolant that warms the cradle and its bearings on one side";
  info.remedy =
      "re-probe the centre of rotation when warm; compensate with that sensor; keep coolant off the cradle";
  info.kind = EffectClass::thermal;
  info.variant = {{"sensor", sensor}};
  for (const char letter : letters)
    info.parameters.push_back(linear(std::string(1, letter), Unit::um_per_K, 3.0));
  info.parameters.push_back(lag_time());
  return info;
}

}  // namespace

void make_thermal_location(const LibraryBuilder& builder) {
  const auto& sensors = builder.context().names.temperatures;
  if (sensors.empty()) return;
  for (const AxisId id : builder.axes(AxisKind::rotary)) {
    const std::string& name = builder.machine().axes[id].name;
    const std::string letters = name == "A" ? "YZ" : name == "B" ? "XZ" : name == "C" ? "XY" : "";
    if (letters.empty()) continue;
    std::vector<std::shared_ptr<const Effect>> variants;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      variants.push_back(std::make_shared<ThermalLocation>(
          describe_thermal_location(name, letters, sensors[s]), joint_link(id), letters, s));
    }
    builder.add(std::move(variants));
  }
}

}  // namespace trunnion::effects
