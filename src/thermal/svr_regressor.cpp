#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <svm.h>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Support vector regression in standardised features and target: f(x) = mean + sd (sum_i a_i exp(-gamma |z -
// z_i|^2) - rho).
struct SvrParts {
  VectorXd feature_mean, feature_scale;  // of all features; those that are not used have scale 0
  MatrixXd support;                      // one row each, standardised
  VectorXd coefficient;
  double gamma = 1.0;
  double rho = 0.0;
  double mean_mm = 0.0;
  double sd_mm = 1.0;
};

VectorXd standardise(const SvrParts& parts, const VectorXd& x) {
  return (x - parts.feature_mean).cwiseProduct(parts.feature_scale);
}

class Svr final : public Regressor {
 public:
  explicit Svr(SvrParts parts) : parts_(std::move(parts)) {}

  double level_mm(const VectorXd& x) const override {
    const VectorXd z = standardise(parts_, x);
    double sum = -parts_.rho;
    for (Index i = 0; i < parts_.support.rows(); ++i) {
      sum += parts_.coefficient[i] *
             std::exp(-parts_.gamma * (z - parts_.support.row(i).transpose()).squaredNorm());
    }
    return parts_.mean_mm + parts_.sd_mm * sum;
  }

  config::Table table() const override {
    config::Table out;
    out.emplace_back("feature_mean", numbers(parts_.feature_mean));
    out.emplace_back("feature_scale", numbers(parts_.feature_scale));
    out.emplace_back("gamma", number_value(parts_.gamma));
    out.emplace_back("rho", number_value(parts_.rho));
    out.emplace_back("mean_um", number_value(parts_.mean_mm / kMmPerUm));
    out.emplace_back("sd_um", number_value(parts_.sd_mm / kMmPerUm));
    out.emplace_back("coefficients", numbers(parts_.coefficient));
    out.emplace_back("support", matrix_value(parts_.support));
    return out;
  }

 private:
  SvrParts parts_;
};

struct SvrSetting {
  double C = 1.0;
  double gamma = 1.0;
};

// libsvm's view of the training rows: nodes of each row end with index -1 (README of libsvm).
class Problem {
 public:
  Problem(const MatrixXd& Z, const VectorXd& y) : target_(y.data(), y.data() + y.size()) {
    const auto width = static_cast<std::size_t>(Z.cols()) + 1;
    nodes_.resize(static_cast<std::size_t>(Z.rows()) * width);
    for (Index i = 0; i < Z.rows(); ++i) {
      svm_node* row = nodes_.data() + static_cast<std::size_t>(i) * width;
      for (Index j = 0; j < Z.cols(); ++j) row[j] = {static_cast<int>(j + 1), Z(i, j)};
      row[Z.cols()] = {-1, 0.0};
      rows_.push_back(row);
    }
    problem_ = {static_cast<int>(Z.rows()), target_.data(), rows_.data()};
  }
  const svm_problem& get() const { return problem_; }
  /// Number of the training row to which a support vector points.
  Index row_of(const svm_node* node) const {
    return static_cast<Index>(std::find(rows_.begin(), rows_.end(), node) - rows_.begin());
  }

 private:
  std::vector<double> target_;
  std::vector<svm_node> nodes_;
  std::vector<svm_node*> rows_;
  svm_problem problem_{};
};

SvrParts train(const MatrixXd& X, const VectorXd& y, const std::vector<Index>& chosen,
               const SvrSetting& setting) {
  SvrParts out;
  out.feature_mean = X.colwise().mean().transpose();
  out.feature_scale = VectorXd::Zero(X.cols());
  for (const Index j : chosen) {
    const double sd = std::sqrt((X.col(j).array() - out.feature_mean[j]).square().mean());
    out.feature_scale[j] = sd > 0.0 ? 1.0 / sd : 0.0;
  }
  out.mean_mm = y.mean();
  out.sd_mm = std::max(std::sqrt((y.array() - out.mean_mm).square().mean()), 1e-9);
  out.gamma = setting.gamma / static_cast<double>(chosen.size());
  const MatrixXd Z = (X.rowwise() - out.feature_mean.transpose()) * out.feature_scale.asDiagonal();
  const VectorXd target = (y.array() - out.mean_mm) / out.sd_mm;
  const Problem problem(Z, target);
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = out.gamma;
  parameter.C = setting.C;
  parameter.p = 0.05;  // tube of a twentieth of the target's standard deviation: about the noise of a
                       // displacement sensor
  parameter.eps = 1e-3;
  parameter.cache_size = 20.0;  // MB
  parameter.shrinking = 1;
  TRUNNION_EXPECTS(svm_check_parameter(&problem.get(), &parameter) == nullptr);
  svm_set_print_string_function([](const char*) {});
  const auto release = [](svm_model* model) { svm_free_and_destroy_model(&model); };
  // The model's support vectors point into `problem`: all is copied out while it lives.
  const std::unique_ptr<svm_model, decltype(release)> model(svm_train(&problem.get(), &parameter), release);
  out.support.resize(model->l, X.cols());
  out.coefficient.resize(model->l);
  for (int i = 0; i < model->l; ++i) {
    out.support.row(i) = Z.row(problem.row_of(model->SV[i]));
    out.coefficient[i] = model->sv_coef[0][i];
  }
  out.rho = model->rho[0];
  return out;
}

}  // namespace

Result<std::shared_ptr<const Regressor>> fit_svr(const TrainingSet& training, bool significant_only) {
  std::vector<Index> chosen;
  if (significant_only) {
    auto significant = significant_features(training);
    if (!significant) return tl::unexpected(significant.error());
    chosen = std::move(*significant);
  } else {
    for (Index j = 0; j < training.to.cols(); ++j) chosen.push_back(j);
  }
  const auto folds = grouped_folds(training, 5);
  if (folds.size() < 2 || chosen.empty())
    return fail(ErrorCode::wrong_input, "svr needs features and at least two runs");
  constexpr std::array kC = {1.0, 10.0, 100.0};
  constexpr std::array kGamma = {0.1, 0.5, 2.0};  // over the number of features, standardised
  SvrSetting best;
  double least = std::numeric_limits<double>::infinity();
  for (const double C : kC) {
    for (const double gamma : kGamma) {
      double error = 0.0;
      for (const auto& fold : folds) {
        const TrainingSet inside = rows_of(training, fold, false);
        const TrainingSet outside = rows_of(training, fold, true);
        const Svr svr(train(inside.to, inside.change_mm, chosen, {C, gamma}));
        for (Index i = 0; i < outside.to.rows(); ++i) {
          error += std::pow(svr.level_mm(outside.to.row(i).transpose()) - outside.change_mm[i], 2);
        }
      }
      if (error < least) {
        least = error;
        best = {C, gamma};
      }
    }
  }
  return std::make_shared<Svr>(train(training.to, training.change_mm, chosen, best));
}

std::shared_ptr<const Regressor> read_svr(std::size_t features, config::Section& section) {
  SvrParts parts;
  parts.feature_mean = read_numbers(section, "feature_mean", features);
  parts.feature_scale = read_numbers(section, "feature_scale", features);
  parts.gamma = section.find_number("gamma").value_or(1.0);
  parts.rho = section.find_number("rho").value_or(0.0);
  parts.mean_mm = section.quantity("mean_um");
  parts.sd_mm = section.quantity("sd_um");
  const auto coefficients = section.find_numbers("coefficients").value_or(std::vector<double>{});
  parts.coefficient =
      Eigen::Map<const VectorXd>(coefficients.data(), static_cast<Index>(coefficients.size()));
  parts.support = read_matrix(section, "support", coefficients.size(), features);
  return std::make_shared<Svr>(std::move(parts));
}

}  // namespace trunnion::thermal
