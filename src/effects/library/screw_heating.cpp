// Growth of a screw or scale with its temperature: positioning alpha (T_j - T_ref) (x - x_fixed) along the
// axis' own positive sense, T_j the axis' sensor in the machine file. Linear in alpha and in offset = -alpha
// x_fixed; x_fixed follows from the two.
#include <limits>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ScrewHeating final : public StraightEffect {
 public:
  ScrewHeating(EffectInfo info, Link link, const Vec3& along, std::size_t sensor)
      : StraightEffect(std::move(info), link), along_(along), sensor_(sensor) {}

  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const double dT = state.temperature(sensor_);
    out[0] = {along_ * (dT * state.q[link().axis]), Vec3::Zero()};
    out[1] = {along_ * dT, Vec3::Zero()};
  }

  std::vector<Derived> derived(std::span<const double> p) const override {
    return {{"x_fixed_mm", p[0] != 0.0 ? -p[1] / p[0] : std::numeric_limits<double>::quiet_NaN(), Unit::mm}};
  }
  bool set_derived(std::string_view key, double value, std::span<double> p) const override {
    if (key != "x_fixed_mm") return false;
    p[1] = -p[0] * value;
    return true;
  }

 private:
  Vec3 along_;
  std::size_t sensor_;
};

EffectInfo describe_screw_heating(const std::string& axis, const std::string& sensor) {
  EffectInfo info;
  info.id = "screw_heating:" + axis;
  info.what = "The screw or scale of " + axis + " grows with its temperature (sensor " + sensor +
              ") away from its fixed end";
  info.cause = "friction of the nut at fast traverse, heat of the motor and of the bearings";
  info.remedy =
      "use a linear scale or a cooled screw; compensate with the sensor; warm up with the motions of the "
      "program";
  info.kind = EffectClass::thermal;
  info.parameters = {linear("alpha", Unit::um_per_m_K, 11.0), linear("offset", Unit::um_per_K, 2.0)};
  return info;
}

}  // namespace

void make_screw_heating(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::linear)) {
    const Axis& axis = builder.machine().axes[id];
    const auto sensor = builder.machine().sensors.axes.find(axis.name);
    if (sensor == builder.machine().sensors.axes.end()) continue;
    const auto index = builder.temperature(sensor->second);
    if (!index) continue;
    builder.add(std::make_shared<ScrewHeating>(describe_screw_heating(axis.name, sensor->second),
                                               joint_link(id), axis.direction, *index));
  }
}

}  // namespace trunnion::effects
