// A constant offset on the tool's side: translations of S along X and along Y (along Z: `tool_length`).
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ToolOffset final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  DependsOn depends_on() const override { return DependsOn::nothing; }
  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = unit_twist('X');
    out[1] = unit_twist('Y');
  }
};

}  // namespace

void make_tool_offset(const LibraryBuilder& builder) {
  EffectInfo info;
  info.id = "tool_offset";
  info.what = "The measured point of the tool, ball or probe stands beside the spindle's axis by a constant";
  info.cause =
      "a ball or stylus that runs out, a spindle that was not turned to its own position, a "
      "collision of the head";
  info.remedy =
      "centre the ball or stylus, or measure at two spindle orientations and take the mean; with "
      "the part's axes turned it shows beside the part's position";
  info.parameters = {linear("X0S", Unit::um, 10.0), linear("Y0S", Unit::um, 10.0)};
  builder.add(std::make_shared<ToolOffset>(std::move(info), kSpindleLink));
}

}  // namespace trunnion::effects
