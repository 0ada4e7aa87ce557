#include <Eigen/Core>
#include <array>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Covariance of f at scaled features a, b: s^2 [a.b / p + r exp(-|a-b|^2 / (2 l^2 p))]. Only differences of f
// are used, so that f is zero at the reference state. The overall s^2 is factored out.
struct Kernel {
  double rbf = 1.0;     // r
  double length = 1.0;  // l
  double noise = 0.1;   // variance of a change over s^2
};

// One change: features scaled to unit root mean square over the training.
struct Pairs {
  MatrixXd from, to;
};

MatrixXd linear_covariance(const Pairs& a, const Pairs& b) {
  return (a.to - a.from) * (b.to - b.from).transpose() / static_cast<double>(a.to.cols());
}

// The radial part for r = 1.
MatrixXd radial_covariance(const Pairs& a, const Pairs& b, double length) {
  const double scale = -0.5 / (length * length * static_cast<double>(a.to.cols()));
  const auto radial = [scale](const MatrixXd& u, const MatrixXd& v) -> MatrixXd {
    MatrixXd d = -2.0 * u * v.transpose();
    d.colwise() += u.rowwise().squaredNorm();
    d.rowwise() += v.rowwise().squaredNorm().transpose();
    return (scale * d.array().max(0.0)).exp();
  };
  return radial(a.to, b.to) - radial(a.to, b.from) - radial(a.from, b.to) + radial(a.from, b.from);
}

// Covariances of the changes of `a` with those of `b`: differences of f, so that f's unknown level cancels.
MatrixXd covariance(const Pairs& a, const Pairs& b, const Kernel& kernel) {
  MatrixXd K = linear_covariance(a, b);
  if (kernel.rbf > 0.0) K += kernel.rbf * radial_covariance(a, b, kernel.length);
  return K;
}

// -log p(changes) but for a constant, the overall variance solved for.
double minus_log_likelihood(MatrixXd K, double noise, const VectorXd& change_mm) {
  K.diagonal().array() += noise;
  const Cholesky solver(K);
  const double variance = change_mm.dot(solver.solve(change_mm)) / static_cast<double>(change_mm.size());
  return 0.5 * static_cast<double>(change_mm.size()) * std::log(variance) + solver.log_determinant_of_lower();
}

class Gp final : public Regressor {
 public:
  Gp(VectorXd scale, Pairs training, VectorXd change_mm, const Kernel& kernel)
      : scale_(std::move(scale)),
        training_(std::move(training)),
        change_mm_(std::move(change_mm)),
        kernel_(kernel) {
    MatrixXd K = covariance(training_, training_, kernel_);
    K.diagonal().array() += kernel_.noise;
    solver_.emplace(K);
    alpha_ = solver_->solve(change_mm_);
    variance_mm2_ = change_mm_.dot(alpha_) / static_cast<double>(change_mm_.size());
  }

  double level_mm(const VectorXd& x) const override { return change_mm(VectorXd::Zero(x.size()), x); }

  double change_mm(const VectorXd& from, const VectorXd& to) const override {
    return (covariance(pair(from, to), training_, kernel_) * alpha_)(0);
  }

  std::optional<double> change_sd_mm(const VectorXd& from, const VectorXd& to) const override {
    const Pairs p = pair(from, to);
    const VectorXd k = covariance(p, training_, kernel_).transpose();
    const double left = covariance(p, p, kernel_)(0, 0) - k.dot(solver_->solve(k)) + kernel_.noise;
    return std::sqrt(variance_mm2_ * std::max(left, 0.0));
  }

  config::Table table() const override {
    config::Table out;
    out.emplace_back("feature_scale", numbers(scale_));
    out.emplace_back("rbf", number_value(kernel_.rbf));
    out.emplace_back("length", number_value(kernel_.length));
    out.emplace_back("noise", number_value(kernel_.noise));
    out.emplace_back("changes_um", numbers(change_mm_ / kMmPerUm));
    out.emplace_back("from", matrix_value(training_.from));
    out.emplace_back("to", matrix_value(training_.to));
    return out;
  }

 private:
  Pairs pair(const VectorXd& from, const VectorXd& to) const {
    return {from.cwiseProduct(scale_).transpose(), to.cwiseProduct(scale_).transpose()};
  }
  VectorXd scale_;
  Pairs training_;
  VectorXd change_mm_;
  Kernel kernel_;
  std::optional<Cholesky> solver_;
  VectorXd alpha_;
  double variance_mm2_ = 0.0;
};

}  // namespace

Result<std::shared_ptr<const Regressor>> fit_gp(const TrainingSet& training) {
  const Index n = training.to.rows();
  if (n < 4 || training.to.cols() == 0)
    return fail(ErrorCode::wrong_input, "gp needs features and four measurements");
  if (!(training.change_mm.squaredNorm() > 0.0))
    return fail(ErrorCode::wrong_input, "gp needs a channel that changes");
  VectorXd scale = (training.to.colwise().squaredNorm().transpose() / static_cast<double>(n)).cwiseSqrt();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const Pairs pairs{training.from * scale.asDiagonal(), training.to * scale.asDiagonal()};
  // Largest marginal likelihood on a grid, the overall variance solved for: robust with few measurements,
  // where gradients run off.
  constexpr std::array kNoise = {1e-4, 1e-3, 1e-2, 1e-1, 1.0};
  constexpr std::array kLength = {0.7, 2.0};
  constexpr std::array kRbf = {0.0, 0.1, 1.0};
  const MatrixXd linear = linear_covariance(pairs, pairs);
  Kernel best;
  double least = std::numeric_limits<double>::infinity();
  for (const double length : kLength) {
    const MatrixXd radial = radial_covariance(pairs, pairs, length);
    for (const double rbf : kRbf) {
      if (rbf == 0.0 && length != kLength[0]) continue;
      for (const double noise : kNoise) {
        const double value = minus_log_likelihood(linear + rbf * radial, noise, training.change_mm);
        if (std::isfinite(value) && value < least) {
          least = value;
          best = {rbf, length, noise};
        }
      }
    }
  }
  if (!std::isfinite(least)) return fail(ErrorCode::wrong_input, "gp: the measurements determine no kernel");
  return std::make_shared<const Gp>(scale, pairs, training.change_mm, best);
}

std::shared_ptr<const Regressor> read_gp(std::size_t features, config::Section& section) {
  const VectorXd scale = read_numbers(section, "feature_scale", features);
  const Kernel kernel{section.find_number("rbf").value_or(0.0), section.find_number("length").value_or(1.0),
                      section.find_number("noise").value_or(1.0)};
  const auto changes =
      section.find_numbers("changes_um").value_or(std::vector<double>{});  // in mm by the key's unit
  const Pairs pairs{read_matrix(section, "from", changes.size(), features),
                    read_matrix(section, "to", changes.size(), features)};
  if (changes.empty() || !(kernel.noise > 0.0) || !(kernel.length > 0.0)) {
    section.error("changes_um", "a Gaussian process needs changes, a noise and a length above zero");
    return nullptr;
  }
  const VectorXd change_mm = Eigen::Map<const VectorXd>(changes.data(), static_cast<Index>(changes.size()));
  return std::make_shared<Gp>(scale, pairs, change_mm, kernel);
}

}  // namespace trunnion::thermal
