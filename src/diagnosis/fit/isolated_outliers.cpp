#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/twist_bank.hpp"
#include "diagnosis/search/neighbours.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kChance = 0.05;   // that a good reading does, or the next outlier
constexpr double kAsSure = 3e-5;   // as kInCompany
constexpr double kSameSide = 2.0;  // of the noise: a neighbour that stands out too (2 % of good readings do)

// Whitened residual beside the function of the state that explains most; the residual itself where none
// explains enough of it to be what the readings have in common.
VectorXd beside_common_cause(const Observations& o, const FitCore& all) {
  TwistBank twists(o);
  const auto cause = twists.common_cause(all);
  if (!cause) return all.white;
  MatrixXd columns = all.projected(twists.columns(*cause));
  for (auto column : columns.colwise()) column.stableNormalize();
  const MatrixXd span = pivoted_qr(columns, 1e-3).Q;
  VectorXd out = all.white;
  take_out(span, out);
  return out;
}

// That chance alone gives `some` of `all` something that one of them has with probability `each`, or more.
double binomial_tail(std::ptrdiff_t some, std::ptrdiff_t all, double each) {
  const auto n = static_cast<double>(all);
  double out = 0.0;
  for (std::ptrdiff_t i = some; i <= all; ++i) {
    const auto k = static_cast<double>(i);
    out += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                    k * std::log(each) + (n - k) * std::log1p(-each));
  }
  return out;
}

// Whether so many companions stand out that chance does not explain it: a few that do so together are not
// lost among many that do not.
bool together(const std::vector<bool>& outliers, const std::vector<Company>& beside) {
  const auto all = std::count(outliers.begin(), outliers.end(), true);
  const auto one =
      std::count_if(beside.begin(), beside.end(), [](const Company& c) { return c.nearest > kSameSide; });
  const auto both = std::count_if(beside.begin(), beside.end(), [](const Company& c) {
    return c.nearest > kSameSide && c.next > kSameSide;
  });
  return binomial_tail(one, all, kChance) < kAsSure || binomial_tail(both, all, kChance * kChance) < kAsSure;
}

}  // namespace

std::vector<bool> isolated_outliers(const Observations& o, const FitCore& all, std::vector<bool> outliers) {
  const auto far = std::count(outliers.begin(), outliers.end(), true);
  if (far < 2) return outliers;
  const auto beside = companions(o, outliers, all.white);
  if (company(o, outliers, all.white) > kInCompany || together(outliers, beside)) {
    for (std::size_t i = 0; i < outliers.size(); ++i)
      outliers[i] = outliers[i] && !(std::max(beside[i].nearest, beside[i].next) > kSameSide);
    return outliers;
  }
  if (far < kFewestTogether) return outliers;
  const VectorXd left = beside_common_cause(o, all);
  for (std::size_t i = 0; i < outliers.size(); ++i)
    outliers[i] = outliers[i] && std::abs(left[static_cast<Eigen::Index>(i)]) > kOutlier;
  return outliers;
}

}  // namespace trunnion::diagnosis
