// Sag of the tilting table under gravity: rotation about M's X and translation along Y proportional to sin A,
// translation along Z proportional to cos A.
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Sag final : public LibraryEffect {
 public:
  using LibraryEffect::LibraryEffect;

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const double A = state.q[link().axis];
    out[0] = unit_twist('A') * std::sin(A);
    out[1] = unit_twist('Y') * std::sin(A);
    out[2] = unit_twist('Z') * std::cos(A);
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    const double turn = to.q[link().axis] - from.q[link().axis];
    return TwistBend{harmonic_bend(p[1], turn) + harmonic_bend(p[2], turn), harmonic_bend(p[0], turn)};
  }
};

}  // namespace

void make_sag(const LibraryBuilder& builder) {
  const auto id = builder.machine().axis("A");
  if (!id || builder.machine().axes[*id].kind != AxisKind::rotary) return;
  EffectInfo info;
  info.id = "sag:A";
  info.what = "The tilting table sinks and turns under its own weight as it tilts";
  info.cause = "a heavy table or part out of balance about A; soft bearings or drive of the cradle";
  info.remedy = "balance the table, reduce the load, or enter an error table over A for this load";
  info.parameters = {linear("A_sin", Unit::urad, 20.0), linear("Y_sin", Unit::um, 8.0),
                     linear("Z_cos", Unit::um, 8.0)};
  builder.add(std::make_shared<Sag>(std::move(info), joint_link(*id)));
}

}  // namespace trunnion::effects
