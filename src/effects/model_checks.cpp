#include "effects/model_checks.hpp"

#include <cmath>
#include <random>

#include "trunnion/base/number_text.hpp"

namespace trunnion::effects {

void check_sizes(config::Section& parameters, const ModelEffect& entry) {
  for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
    const Parameter& p = entry.effect->info().parameters[k];
    const double printed = entry.parameters[k].value / unit_factor(p.unit);
    if (!entry.parameters[k].given || std::abs(printed) <= largest_value(p.unit)) continue;
    parameters.error(p.key(), "'" + p.key() + "' is " + shortest_text(printed) +
                                  ", beyond what any machine has (" + shortest_text(largest_value(p.unit)) +
                                  "): is it in another unit?");
  }
}

void try_out(config::Section& s, const ModelEffect& entry, const Machine& machine,
             const EffectContext& context) {
  constexpr int kTrials = 8;
  std::mt19937_64 random(20261122);
  const auto draw = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  std::vector<double> lagged(entry.effect->lags(entry.shape()).size());
  std::vector<double> temperatures(context.names.temperatures.size());
  std::vector<double> states(context.names.states.size());
  for (int trial = 0; trial < kTrials; ++trial) {
    MachineState state;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const Axis& axis = machine.axes[id];
      state.q[id] = axis.has_limits() ? draw(axis.min, axis.max) : draw(-3.0, 3.0);
      state.velocity[id] = draw(-10.0, 10.0);
      state.direction[id] = trial % 2 == 0 ? 1 : -1;
    }
    state.spindle_rpm = draw(500.0, 9000.0);
    state.time_s = draw(10.0, 5000.0);
    for (auto* values : {&temperatures, &states, &lagged})
      for (double& v : *values) v = draw(0.2, 5.0);
    state.temperature_K = temperatures;
    state.state = states;
    const Twist twist = entry.effect->twist(state, lagged, entry.values());
    if (twist.trans_mm.allFinite() && twist.rot_rad.allFinite()) return;
  }
  s.error(entry.id().starts_with("user:") ? "expression" : "parameters",
          "effect '" + entry.id() + "' gives no number at any of " + std::to_string(kTrials) +
              " positions within the travel");
}

}  // namespace trunnion::effects
