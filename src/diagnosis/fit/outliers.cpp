#include <algorithm>
#include <cmath>

#include "trunnion/base/median.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/search/neighbours.hpp"
#include "diagnosis/search/structure.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr Eigen::Index kMostOutlierColumns = 90;  // columns; time goes with their square

constexpr double kHuber = 1.5;             // 96 % efficiency at the Gaussian
constexpr double kFewestForMixture = 4.0;  // outliers whose width says something
constexpr double kNearestOutlier = 3.0;    // 0.3 % of good readings lie beyond: no test feels their loss
constexpr double kMostOutliers = 0.15;     // more than this are no outliers but a model that fails

double robust_sigma(const VectorXd& r, const std::vector<bool>& used) {
  std::vector<double> size;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    if (used[static_cast<std::size_t>(i)]) size.push_back(std::abs(r[i]));
  if (size.empty()) return 1.0;
  std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2), size.end());
  return kMadToSigma * size[size.size() / 2];
}

std::vector<bool> beyond(double limit, const VectorXd& r, const std::vector<bool>& used) {
  std::vector<bool> out(used.size());
  for (std::size_t k = 0; k < used.size(); ++k)
    out[k] = !used[k] || std::abs(r[static_cast<Eigen::Index>(k)]) > limit;
  return out;
}

// Where outliers are many, those below kOutlier are many too, and a few of them side by side look like an
// effect. A mixture of the noise and a wide Gaussian, its share and width taken from the sure outliers: the
// limit is where a reading is as likely one as the other.
double outlier_limit(const VectorXd& r, const std::vector<bool>& sure) {
  double far = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < sure.size(); ++k) {
    if (!sure[k]) continue;
    const double size = r[static_cast<Eigen::Index>(k)];
    far += 1.0;
    // One that was left out in an earlier round has no residual; it was at least as far as the limit.
    squares += std::max(size * size, kOutlier * kOutlier);
  }
  if (far < kFewestForMixture) return kOutlier;
  const double share = far / static_cast<double>(sure.size()), width = std::sqrt(squares / far);
  // share / width exp(-t^2 / 2 width^2) = (1 - share) exp(-t^2 / 2)
  const double t2 = 2.0 * std::log((1.0 - share) * width / share) / (1.0 - 1.0 / (width * width));
  return std::clamp(std::sqrt(std::max(t2, 0.0)), kNearestOutlier, kOutlier);
}

MatrixXd sum_of_squares(const MatrixXd& z) {
  MatrixXd out = MatrixXd::Zero(z.cols(), z.cols());
  if (z.size() == 0) return out;  // Eigen's update wants a row
  out.selfadjointView<Eigen::Lower>().rankUpdate(z.transpose());
  return out.selfadjointView<Eigen::Lower>();
}

// Z' (1 - W) Z: few readings have less than their whole weight.
MatrixXd of_lost_weight(const MatrixXd& z, const VectorXd& weight) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < weight.size(); ++k)
    if (weight[k] < 1.0) rows.push_back(k);
  MatrixXd part = z(rows, Eigen::all);
  for (std::size_t k = 0; k < rows.size(); ++k)
    part.row(static_cast<Eigen::Index>(k)) *= std::sqrt(1.0 - weight[rows[k]]);
  return sum_of_squares(part);
}

}  // namespace

std::vector<bool> find_outliers(const Observations& o, const FitCore& fit) {
  const Eigen::Index n = o.size();
  const auto& used = fit.whitening->noise().used;
  const Eigen::Index rank = fit.basis.cols();
  const MatrixXd surrogate =
      smooth_surrogate(o, fit, std::clamp<Eigen::Index>((n - rank) / 5, 0, kMostOutlierColumns)).topRows(n);
  MatrixXd z(n, rank + surrogate.cols());
  z << fit.basis.topRows(n), surrogate;
  for (Eigen::Index k = 0; k < z.cols(); ++k)
    if (const double norm = z.col(k).norm(); norm > 0.0) z.col(k) /= norm;
  const VectorXd y = fit.white.head(n);
  VectorXd r = y, weight = VectorXd::Ones(n);
  MatrixXd unweighted = sum_of_squares(z);
  unweighted.diagonal().array() += 1e-9 * static_cast<double>(n);  // directions that are not there
  double sigma = 1.0;
  for (int i = 0; i < 6; ++i) {
    const MatrixXd normal = unweighted - of_lost_weight(z, weight);
    r = y - z * solve_positive(normal, z.transpose() * weight.cwiseProduct(y));
    sigma = std::max(0.3, robust_sigma(r, used));  // quantised or repeated readings may have a median of 0
    for (Eigen::Index k = 0; k < n; ++k)
      weight[k] = std::min(1.0, kHuber * sigma / std::max(std::abs(r[k]), 1e-12));
  }
  const double left = static_cast<double>(n) / std::max(1.0, static_cast<double>(n - z.cols()));
  r /= sigma * std::sqrt(left);
  const auto too_many = [n](const std::vector<bool>& flags) {
    const auto count = std::count(flags.begin(), flags.end(), true);
    return static_cast<double>(count) > kMostOutliers * static_cast<double>(n);
  };
  std::vector<bool> out = beyond(kOutlier, r, used);
  // What a missing effect puts beyond kOutlier says nothing of how many outliers there are below.
  if (!too_many(out)) out = beyond(outlier_limit(r, isolated_outliers(o, fit, out)), r, used);
  if (too_many(out)) out.assign(out.size(), false);
  return out;
}

}  // namespace trunnion::diagnosis
