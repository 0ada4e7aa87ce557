#include "diagnosis/search/covariates.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "trunnion/base/units.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kFullTurn = 200.0 * kRadPerDegree;  // range beyond which a rotary axis gets harmonics

}  // namespace

std::size_t distinct_values(const VectorXd& v, std::size_t limit) {
  const double low = v.minCoeff(), range = v.maxCoeff() - low;
  std::set<std::int64_t> seen;
  if (!(range > 1e-9)) return 1;
  for (const double x : v) {
    seen.insert(std::llround((x - low) / range * 1e6));
    if (seen.size() > limit) break;
  }
  return seen.size();
}

std::vector<double> places_between(const VectorXd& v, int most) {
  std::vector<double> sorted(v.begin(), v.end());
  std::sort(sorted.begin(), sorted.end());
  const double close = 1e-6 * (sorted.back() - sorted.front());
  sorted.erase(std::unique(sorted.begin(), sorted.end(), [&](double a, double b) { return b - a <= close; }),
               sorted.end());
  std::vector<double> out;
  const double stride = std::max(1.0, static_cast<double>(sorted.size() - 1) / most);
  for (double at = 0.5 * stride; at < static_cast<double>(sorted.size()) - 1.0; at += stride) {
    const auto k = static_cast<std::size_t>(at);
    out.push_back(0.5 * (sorted[k] + sorted[k + 1]));
  }
  return out;
}

MatrixXd functions(const Covariate& c, int degree) {
  const int count = std::min<int>(degree, static_cast<int>(c.distinct) - 1);
  const double low = c.values.minCoeff(), high = c.values.maxCoeff();
  if (c.periodic) {
    const int harmonics =
        std::min(std::max(1, degree * kHarmonics / kFullDegree), static_cast<int>(c.distinct) / 2);
    MatrixXd out(c.values.size(), Eigen::Index{2} * harmonics);
    for (int k = 0; k < harmonics; ++k) {
      const Eigen::Index column = Eigen::Index{2} * k;
      out.col(column) = ((k + 1) * c.values.array()).cos();
      out.col(column + 1) = ((k + 1) * c.values.array()).sin();
    }
    return out;
  }
  MatrixXd out(c.values.size(), std::max(count, 0));
  const VectorXd x = (2.0 * (c.values.array() - low) / (high - low) - 1.0).matrix();
  VectorXd before = VectorXd::Ones(x.size()), now = x;
  for (int k = 0; k < count; ++k) {
    out.col(k) = now;
    const double n = k + 1;
    const VectorXd next =
        ((2.0 * n + 1.0) * x.cwiseProduct(now) - n * before) / (n + 1.0);  // Bonnet's recursion
    before = now;
    now = next;
  }
  return out;
}

MatrixXd harmonic(const Covariate& c, int k) {
  MatrixXd out(c.values.size(), 2);
  out.col(0) = (k * c.values.array()).cos();
  out.col(1) = (k * c.values.array()).sin();
  return out;
}

MatrixXd waves(const Covariate& c, int count) {
  if (c.periodic) return functions(c, count);
  const int most = std::min(count, static_cast<int>(c.distinct) - 1);
  const double low = c.values.minCoeff(), range = c.values.maxCoeff() - low;
  MatrixXd out(c.values.size(), std::max(most, 0));
  for (int k = 0; k < most; ++k) out.col(k) = ((k + 1) * kPi / range * (c.values.array() - low)).cos();
  return out;
}

Covariate covariate(const Observations& o, std::string name,
                    const std::function<double(const MachineState&)>& value) {
  Covariate c{std::move(name), VectorXd(o.size()), false, 0};
  for (Eigen::Index i = 0; i < o.size(); ++i) c.values[i] = value(o.state(i));
  c.distinct = distinct_values(c.values, 40);
  return c;
}

std::vector<Covariate> axis_covariates(const Observations& o) {
  std::vector<Covariate> out;
  const auto& axes = o.machine().axes;
  for (AxisId a = 0; a < axes.size(); ++a) {
    out.push_back(covariate(o, axes[a].name, [a](const MachineState& s) { return s.q[a]; }));
    Covariate& c = out.back();
    c.periodic = axes[a].kind == AxisKind::rotary && c.values.maxCoeff() - c.values.minCoeff() > kFullTurn;
  }
  std::erase_if(out, [](const Covariate& c) { return c.distinct < 2; });
  return out;
}

std::vector<Covariate> state_covariates(const Observations& o) {
  std::vector<Covariate> out;
  out.push_back(covariate(o, "time", [](const MachineState& s) { return s.time_s; }));
  out.push_back(covariate(o, "spindle speed", [](const MachineState& s) { return s.spindle_rpm; }));
  const auto& names = o.data().context.names;
  for (std::size_t k = 0; k < names.temperatures.size(); ++k)
    out.push_back(
        covariate(o, "T_" + names.temperatures[k], [k](const MachineState& s) { return s.temperature(k); }));
  for (std::size_t k = 0; k < names.states.size(); ++k)
    out.push_back(
        covariate(o, "s_" + names.states[k], [k](const MachineState& s) { return s.free_state(k); }));
  const auto& axes = o.machine().axes;
  for (AxisId a = 0; a < axes.size(); ++a)
    out.push_back(
        covariate(o, "velocity of " + axes[a].name, [a](const MachineState& s) { return s.velocity[a]; }));
  Covariate tool{"tool length", VectorXd(o.size()), false, 0};
  for (Eigen::Index i = 0; i < o.size(); ++i) tool.values[i] = o.data().rows[o.reading(i).row].tool_mm.z();
  tool.distinct = distinct_values(tool.values, 40);
  out.push_back(std::move(tool));
  std::erase_if(out, [](const Covariate& c) { return c.distinct < 2; });
  return out;
}

}  // namespace trunnion::diagnosis
