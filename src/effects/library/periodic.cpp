// Periodic positioning error of a linear axis: s sin(2 pi x / p) + c cos(2 pi x / p) along the axis' own
// positive sense. p is the screw's pitch or a half, third, quarter of it where the machine file gives it;
// else, or beside them, searched from 1 to 50 mm.
#include <cmath>

#include "trunnion/base/units.hpp"

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Periodic final : public LibraryEffect {
 public:
  Periodic(EffectInfo info, Link link, const Vec3& along)
      : LibraryEffect(std::move(info), link), along_(along) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double> shape,
               std::span<Twist> out) const override {
    const double phase = kTwoPi * state.q[link().axis] / shape[0];
    out[0] = {along_ * std::sin(phase), Vec3::Zero()};
    out[1] = {along_ * std::cos(phase), Vec3::Zero()};
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    const double turn = kTwoPi * (to.q[link().axis] - from.q[link().axis]) / p[2];
    return TwistBend{along_.norm() * harmonic_bend(std::hypot(p[0], p[1]), turn), 0.0};
  }

 private:
  Vec3 along_;
};

EffectInfo describe_periodic(const Axis& axis) {
  EffectInfo info;
  info.id = "periodic:" + axis.name;
  info.what = "Positioning error of " + axis.name + " that repeats with a fixed period along the travel";
  info.cause =
      "a ball screw that wobbles once a turn (period = pitch), a coupling or motor encoder (parts of the "
      "pitch), a scale's "
      "interpolation or graduation";
  info.remedy =
      "check coupling, screw bearing and encoder mounting; a compensation table needs at least 8 points a "
      "period";
  Parameter p = shape("p", Unit::mm, axis.screw_pitch_mm.value_or(10.0), 1.0, 50.0);
  if (axis.screw_pitch_mm) {
    for (const double part : {1.0, 2.0, 3.0, 4.0}) p.candidates.push_back(*axis.screw_pitch_mm / part);
  }
  info.parameters = {linear("sin", Unit::um, 2.0), linear("cos", Unit::um, 2.0), p};
  return info;
}

}  // namespace

void make_periodic(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::linear)) {
    const Axis& axis = builder.machine().axes[id];
    builder.add(std::make_shared<Periodic>(describe_periodic(axis), joint_link(id), axis.direction));
  }
}

}  // namespace trunnion::effects
