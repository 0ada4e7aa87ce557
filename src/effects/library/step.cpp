// The part (or artefact) shifted once: three translations at P from one moment of one run on. Variants: the
// run.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Step final : public StraightEffect {
 public:
  Step(EffectInfo info, std::size_t run) : StraightEffect(std::move(info), kPartLink), run_(run) {}

  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double> shape,
               std::span<Twist> out) const override {
    const double on = state.run == run_ && state.time_s >= shape[0] ? 1.0 : 0.0;
    for (std::size_t k = 0; k < 3; ++k) out[k] = unit_twist("XYZ"[k]) * on;
  }

 private:
  std::size_t run_;
};

EffectInfo describe_step(const RunInfo& run) {
  EffectInfo info;
  info.id = "step";
  info.what = "The set-up shifted suddenly during run '" + run.id + "'";
  info.cause = "a clamp that slipped, a touch or collision, a power cycle or re-homing of an axis";
  info.remedy = "check the clamping; repeat the run, or split it at that moment";
  info.kind = EffectClass::setup;
  info.variant = {{"run", run.id}};
  for (const char* name : {"X", "Y", "Z"}) info.parameters.push_back(linear(name, Unit::um, 10.0));
  info.parameters.push_back(shape("t", Unit::s, 0.5 * run.duration_s, 0.0, run.duration_s));
  return info;
}

}  // namespace

void make_step(const LibraryBuilder& builder) {
  std::vector<std::shared_ptr<const Effect>> variants;
  for (std::size_t r = 0; r < builder.context().runs.size(); ++r) {
    variants.push_back(std::make_shared<Step>(describe_step(builder.context().runs[r]), r));
  }
  if (!variants.empty()) builder.add(std::move(variants));
}

}  // namespace trunnion::effects
