#include <algorithm>
#include <cmath>

#include "diagnosis/verdict/unrecorded.hpp"

// A spindle that grows by another law than the library's, which is proportional to its speed through one lag.
// A step at some moment, a drift or the temperature of a sensor stood for the rest of it.
namespace trunnion::diagnosis {
namespace {

constexpr double kLargestGrowth_mm = 0.5;  // in the end, at the usual speed: ten times what spindles do
constexpr double kUsual_rpm = 10'000.0;    // the usual speed: all powers of it are as large there

bool stands_beside_growth(const ModelEffect& effect) {
  return effect.id() != "spindle_growth" &&
         (is_step(effect) || is_thermal(effect) || may_come_of_order(effect));
}
bool stands_for_growth(const ModelEffect& effect) {
  return is_step(effect) || is_thermal(effect) || may_come_of_order(effect);
}

bool speed_varies(const Observations& o) {
  for (std::size_t row = 0; row < o.data().track.size(); ++row)
    if (o.data().track.state(row).spindle_rpm != o.data().track.state(0).spindle_rpm) return true;
  return false;
}

// The spindle's translations along Z and Y by a power of its speed through one lag; 1 in the end at the usual
// speed.
MatrixXd growth(const Observations& o, double power, double tau_s) {
  std::vector<MachineState> states;
  states.reserve(o.data().track.size());
  for (std::size_t row = 0; row < o.data().track.size(); ++row) {
    states.push_back(o.data().track.state(row));
    double& rpm = states.back().spindle_rpm;
    rpm = kUsual_rpm * std::pow(std::abs(rpm) / kUsual_rpm, power);
  }
  const StateTrack track(states);
  const std::vector<double> lagged = track.lag({{Signal::Kind::spindle_rpm, 0}, tau_s});
  const MatrixXd& spindle = o.response(o.link_count() - 2);
  MatrixXd out(o.size(), 2);
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const double of_reading = lagged[o.reading(i).row] / kUsual_rpm;
    out(i, 0) = spindle(i, 2) * of_reading;
    out(i, 1) = spindle(i, 1) * of_reading;
  }
  return out;
}

}  // namespace

std::vector<UnrecordedCondition> growth_laws(const Observations& o) {
  std::vector<UnrecordedCondition> out;
  if (!speed_varies(o)) return out;
  const auto add = [&](double power, const std::string& law, bool (*stands_for)(const ModelEffect&)) {
    UnrecordedCondition one;
    one.kind = ConditionKind::law;
    one.what = "a growth of the spindle " + law;
    one.remedy =
        "Let the spindle run at three speeds and more, each until nothing moves, then stand, and measure its "
        "growth alone.";
    one.covariate = "rpm";
    one.goes_with_time = one.steady_is_known = true;
    one.stands_for = stands_for;
    one.columns = [&o, power](double tau_s) { return growth(o, power, tau_s); };
    one.largest = VectorXd::Constant(2, kLargestGrowth_mm);
    out.push_back(std::move(one));
  };
  add(1.0, "with its speed by a second time constant", stands_beside_growth);
  add(2.0, "with the square of its speed", stands_for_growth);
  add(0.5, "with the root of its speed", stands_for_growth);
  return out;
}

}  // namespace trunnion::diagnosis
