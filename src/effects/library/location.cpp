// Location errors of a rotary axis (ISO 230-7): where its axis of rotation really is and points, as constant
// parts of the joint's twist: Y0A Z0A B0A C0A for A, X0B Z0B A0B C0B for B, X0C Y0C A0C B0C for C.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Location final : public StraightEffect {
 public:
  Location(EffectInfo info, Link link, std::string letters)
      : StraightEffect(std::move(info), link), letters_(std::move(letters)) {}

  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    for (std::size_t k = 0; k < letters_.size(); ++k) out[k] = unit_twist(letters_[k]);
  }
  DependsOn depends_on() const override { return DependsOn::nothing; }

 private:
  std::string letters_;
};

EffectInfo describe_location(const std::string& axis, const std::string& letters) {
  EffectInfo info;
  info.id = "location:" + axis;
  info.what =
      "The axis of rotation of " + axis + " lies beside, or points away from, where the machine file says";
  info.cause =
      "the pivot in the control or the machine file is out of date; a collision; the table was taken off";
  info.remedy =
      "measure the centre of rotation (ball and probe, R-test) and correct the pivot; shim what is out of "
      "square";
  for (const char letter : letters) {
    info.parameters.push_back(
        linear(std::string{letter, '0'} + axis, unit_of_letter(letter), is_rotation(letter) ? 40.0 : 20.0));
  }
  return info;
}

}  // namespace

void make_location(const LibraryBuilder& builder) {
  for (const AxisId id : builder.axes(AxisKind::rotary)) {
    const std::string& name = builder.machine().axes[id].name;
    const std::string letters = name == "A" ? "YZBC" : name == "B" ? "XZAC" : name == "C" ? "XYAB" : "";
    if (!letters.empty())
      builder.add(std::make_shared<Location>(describe_location(name, letters), joint_link(id), letters));
  }
}

}  // namespace trunnion::effects
