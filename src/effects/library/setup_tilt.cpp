// The part (or artefact) was set up tilted or turned: three constant rotations at P, others for each run.
#include <algorithm>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class SetupTilt final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  DependsOn depends_on() const override { return DependsOn::conditions; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    std::fill(out.begin(), out.end(), Twist{});
    if (3 * state.run + 2 >= out.size() || state.run >= out.size()) return;
    for (std::size_t k = 0; k < 3; ++k) out[3 * state.run + k] = unit_twist("ABC"[k]);
  }
};

}  // namespace

void make_setup_tilt(const LibraryBuilder& builder) {
  if (builder.context().runs.empty()) return;
  EffectInfo info;
  info.id = "setup_tilt";
  info.what =
      "The part, ball or reflector carrier stands turned against its nominal set-up, differently in each run";
  info.cause = "clamping, dirt under the fixture, an alignment that was not probed";
  info.remedy =
      "align or probe the set-up in each run, or let it be fitted as here; it is no error of the machine";
  info.kind = EffectClass::setup;
  for (const RunInfo& run : builder.context().runs) {
    for (const char letter : std::string_view("ABC")) {
      info.parameters.push_back(linear(std::string{letter, '_'} + run.id, Unit::urad, 50.0));
    }
  }
  builder.add(std::make_shared<SetupTilt>(std::move(info), kPartLink));
}

}  // namespace trunnion::effects
