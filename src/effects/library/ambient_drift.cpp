// Drift of the whole structure with the room: three translations of S, proportional to the lagged ambient
// temperature.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class AmbientDrift final : public StraightEffect {
 public:
  AmbientDrift(EffectInfo info, std::size_t sensor)
      : StraightEffect(std::move(info), kSpindleLink), sensor_(sensor) {}

  std::vector<LagRequest> lags(std::span<const double> shape) const override {
    return {{{Signal::Kind::temperature, sensor_}, shape[0]}};
  }
  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState&, std::span<const double> lagged, std::span<const double>,
               std::span<Twist> out) const override {
    for (std::size_t k = 0; k < 3; ++k) out[k] = unit_twist("XYZ"[k]) * lagged[0];
  }

 private:
  std::size_t sensor_;
};

}  // namespace

void make_ambient_drift(const LibraryBuilder& builder) {
  const auto sensor = builder.temperature(builder.machine().sensors.ambient);
  if (!sensor) return;
  EffectInfo info;
  info.id = "ambient_drift";
  info.what = "Tool and part drift apart with the temperature of the room (sensor " +
              builder.machine().sensors.ambient + ")";
  info.cause = "the structure follows the room with the lag of its castings; doors, sun, heating";
  info.remedy =
      "keep the room's temperature; re-probe the datum after a change; compensate with the ambient sensor";
  info.kind = EffectClass::thermal;
  for (const char* name : {"X", "Y", "Z"}) info.parameters.push_back(linear(name, Unit::um_per_K, 3.0));
  info.parameters.push_back(lag_time());
  builder.add(std::make_shared<AmbientDrift>(std::move(info), *sensor));
}

}  // namespace trunnion::effects
