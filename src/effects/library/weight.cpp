// What the weight of the body that tilts does to the axis below it, several components at once, each as
// sin t cos r and sin t sin r (t the angle of the tilting axis A or B, r that of C). Where C carries the
// tilting axis (a head): rotations of C's joint about X and Y and translations along them, the lean of a body
// that C swings round. Where the tilting axis carries C (a trunnion): rotation of its joint about its axis
// and translations across it, a weight that C carries round. A single component of either joint is
// `unbalance`.
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Weight final : public LibraryEffect {
 public:
  Weight(EffectInfo info, AxisId carrier, const TiltAndTurn& angles, std::string letters)
      : LibraryEffect(std::move(info), joint_link(carrier)), angles_(angles), letters_(std::move(letters)) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const auto products = angles_.products(state);
    for (std::size_t k = 0; k < letters_.size(); ++k) {
      out[2 * k] = unit_twist(letters_[k]) * products[0];
      out[2 * k + 1] = unit_twist(letters_[k]) * products[1];
    }
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    TwistBend out;
    for (std::size_t k = 0; k < letters_.size(); ++k)
      out += bend_along(unit_twist(letters_[k]), angles_.bend(std::hypot(p[2 * k], p[2 * k + 1]), from, to));
    return out;
  }

 private:
  TiltAndTurn angles_;
  std::string letters_;
};

EffectInfo describe_weight(const std::string& tilting, const std::string& turning, bool turn_below,
                           const std::string& letters) {
  EffectInfo info;
  info.id = "weight:" + tilting + turning;
  info.what = turn_below
                  ? "The head leans out as " + tilting + " tilts it, and its weight bends what is below " +
                        turning + " to the side to which " + turning + " has swung it"
                  : "A weight beside the axis of " + turning + " sinks and turns the table on " + tilting +
                        " as both axes move";
  info.cause = turn_below
                   ? "a heavy head on a soft bearing, slide or column"
                   : "a part or fixture out of balance on the table; soft bearings or drive of " + tilting;
  info.remedy = turn_below ? "counterbalance the head, check the bearing of " + turning +
                                 ", enter an error table over " + tilting + " and " + turning
                           : "balance the fixture, or enter an error table over " + tilting + " and " +
                                 turning + " for this load";
  for (const char letter : letters)
    for (const char* name : {"_sin_cos", "_sin_sin"})
      info.parameters.push_back(
          linear(std::string(1, letter) + name, unit_of_letter(letter), is_rotation(letter) ? 20.0 : 5.0));
  return info;
}

}  // namespace

void make_weight(const LibraryBuilder& builder) {
  const Machine& machine = builder.machine();
  for (const TiltAndTurn& angles : tilts_and_turns(machine)) {
    const std::string &tilting = machine.axes[angles.tilt].name, &turning = machine.axes[angles.turn].name;
    const bool below = angles.turn_below;
    const std::string letters = below ? "ABXY" : tilting == "A" ? "AYZ" : "BXZ";
    builder.add(std::make_shared<Weight>(describe_weight(tilting, turning, below, letters),
                                         below ? angles.turn : angles.tilt, angles, letters));
  }
}

}  // namespace trunnion::effects
