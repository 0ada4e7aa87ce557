// Error of the tool's length or of the spindle's gauge point: a constant translation of S along Z.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class ToolLength final : public StraightEffect {
 public:
  using StraightEffect::StraightEffect;

  DependsOn depends_on() const override { return DependsOn::nothing; }
  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = unit_twist('Z');
  }
};

}  // namespace

void make_tool_length(const LibraryBuilder& builder) {
  EffectInfo info;
  info.id = "tool_length";
  info.what =
      "The tool, or the spindle's gauge point, is not where its length says: off by a constant along Z";
  info.cause =
      "a wrong or worn reference in tool setting, another gauge length than the control uses; + means too "
      "high (short)";
  info.remedy = "measure the tool again against the reference that the pivots were measured with";
  info.parameters = {linear("Z0S", Unit::um, 10.0)};
  builder.add(std::make_shared<ToolLength>(std::move(info), kSpindleLink));
}

}  // namespace trunnion::effects
