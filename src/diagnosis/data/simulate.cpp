#include <cmath>
#include <random>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/effects/deviation.hpp"

namespace trunnion::diagnosis {
namespace {

// std::normal_distribution may differ between libraries; the same seed must give the same bytes everywhere.
class NormalDraws {
 public:
  explicit NormalDraws(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }  // in (0, 1), 53 bits
  double operator()() {
    const double r = std::sqrt(-2.0 * std::log(uniform()));
    return r * std::cos(kTwoPi * uniform());  // Box and Muller 1958
  }

 private:
  std::mt19937_64 engine_;
};

double quantised(double value, double step) {
  return step > 0.0 ? std::round(value / step) * step : value;
}

// What the noiseless machine shows at every reading.
std::vector<double> true_values(const Dataset& data, const Machine& machine, const Model& truth,
                                const std::vector<Vec3>& setup_P) {
  const ModelEvaluator evaluator(truth);
  std::vector<std::vector<double>> lags;
  for (const LagRequest& request : evaluator.lags()) lags.push_back(data.track.lag(request));
  std::vector<double> out, lagged(lags.size());
  for (const Reading& reading : data.readings) {
    const MachineState state = data.track.state(reading.row);
    for (std::size_t k = 0; k < lags.size(); ++k) lagged[k] = lags[k][reading.row];
    ChainErrors errors = evaluator.errors(state, lagged);
    const DeviationMap map(machine, state.q, data.rows[reading.row].tool_mm);
    const Deviation actual = map.exact_M(errors) + map.setup_translation_M(setup_P[state.run]);
    const Vec3 n_M = reading.frame == SensitivityFrame::part ? Vec3(map.R_MP() * reading.n) : reading.n;
    out.push_back(
        n_M.dot(reading.quantity == Quantity::displacement ? actual.displacement_mm : actual.rotation_rad));
  }
  return out;
}

}  // namespace

void simulate(Dataset& data, const Plan& plan, const Machine& machine, const Model& truth,
              std::uint64_t seed) {
  TRUNNION_EXPECTS(plan.runs.size() == data.context.runs.size());
  NormalDraws normal(seed);
  const SimulationNoise& noise = plan.noise;
  std::vector<Vec3> setup_P;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const double x = normal(), y = normal(), z = normal();
    setup_P.push_back(noise.setup_mm * Vec3(x, y, z));
  }
  const std::vector<double> values = true_values(data, machine, truth, setup_P);
  std::vector<double> offset(data.group_count), drift(data.group_count), last(data.group_count);
  std::vector<bool> started(data.group_count, false);
  const double rho = noise.autocorrelation;
  for (std::size_t i = 0; i < values.size(); ++i) {
    Reading& reading = data.readings[i];
    const std::size_t run = data.run_of(reading), g = reading.group;
    const bool displacement = reading.quantity == Quantity::displacement;
    const double innovation = normal();
    if (!started[g]) {
      offset[g] = plan.runs[run].u_common * normal();
      drift[g] = displacement ? noise.drift_mm_per_s * (normal() < 0.0 ? -1.0 : 1.0) : 0.0;
      last[g] = innovation;
      started[g] = true;
    } else {
      last[g] = rho * last[g] + std::sqrt(1.0 - rho * rho) * innovation;
    }
    double value = values[i] + offset[g] + drift[g] * data.track.state(reading.row).time_s +
                   last[g] * reading.u_random * noise.noise_factor;
    if (noise.outlier_fraction > 0.0 && normal.uniform() < noise.outlier_fraction)
      value += (normal() < 0.0 ? -1.0 : 1.0) * noise.outlier_scale * reading.u_random;
    reading.value = quantised(value, displacement ? noise.resolution_mm : noise.resolution_rad);
  }
}

}  // namespace trunnion::diagnosis
