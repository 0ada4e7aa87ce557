#include <algorithm>
#include <cmath>

#include "diagnosis/verdict/unrecorded.hpp"

// A part of the machine that moves, or bends along its axis, with a temperature or with the difference of
// two: in runs that were each measured at one temperature every run has a tilt of its own, which passed for
// its set-up.
namespace trunnion::diagnosis {
namespace {

constexpr double kLeastSpan_K = 0.3;          // of a signal over all readings: less is no cause
constexpr double kWay_mm = 100.0;             // from the middle of the travel
constexpr double kLargestPerKelvin_mm = 0.1;  // per kelvin: ten times what steel of a metre does
constexpr double kLargestPerKelvin_rad =
    2e-4;  // per kelvin: a column of 1 m in 200 mm with 11 um/(m K), four times

struct Signal_K {
  std::string name;
  VectorXd values;
};

std::vector<Signal_K> signals(const Observations& o) {
  const auto& names = o.data().context.names.temperatures;
  std::vector<Signal_K> out;
  const auto add = [&](const std::string& name, VectorXd values) {
    if (values.maxCoeff() - values.minCoeff() > kLeastSpan_K) out.push_back({name, std::move(values)});
  };
  std::vector<VectorXd> all;
  for (std::size_t s = 0; s < names.size(); ++s) {
    VectorXd values(o.size());
    for (Eigen::Index i = 0; i < o.size(); ++i) values[i] = o.state(i).temperature(s);
    all.push_back(std::move(values));
  }
  for (std::size_t a = 0; a < names.size(); ++a) {
    add("T_" + names[a], all[a]);
    for (std::size_t b = a + 1; b < names.size(); ++b)
      add("T_" + names[a] + " - T_" + names[b], all[a] - all[b]);
  }
  return out;
}

// Translations and rotations of the joint by the signal; the same along its axis.
MatrixXd following(const Observations& o, AxisId axis, const VectorXd& signal) {
  const bool linear = o.machine().axes[axis].kind == AxisKind::linear;
  const MatrixXd& response = o.response(axis);
  MatrixXd out(o.size(), linear ? 12 : 6);
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    out.row(i).head<6>() = response.row(i) * signal[i];
    if (linear) out.row(i).tail<6>() = response.row(i) * (signal[i] * o.state(i).q[axis] / kWay_mm);
  }
  return out;
}

bool is_of_setup(const ModelEffect& effect) {
  return effect.effect->info().kind == EffectClass::setup && !is_step(effect);
}

}  // namespace

std::vector<UnrecordedCondition> temperature_gradients(const Observations& o) {
  std::vector<UnrecordedCondition> out;
  VectorXd one_joint(6);
  one_joint << VectorXd::Constant(3, kLargestPerKelvin_mm), VectorXd::Constant(3, kLargestPerKelvin_rad);
  for (const Signal_K& signal : signals(o))
    for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis) {
      UnrecordedCondition one;
      one.kind = ConditionKind::gradient;
      one.what =
          "a shift, tilt or bend of joint " + o.machine().axes[axis].name + " that follows " + signal.name;
      one.remedy = "Measure once more at another temperature, and write it as a formula in the model file.";
      one.covariate = signal.name;
      one.stands_for = is_of_setup;
      one.columns = [&o, axis, values = signal.values](double) { return following(o, axis, values); };
      const Eigen::Index times = o.machine().axes[axis].kind == AxisKind::linear ? 2 : 1;
      one.largest = one_joint.replicate(times, 1);
      out.push_back(std::move(one));
    }
  return out;
}

}  // namespace trunnion::diagnosis
