#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/thermal/statistics.hpp"

namespace trunnion::thermal {
namespace {

constexpr std::size_t kSmallest = 3;
constexpr std::size_t kLargest = 5000;  // the range for which Royston fitted his polynomials

// Coefficients of AS R94 in ascending powers: the two largest weights as polynomials of 1/sqrt(n); mean and
// log standard deviation of the transformed W as polynomials of n (4 to 11) and of ln n (12 and more).
constexpr std::array kWeight1 = {0.0, 0.221157, -0.147981, -2.07119, 4.434685, -2.706056};
constexpr std::array kWeight2 = {0.0, 0.042981, -0.293762, -1.752461, 5.682633, -3.582633};
constexpr std::array kMeanSmall = {0.544, -0.39978, 0.025054, -6.714e-4};
constexpr std::array kLogSdSmall = {1.3822, -0.77857, 0.062767, -0.0020322};
constexpr std::array kMeanLarge = {-1.5861, -0.31082, -0.083751, 0.0038915};
constexpr std::array kLogSdLarge = {-0.4803, -0.082676, 0.0030302};
constexpr std::array kGamma = {-2.273, 0.459};

template <std::size_t N>
double polynomial(const std::array<double, N>& coefficient, double x) {
  double sum = 0.0;
  for (std::size_t i = N; i-- > 0;) sum = sum * x + coefficient[i];
  return sum;
}

// Weights of the differences x(n+1-i) - x(i), i = 1 .. n/2 (section 2 of the paper).
std::vector<double> weights(std::size_t n) {
  if (n == kSmallest) return {std::sqrt(0.5)};
  const auto size = static_cast<double>(n);
  const boost::math::normal normal;
  std::vector<double> m(n / 2);  // expected normal order statistics, the upper half by symmetry (Blom)
  double m2 = 0.0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    m[i] = -quantile(normal, (static_cast<double>(i + 1) - 0.375) / (size + 0.25));
    m2 += 2.0 * m[i] * m[i];
  }
  const double u = 1.0 / std::sqrt(size);
  std::vector<double> a(m.size());
  a[0] = m[0] / std::sqrt(m2) + polynomial(kWeight1, u);
  std::size_t given = 1;
  double left_m2 = m2 - 2.0 * m[0] * m[0];
  double left_a2 = 1.0 - 2.0 * a[0] * a[0];
  if (n > 5) {
    a[1] = m[1] / std::sqrt(m2) + polynomial(kWeight2, u);
    left_m2 -= 2.0 * m[1] * m[1];
    left_a2 -= 2.0 * a[1] * a[1];
    given = 2;
  }
  for (std::size_t i = given; i < m.size(); ++i) a[i] = m[i] / std::sqrt(left_m2 / left_a2);
  return a;
}

double p_value(double W, std::size_t n) {
  const auto size = static_cast<double>(n);
  if (n == kSmallest) {  // exact
    return std::max(0.0, 6.0 / kPi * (std::asin(std::sqrt(W)) - std::asin(std::sqrt(0.75))));
  }
  double y = std::log(1.0 - W);
  double mean = 0.0;
  double sd = 1.0;
  if (n <= 11) {
    const double gamma = polynomial(kGamma, size);
    if (y >= gamma) return 0.0;
    y = -std::log(gamma - y);
    mean = polynomial(kMeanSmall, size);
    sd = std::exp(polynomial(kLogSdSmall, size));
  } else {
    mean = polynomial(kMeanLarge, std::log(size));
    sd = std::exp(polynomial(kLogSdLarge, std::log(size)));
  }
  return cdf(complement(boost::math::normal(), (y - mean) / sd));
}

}  // namespace

Result<ShapiroWilk> shapiro_wilk(std::span<const double> values) {
  const std::size_t n = values.size();
  if (n < kSmallest || n > kLargest) {
    return fail(ErrorCode::wrong_input,
                "the Shapiro-Wilk test is for 3 to 5000 values, not " + std::to_string(n));
  }
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    return fail(ErrorCode::wrong_input, "the Shapiro-Wilk test needs finite values");
  }
  std::vector<double> x(values.begin(), values.end());
  std::sort(x.begin(), x.end());
  const double range = x.back() - x.front();
  if (!(range > 0.0)) return fail(ErrorCode::wrong_input, "the Shapiro-Wilk test needs values that differ");
  double mean = 0.0;
  const double smallest = x.front();
  for (double& v : x) {
    v = (v - smallest) / range;
    mean += v / static_cast<double>(n);
  }
  const std::vector<double> a = weights(n);
  double between = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) between += a[i] * (x[n - 1 - i] - x[i]);
  for (const double v : x) squares += (v - mean) * (v - mean);
  ShapiroWilk out;
  out.W = std::min(1.0, between * between / squares);
  out.p = out.W < 1.0 ? p_value(out.W, n) : 1.0;
  return out;
}

}  // namespace trunnion::thermal
