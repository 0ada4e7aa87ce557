#include "trunnion/thermal/screening.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <set>

#include "trunnion/geom/linear_algebra.hpp"

#include "thermal/bench.hpp"
#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Set = std::set<Index>;

constexpr double kLevel = 0.05;  // the paper's

std::vector<std::size_t> everything(std::size_t n) {
  std::vector<std::size_t> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = i;
  return out;
}

// Leave-one-run-out RMSE of least squares without intercept on some columns; a little ridge keeps dependent
// columns solvable.
double held_out_rmse(const TrainingSet& set, const std::vector<Index>& columns) {
  double sum = 0.0;
  for (const auto& fold : grouped_folds(set, set.group.size())) {
    const TrainingSet inside = rows_of(set, fold, false);
    const TrainingSet outside = rows_of(set, fold, true);
    if (columns.empty()) {
      sum += outside.change_mm.squaredNorm();
      continue;
    }
    const MatrixXd X = inside.to(Eigen::all, columns);
    MatrixXd XX = X.transpose() * X;
    XX.diagonal().array() += 1e-6 * (XX.trace() + 1e-12);
    const VectorXd w = solve_positive(XX, X.transpose() * inside.change_mm);
    sum += (outside.to(Eigen::all, columns) * w - outside.change_mm).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(set.to.rows()));
}

// Adds the sensor that lowers the held-out error most until none lowers it by two per cent.
std::vector<Index> forward_selection(const TrainingSet& set) {
  constexpr double kGain = 0.98;
  std::vector<Index> chosen;
  double error = held_out_rmse(set, chosen);
  while (static_cast<Index>(chosen.size()) < set.to.cols()) {
    double least = error * kGain;
    Index best = -1;
    for (Index j = 0; j < set.to.cols(); ++j) {
      if (std::find(chosen.begin(), chosen.end(), j) != chosen.end()) continue;
      auto with = chosen;
      with.push_back(j);
      const double e = held_out_rmse(set, with);
      if (e < least) {
        least = e;
        best = j;
      }
    }
    if (best < 0) return chosen;
    chosen.push_back(best);
    error = least;
  }
  return chosen;
}

std::optional<Set> chosen_by_p(const TrainingSet& set) {
  const auto fit = regress(set.to, set.change_mm);
  if (!fit) return std::nullopt;
  Set out;
  for (Index j = 0; j < fit->p.size(); ++j) {
    if (fit->p[j] < kLevel) out.insert(j);
  }
  return out;
}

double jaccard(const Set& a, const Set& b) {
  std::vector<Index> both, any;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(any));
  return any.empty() ? 1.0 : static_cast<double>(both.size()) / static_cast<double>(any.size());
}

// How much the set that p chooses depends on which run is left out.
void stability(const TrainingSet& set, ChannelScreen& out) {
  std::vector<Set> sets;
  for (const auto& fold : grouped_folds(set, set.group.size())) {
    if (auto chosen = chosen_by_p(rows_of(set, fold, false))) sets.push_back(std::move(*chosen));
  }
  double sum = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    for (const Index j : sets[i])
      out.sensors[static_cast<std::size_t>(j)].share_of_folds += 1.0 / static_cast<double>(sets.size());
    for (std::size_t k = i + 1; k < sets.size(); ++k, pairs += 1.0) sum += jaccard(sets[i], sets[k]);
  }
  if (pairs > 0.0) out.p_jaccard = sum / pairs;
}

void add_warnings(const TrainingSet& set, ChannelScreen& out) {
  const auto count = [&](auto condition) {
    return std::count_if(out.sensors.begin(), out.sensors.end(), condition);
  };
  if (!out.no_regression.empty()) out.warnings.push_back("no p-values: " + out.no_regression);
  const auto differ = count([](const SensorScreen& s) { return s.chosen_by_p != s.chosen_by_runs; });
  if (out.no_regression.empty() && differ > 0) {
    out.warnings.push_back("p < 0.05 and held-out runs disagree on " + std::to_string(differ) + " of " +
                           std::to_string(out.sensors.size()) +
                           " sensors: the held-out choice predicts new runs");
  }
  constexpr double kInflated =
      10.0;  // the usual rule: a coefficient's standard error is then three times what it could be
  const auto inflated = count([](const SensorScreen& s) { return s.variance_inflation > kInflated; });
  if (inflated > 0) {
    out.warnings.push_back(std::to_string(inflated) +
                           " sensors have a variance inflation above 10: they are collinear, and which of "
                           "them appears significant is chance");
  }
  if (out.p_jaccard < 0.8) out.warnings.push_back("the set chosen by p changes when one run is left out");
  if (set.to.rows() > 0) {
    out.warnings.push_back(
        "normality of a temperature says nothing about its use: regression needs normal residuals, not "
        "normal regressors");
  }
}

ChannelScreen screen_channel(const Log& log, std::size_t channel, double measure_every_s) {
  ChannelBench bench(log, channel, measure_every_s);
  const TrainingSet set = bench.training(Method::ols, false, everything(bench.runs().size()));
  ChannelScreen out;
  out.channel = log.channels[channel];
  out.measurements = static_cast<std::size_t>(set.to.rows());
  out.runs = bench.runs().size();
  out.condition = condition_number(set.to);
  const VectorXd vif = variance_inflation(set.to);
  const auto fit = regress(set.to, set.change_mm);
  if (!fit) out.no_regression = fit.error().message;
  const auto by_runs = forward_selection(set);
  std::vector<Index> by_p, all;
  for (Index j = 0; j < set.to.cols(); ++j) {
    SensorScreen s;
    s.sensor = log.sensors[static_cast<std::size_t>(j)];
    std::vector<double> readings(set.to.col(j).begin(), set.to.col(j).end());
    if (const auto normality = shapiro_wilk(readings)) s.normality = *normality;
    if (fit) s.p = fit->p[j];
    s.variance_inflation = vif[j];
    s.chosen_by_p = fit && fit->p[j] < kLevel;
    s.chosen_by_runs = std::find(by_runs.begin(), by_runs.end(), j) != by_runs.end();
    if (s.chosen_by_p) by_p.push_back(j);
    all.push_back(j);
    out.sensors.push_back(std::move(s));
  }
  out.heldout_all_mm = held_out_rmse(set, all);
  out.heldout_p_mm = held_out_rmse(set, by_p);
  out.heldout_runs_mm = held_out_rmse(set, by_runs);
  stability(set, out);
  add_warnings(set, out);
  return out;
}

}  // namespace

Result<std::vector<ChannelScreen>> screen(const Log& log, const std::vector<std::string>& targets,
                                          double measure_every_s) {
  if (log.sensors.empty())
    return fail(ErrorCode::wrong_input,
                "the log has no temperature (T_<name>_degC), or none that can be used", log.file);
  std::vector<ChannelScreen> out;
  for (const std::string& target : targets.empty() ? log.channels : targets) {
    const auto channel = log.channel(target);
    if (!channel)
      return fail(ErrorCode::wrong_input,
                  "the log has no channel '" + target + "' (column " + target + "_um)", log.file);
    if (ChannelBench(log, *channel, measure_every_s).runs().size() < 2)
      return fail(ErrorCode::wrong_input, "channel '" + target + "' was measured in fewer than two runs",
                  log.file);
    out.push_back(screen_channel(log, *channel, measure_every_s));
  }
  if (out.empty())
    return fail(ErrorCode::wrong_input, "the log has no measured channel (<channel>_um)", log.file);
  return out;
}

}  // namespace trunnion::thermal
