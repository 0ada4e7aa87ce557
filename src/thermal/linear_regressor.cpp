#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"
#include "trunnion/thermal/statistics.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class Linear final : public Regressor {
 public:
  Linear(double intercept_mm, VectorXd weight) : intercept_mm_(intercept_mm), weight_(std::move(weight)) {}
  double level_mm(const VectorXd& x) const override { return intercept_mm_ + weight_.dot(x); }
  std::optional<VectorXd> weights_mm() const override { return weight_; }
  config::Table table() const override {
    config::Table out;
    if (intercept_mm_ != 0.0) out.emplace_back("intercept_um", number_value(intercept_mm_ / kMmPerUm));
    out.emplace_back("weights_um", numbers(weight_ / kMmPerUm));
    return out;
  }

 private:
  double intercept_mm_;
  VectorXd weight_;  // mm per unit of the feature
};

// Normal equations of one run: sums over runs are the normal equations of any fold.
struct Normal {
  MatrixXd XX;
  VectorXd Xy;
  double yy = 0.0;
};

double squared_error(const Normal& run, const VectorXd& w) {
  return run.yy - 2.0 * w.dot(run.Xy) + w.dot(run.XX * w);
}

// Ridge penalties in units of the number of rows, features of unit root mean square: from "hardly any" to
// "all zero", two a decade.
std::vector<double> penalties() {
  std::vector<double> out;
  for (int i = -8; i <= 6; ++i) out.push_back(std::pow(10.0, 0.5 * i));
  return out;
}

}  // namespace

TrainingSet rows_of(const TrainingSet& training, const std::vector<std::size_t>& groups, bool inside) {
  std::vector<Index> rows;
  for (std::size_t i = 0; i < training.group.size(); ++i) {
    const bool member = std::find(groups.begin(), groups.end(), training.group[i]) != groups.end();
    if (member == inside) rows.push_back(static_cast<Index>(i));
  }
  TrainingSet out;
  out.from = training.from(rows, Eigen::all);
  out.to = training.to(rows, Eigen::all);
  out.change_mm = training.change_mm(rows);
  out.temperatures = training.temperatures;
  for (const Index row : rows) out.group.push_back(training.group[static_cast<std::size_t>(row)]);
  return out;
}

std::vector<std::vector<std::size_t>> grouped_folds(const TrainingSet& training, std::size_t count) {
  std::vector<std::size_t> groups = training.group;
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  std::vector<std::vector<std::size_t>> folds(std::min(count, groups.size()));
  for (std::size_t i = 0; i < groups.size(); ++i) folds[i % folds.size()].push_back(groups[i]);
  return folds;
}

Result<std::vector<Index>> significant_features(const TrainingSet& training) {
  const auto all = regress(training.to, training.change_mm);
  if (!all) return tl::unexpected(all.error());
  constexpr double kLevel = 0.05;  // the paper's
  std::vector<Index> chosen;
  for (Index j = 0; j < all->p.size(); ++j) {
    if (all->p[j] < kLevel) chosen.push_back(j);
  }
  if (chosen.empty()) {
    Index best = 0;
    all->p.minCoeff(&best);
    chosen.push_back(best);
  }
  return chosen;
}

Result<std::shared_ptr<const Regressor>> fit_ols(const TrainingSet& training) {
  const auto chosen = significant_features(training);
  if (!chosen) return tl::unexpected(chosen.error());
  const auto fit = regress(training.to(Eigen::all, *chosen), training.change_mm);
  if (!fit) return tl::unexpected(fit.error());
  VectorXd weight = VectorXd::Zero(training.to.cols());
  weight(*chosen) = fit->weight;
  return std::make_shared<Linear>(fit->intercept, std::move(weight));
}

Result<std::shared_ptr<const Regressor>> fit_ridge(const TrainingSet& training) {
  const Index p = training.to.cols();
  const MatrixXd X = training.to - training.from;
  const auto n = static_cast<double>(X.rows());
  const auto folds = grouped_folds(training, training.group.size());
  if (folds.size() < 2 || p == 0)
    return fail(ErrorCode::wrong_input, "ridge needs features and at least two runs");
  VectorXd scale = (X.colwise().squaredNorm().transpose() / n).cwiseSqrt();
  // A feature that never moved has no weight.
  for (Index j = 0; j < p; ++j) {
    if (!(scale[j] > 0.0)) scale[j] = 1.0;
  }
  const MatrixXd Z = X * scale.cwiseInverse().asDiagonal();
  std::vector<Normal> runs;
  Normal total{MatrixXd::Zero(p, p), VectorXd::Zero(p), 0.0};
  for (const auto& fold : folds) {
    std::vector<Index> rows;
    for (std::size_t i = 0; i < training.group.size(); ++i) {
      if (training.group[i] == fold.front()) rows.push_back(static_cast<Index>(i));
    }
    const MatrixXd Zr = Z(rows, Eigen::all);
    const VectorXd yr = training.change_mm(rows);
    runs.push_back({Zr.transpose() * Zr, Zr.transpose() * yr, yr.squaredNorm()});
    total.XX += runs.back().XX;
    total.Xy += runs.back().Xy;
  }
  const auto solve = [p](const MatrixXd& XX, const VectorXd& Xy, double penalty) -> VectorXd {
    return Cholesky(XX + penalty * MatrixXd::Identity(p, p)).solve(Xy);
  };
  double best_penalty = 0.0;
  double best = std::numeric_limits<double>::infinity();
  for (const double penalty : penalties()) {
    double error = 0.0;
    for (const Normal& run : runs) {
      error += squared_error(run, solve(total.XX - run.XX, total.Xy - run.Xy, penalty * n));
    }
    if (error < best) {
      best = error;
      best_penalty = penalty;
    }
  }
  const VectorXd w = solve(total.XX, total.Xy, best_penalty * n);
  return std::make_shared<Linear>(0.0, w.cwiseQuotient(scale));
}

config::Value numbers(const VectorXd& values) {
  config::Array out;
  for (const double v : values) out.push_back({v, {}});
  return {std::move(out), {}};
}

VectorXd read_numbers(config::Section& section, std::string_view key, std::size_t size) {
  const auto found = section.find_numbers(key);
  if (!found || found->size() != size) {
    section.error(key, "'" + std::string(key) + "' must have " + std::to_string(size) + " numbers" +
                           (found ? ", not " + std::to_string(found->size()) : std::string()));
    return VectorXd::Zero(static_cast<Index>(size));
  }
  return Eigen::Map<const VectorXd>(found->data(), static_cast<Index>(size));
}

std::shared_ptr<const Regressor> linear_regressor(double intercept_mm, VectorXd weight_mm) {
  return std::make_shared<const Linear>(intercept_mm, std::move(weight_mm));
}

std::shared_ptr<const Regressor> read_linear(std::size_t features, config::Section& section) {
  const double intercept_mm = section.quantity_or("intercept_um", 0.0);
  return std::make_shared<Linear>(intercept_mm, read_numbers(section, "weights_um", features));
}

}  // namespace trunnion::thermal
