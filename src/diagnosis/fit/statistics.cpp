#include "diagnosis/fit/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <cmath>

namespace trunnion::diagnosis {
namespace bm = boost::math;
namespace {

// Tails beyond the range of a double are 0 or 1, not a reason to stop.
using Quiet = bm::policies::policy<bm::policies::overflow_error<bm::policies::ignore_error>,
                                   bm::policies::underflow_error<bm::policies::ignore_error>,
                                   bm::policies::evaluation_error<bm::policies::ignore_error>,
                                   bm::policies::domain_error<bm::policies::ignore_error>,
                                   bm::policies::pole_error<bm::policies::ignore_error>>;

double share(double p) {
  return std::isfinite(p) ? std::clamp(p, 0.0, 1.0) : 0.0;
}

}  // namespace

double chi2_tail(double x, double k) {
  if (!(k > 0.0) || !(x > 0.0)) return 1.0;
  if (!std::isfinite(x)) return 0.0;
  return share(bm::cdf(bm::complement(bm::chi_squared_distribution<double, Quiet>(k), x)));
}

double f_tail(double x, double a, double b) {
  // Not a number: a quotient of two residuals that are both nothing.
  if (!(a > 0.0) || !(b > 0.0) || !(x > 0.0)) return 1.0;
  if (!std::isfinite(x)) return 0.0;
  return share(bm::cdf(bm::complement(bm::fisher_f_distribution<double, Quiet>(a, b), x)));
}

double normal_cdf(double z) {
  return 0.5 * std::erfc(-z / std::sqrt(2.0));
}

double needed_noncentrality(double k, double alpha, double power) {
  const double limit = bm::quantile(bm::complement(bm::chi_squared(k), alpha));
  return bm::non_central_chi_squared::find_non_centrality(k, limit, 1.0 - power);
}

double smallest_of(double p, double m) {
  if (p >= 1.0) return 1.0;
  return -std::expm1(std::max(m, 1.0) * std::log1p(-p));
}

}  // namespace trunnion::diagnosis
