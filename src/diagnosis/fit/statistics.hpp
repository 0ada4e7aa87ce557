#pragma once
#include <algorithm>
#include <vector>

namespace trunnion::diagnosis {

/// Evidence of 1000 : 1, as -2 ln of the ratio of two likelihoods: explanations that are nearer stay open,
/// all of them.
inline constexpr double kThousandToOne = 13.8;

/// Largest minus smallest value; `values` is not empty.
inline double peak_to_valley(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

/// P(chi-square with k degrees of freedom >= x); 1 for k = 0.
double chi2_tail(double x, double k);
/// P(F with (a, b) degrees of freedom >= x).
double f_tail(double x, double a, double b);
/// Phi(z) of the standard normal.
double normal_cdf(double z);
/// Noncentrality of a chi-square test with k degrees of freedom at level `alpha` that has power `power`.
double needed_noncentrality(double k, double alpha, double power);
/// 1 - (1 - p)^m without cancellation: the chance that the smallest of m independent p-values is p or less.
double smallest_of(double p, double m);

}  // namespace trunnion::diagnosis
