#pragma once
#include <random>
#include <string>
#include <vector>

#include "trunnion/effects/model.hpp"

#include "support/machines.hpp"

namespace trunnion::test {

/// Machines of all chain shapes: the shipped ones with sensors, an X table under the trunnion (X'), three
/// axes without a table that turns.
inline std::vector<std::string> effect_machines() {
  auto names = shipped_machines();
  names.insert(names.end(), {"x_table", "three_axis"});
  return names;
}

inline Machine effect_machine(const std::string& name) {
  const bool shipped = name != "x_table" && name != "three_axis";
  Machine machine = shipped_machine(shipped ? name : "trunnion_offset");
  if (name == "x_table") {
    const AxisId x = *machine.axis("X");
    machine.axes[x].direction = -Vec3::UnitX();
    machine.axes[x].carries_part = true;
    machine.tool_chain.erase(machine.tool_chain.begin());
    machine.part_chain.insert(machine.part_chain.begin(), x);
  } else if (name == "three_axis") {
    machine.axes.resize(3);
    machine.part_chain.clear();
  }
  for (const char* axis : {"X", "Y", "Z"}) machine.sensors.axes[axis] = std::string("screw_") + axis;
  return machine;
}

inline EffectContext effect_context() {
  return {{{"ambient", "screw_X", "screw_Y", "screw_Z", "cradle"}, {"coolant"}},
          {{"r1", 3600.0}, {"r2", 7200.0}}};
}

/// Random states within the limits, with temperatures and free states of `effect_context`.
class RandomStates {
 public:
  RandomStates(const Machine& machine, unsigned seed) : machine_(machine), random_(seed) {}

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

  /// Valid until the next call.
  const MachineState& next() {
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const Axis& axis = machine_.axes[id];
      state_.q[id] = axis.has_limits() ? uniform(axis.min, axis.max) : uniform(-7.0, 7.0);
      state_.direction[id] = uniform(0.0, 1.0) < 0.5 ? -1 : 1;
      const double fastest = axis.kind == AxisKind::linear ? 100.0 : 1.0;  // mm/s, rad/s
      state_.velocity[id] = uniform(-fastest, fastest);
    }
    state_.spindle_rpm = uniform(0.0, 12000.0);
    for (double& T : temperatures_) T = uniform(-5.0, 10.0);
    states_ = {uniform(0.0, 1.0)};
    state_.temperature_K = temperatures_;
    state_.state = states_;
    state_.run = uniform(0.0, 1.0) < 0.5 ? 0 : 1;
    state_.time_s = uniform(0.0, 7200.0);
    return state_;
  }

 private:
  const Machine& machine_;
  std::mt19937_64 random_;
  MachineState state_;
  std::vector<double> temperatures_ = std::vector<double>(5);
  std::vector<double> states_;
};

/// A twist of plausible size: up to 0.1 mm and 300 urad a component.
inline Twist random_twist(RandomStates& random) {
  return {random.vector(0.1), random.vector(3e-4)};
}

inline ChainErrors random_errors(const Machine& machine, RandomStates& random) {
  ChainErrors errors;
  for (AxisId id = 0; id < machine.axes.size(); ++id) errors.joint[id] = random_twist(random);
  errors.spindle = random_twist(random);
  errors.part = random_twist(random);
  return errors;
}

}  // namespace trunnion::test
