// Quadrant glitch: where an axis reverses, friction holds it back until its servo has answered. Positioning
// -h exp(-t / tau) times the new sense of motion along the axis' own positive sense (rotary: about +n), t the
// time since the reversal. h > 0 stands back; an over-compensated friction gives h < 0.
//
// The sense less its own lag is that memory: 2 exp(-t / tau) after a reversal.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ReversalSpike final : public StraightEffect {
 public:
  ReversalSpike(EffectInfo info, Link link, const Axis& axis)
      : StraightEffect(std::move(info), link), positioning_(positioning_twist(axis)) {}

  std::vector<LagRequest> lags(std::span<const double> shape) const override {
    return {{{Signal::Kind::direction, link().axis}, shape[0]}};
  }
  // Over before a machine that stands is read. In a program it is left alone, too: it is gone before the next
  // block ends, and a word that took it out would be a jump.
  void columns(const MachineState& state, std::span<const double> lagged, std::span<const double>,
               std::span<Twist> out) const override {
    const AxisId axis = link().axis;
    const bool acts = state.run != kNoRun && state.velocity[axis] != 0.0;
    out[0] = positioning_ * (acts ? -0.5 * (state.direction[axis] - lagged[0]) : 0.0);
  }

 private:
  Twist positioning_;
};

EffectInfo describe(const Axis& axis) {
  constexpr double kUsual_ms = 15.0, kShortest_ms = 4.0, kLongest_ms = 60.0;
  EffectInfo info;
  info.id = "reversal_spike:" + axis.name;
  info.what = axis.name + " stands back for some milliseconds after it has reversed (quadrant glitch)";
  info.cause = "friction changes its sign at the reversal, and the servo needs time to turn its force round";
  info.remedy =
      "set the control's friction (quadrant glitch) compensation of this axis; raise its velocity gain; "
      "not taken out of programs: it is over before a block ends";
  info.kind = EffectClass::dynamic;
  const bool rotary = axis.kind == AxisKind::rotary;
  info.parameters = {linear("h", rotary ? Unit::urad : Unit::um, rotary ? 50.0 : 5.0),
                     shape("decay", Unit::ms, kUsual_ms, kShortest_ms, kLongest_ms)};
  return info;
}

}  // namespace

void make_reversal_spike(const LibraryBuilder& builder) {
  for (AxisId id = 0; id < builder.machine().axes.size(); ++id) {
    const Axis& axis = builder.machine().axes[id];
    builder.add(std::make_shared<ReversalSpike>(describe(axis), joint_link(id), axis));
  }
}

}  // namespace trunnion::effects
