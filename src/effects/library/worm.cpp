// Angular error of a rotary axis that repeats n times a turn: s sin(n x) + c cos(n x) about +n, n a whole
// number from 8 to 180.
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Worm final : public LibraryEffect {
 public:
  Worm(EffectInfo info, Link link, const Vec3& about) : LibraryEffect(std::move(info), link), about_(about) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double> shape,
               std::span<Twist> out) const override {
    const double phase = shape[0] * state.q[link().axis];
    out[0] = {Vec3::Zero(), about_ * std::sin(phase)};
    out[1] = {Vec3::Zero(), about_ * std::cos(phase)};
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    const double turn = p[2] * (to.q[link().axis] - from.q[link().axis]);
    return TwistBend{0.0, about_.norm() * harmonic_bend(std::hypot(p[0], p[1]), turn)};
  }

 private:
  Vec3 about_;
};

EffectInfo describe_worm(const Axis& axis) {
  EffectInfo info;
  info.id = "worm:" + axis.name;
  info.what = "Angular positioning error of " + axis.name + " that repeats a whole number of times a turn";
  info.cause =
      "a worm that runs out (n = teeth of its wheel), the graduation or interpolation of the encoder";
  info.remedy = "re-adjust or replace the worm; an angle table needs at least 8 points a period";
  Parameter n = shape("n", Unit::none, 90.0, 8.0, 180.0);
  n.integer = true;
  info.parameters = {linear("sin", Unit::urad, 20.0), linear("cos", Unit::urad, 20.0), n};
  return info;
}

}  // namespace

void make_worm(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::rotary)) {
    const Axis& axis = builder.machine().axes[id];
    builder.add(std::make_shared<Worm>(describe_worm(axis), joint_link(id), axis.direction));
  }
}

}  // namespace trunnion::effects
