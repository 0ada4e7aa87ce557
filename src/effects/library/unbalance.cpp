// A weight off the axes of two rotary axes, one of which tilts it while the other turns it: one twist
// component of either joint as sin t cos r and sin t sin r, t the angle of the tilting axis (A, B), r that of
// C. About the tilting axis itself, whose drive holds the weight of a table that turns on it, also cos t cos
// r and cos t sin r. Variants: the component and the axis that carries it, in one symbol (ECC: about Z, of
// C).
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Unbalance final : public LibraryEffect {
 public:
  Unbalance(EffectInfo info, AxisId carrier, const TiltAndTurn& angles, char letter)
      : LibraryEffect(std::move(info), joint_link(carrier)), angles_(angles), unit_(unit_twist(letter)) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const auto products = angles_.products(state);
    for (std::size_t k = 0; k < info().parameters.size(); ++k) out[k] = unit_ * products[k];
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    double amplitude = 0.0;
    for (std::size_t k = 0; k + 1 < p.size(); k += 2) amplitude += std::hypot(p[k], p[k + 1]);
    return bend_along(unit_, angles_.bend(amplitude, from, to));
  }

 private:
  TiltAndTurn angles_;
  Twist unit_;
};

EffectInfo describe_unbalance(const std::string& tilting, const std::string& turning, char letter,
                              const std::string& carrier) {
  EffectInfo info;
  info.id = "unbalance:" + tilting + turning;
  info.what = "A weight beside the axis of " + turning + " moves the machine as " + tilting +
              " tilts it: one error that goes with both angles together";
  info.cause = "a fixture, part or head whose centre of gravity is not on the axis of " + turning +
               "; a drive, brake or bearing that gives way under it";
  info.remedy = "balance the fixture or the head; clamp the axis; enter an error table over " + tilting +
                " and " + turning + " for this load";
  info.variant = {{"component", std::string("E") + letter + carrier}};
  const double usual = is_rotation(letter) ? 20.0 : 5.0;
  for (const char* name : {"sin_cos", "sin_sin"})
    info.parameters.push_back(linear(name, unit_of_letter(letter), usual));
  if (carrier == tilting && letter == tilting.front())
    for (const char* name : {"cos_cos", "cos_sin"})
      info.parameters.push_back(linear(name, unit_of_letter(letter), usual));
  return info;
}

}  // namespace

void make_unbalance(const LibraryBuilder& builder) {
  const Machine& machine = builder.machine();
  for (const TiltAndTurn& angles : tilts_and_turns(machine)) {
    const std::string &tilting = machine.axes[angles.tilt].name, &turning = machine.axes[angles.turn].name;
    std::vector<std::shared_ptr<const Effect>> variants;
    for (const AxisId carrier : {angles.tilt, angles.turn})
      for (const char letter : std::string_view("XYZABC"))
        variants.push_back(std::make_shared<Unbalance>(
            describe_unbalance(tilting, turning, letter, machine.axes[carrier].name), carrier, angles,
            letter));
    builder.add(std::move(variants));
  }
}

}  // namespace trunnion::effects
