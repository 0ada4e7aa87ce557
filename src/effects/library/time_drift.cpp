// Drift that no sensor follows: three translations of S, linear in time within the run, the same rates in all
// runs.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class TimeDrift final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    for (std::size_t k = 0; k < 3; ++k) out[k] = unit_twist("XYZ"[k]) * state.time_s;
  }
};

}  // namespace

void make_time_drift(const LibraryBuilder& builder) {
  EffectInfo info;
  info.id = "time_drift";
  info.what = "Tool and part drift apart steadily with time, from the start of each run";
  info.cause =
      "warming up that the sensors do not show; a clamp or glue that creeps; the measuring set-up itself";
  info.remedy =
      "let machine and instrument settle first; repeat the first reading at the end; put a sensor where it "
      "warms";
  info.kind = EffectClass::thermal;
  for (const char* name : {"X", "Y", "Z"}) info.parameters.push_back(linear(name, Unit::um_per_h, 5.0));
  builder.add(std::make_shared<TimeDrift>(std::move(info), kSpindleLink));
}

}  // namespace trunnion::effects
