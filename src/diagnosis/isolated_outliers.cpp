#include <algorithm>
#include <cmath>

#include "diagnosis/linalg.hpp"
#include "diagnosis/neighbours.hpp"
#include "diagnosis/twist_bank.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kChance = 0.05;   // that a good reading does, or the next outlier
constexpr double kAsSure = 3e-5;   // as kInCompany
constexpr double kSameSide = 2.0;  // of the noise: a neighbour that stands out too (2 % of good readings do)
constexpr std::ptrdiff_t kFewest = 8;   // readings that stand out, from which on a common cause is looked for
constexpr double kStandTogether = 0.5;  // of their excess chi-square that one function of the state explains

// Whitened residual beside the function of the state that explains most; the residual itself where none
// explains enough of it to be what the readings have in common.
VectorXd beside_common_cause(const Observations& o, const FitCore& all) {
  TwistBank twists(o);
  twists.fit_to(all);
  const Atoms nothing(o, all, {});
  NoiseScale stated;
  stated.dof = all.dof();
  const auto hits = twists.best(nothing, nothing.remainder({}), stated);
  const auto most = std::max_element(hits.begin(), hits.end(),
                                     [](const auto& a, const auto& b) { return a.drop < b.drop; });
  if (most == hits.end() || !(most->drop > kStandTogether * (all.chi2() - all.dof()))) return all.white;
  MatrixXd columns = all.projected(twists.columns(*most));
  for (auto column : columns.colwise()) column.stableNormalize();
  const MatrixXd span = pivoted_qr(columns, 1e-3).Q;
  return all.white - span * (span.transpose() * all.white);
}

// Whether so many companions stand out that chance does not explain it: a few that do so together are not
// lost among many that do not.
bool together(const std::vector<bool>& outliers, const std::vector<double>& shares) {
  const auto n = static_cast<int>(std::count(outliers.begin(), outliers.end(), true));
  const auto m = static_cast<int>(
      std::count_if(shares.begin(), shares.end(), [](double share) { return share > kSameSide; }));
  double tail = 0.0;  // of the binomial distribution
  for (int k = m; k <= n; ++k)
    tail += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                     k * std::log(kChance) + (n - k) * std::log1p(-kChance));
  return tail < kAsSure;
}

}  // namespace

std::vector<bool> isolated_outliers(const Observations& o, const FitCore& all, std::vector<bool> outliers) {
  const auto far = std::count(outliers.begin(), outliers.end(), true);
  if (far < 2) return outliers;
  const auto shares = companions(o, outliers, all.white);
  if (company(o, outliers, all.white) > kInCompany || together(outliers, shares)) {
    for (std::size_t i = 0; i < outliers.size(); ++i) outliers[i] = outliers[i] && !(shares[i] > kSameSide);
    return outliers;
  }
  if (far < kFewest) return outliers;
  const VectorXd beside = beside_common_cause(o, all);
  for (std::size_t i = 0; i < outliers.size(); ++i)
    outliers[i] = outliers[i] && std::abs(beside[static_cast<Eigen::Index>(i)]) > kOutlier;
  return outliers;
}

}  // namespace trunnion::diagnosis
