#include "diagnosis/fit/variance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::diagnosis {
namespace {

class RestrictedLikelihood {
 public:
  RestrictedLikelihood(const Observations& o, const NoiseModel& noise, bool free_setup,
                       const MatrixXd& columns, const VectorXd& raw)
      : o_(o), noise_(noise), free_setup_(free_setup) {
    // Columns of length 1, so that the rank below is one of numbers near 1.
    std::vector<Eigen::Index> kept;
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      if (columns.col(k).norm() > 0.0) kept.push_back(k);
    system_.resize(o.size(), static_cast<Eigen::Index>(kept.size()) + 1);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      MatrixXd column = columns.col(kept[k]).cwiseQuotient(noise.u);
      system_.col(static_cast<Eigen::Index>(k)) = columns.col(kept[k]) / column.norm();
    }
    system_.rightCols(1) = raw;
  }

  // -2 ln L, up to a constant.
  double operator()(double displacement_mm, double rotation_rad) const {
    NoiseModel n = noise_;
    for (Eigen::Index i = 0; i < o_.size(); ++i) {
      const Reading& r = o_.reading(i);
      if (!r.u_common && !r.zeroed)
        n.common[i] = r.quantity == Quantity::displacement ? displacement_mm : rotation_rad;
    }
    const Whitening whitening(o_, std::move(n), free_setup_);
    const MatrixXd white = whitening.applied(system_);
    double sum = whitening.log_determinant();
    VectorXd y = white.rightCols(1);
    if (white.cols() > 1) {
      const PivotedQr qr = pivoted_qr(white.leftCols(white.cols() - 1), 1e-6);
      for (const double d : qr.diagonal) sum += 2.0 * std::log(d);
      take_out(qr.Q, y);
    }
    return sum + y.squaredNorm();
  }

 private:
  const Observations& o_;
  const NoiseModel& noise_;
  bool free_setup_;
  MatrixXd system_;
};

// Minimum over tau >= 0: a grid in units of the noise, then golden section between the neighbours of the
// best.
template <class F>
double minimise(const F& f, double unit) {
  constexpr std::array kGrid = {0.0, 0.1, 0.2,  0.35, 0.6,  1.0,   1.6,   2.5,
                                4.0, 7.0, 12.0, 25.0, 60.0, 150.0, 400.0, 1000.0};
  std::size_t best = 0;
  double value = f(0.0);
  const double at_zero = value;
  for (std::size_t k = 1; k < kGrid.size(); ++k)
    if (const double v = f(kGrid[k] * unit); v < value) best = k, value = v;
  double low = kGrid[best > 0 ? best - 1 : 0] * unit,
         high = kGrid[std::min(best + 1, kGrid.size() - 1)] * unit;
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 12; ++i) {
    const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    if (f(a) < f(b))
      high = b;
    else
      low = a;
  }
  const double tau = 0.5 * (low + high);
  return f(tau) < at_zero - 1e-6 ? tau : 0.0;
}

}  // namespace

UnknownCommon has_unknown_common(const Observations& o) {
  UnknownCommon out;
  for (Eigen::Index i = 0; i < o.size(); ++i)
    if (!o.reading(i).u_common && !o.reading(i).zeroed)
      (o.reading(i).quantity == Quantity::displacement ? out.displacement : out.rotation) = true;
  return out;
}

double typical_u(const Observations& o, Quantity quantity) {
  std::vector<double> u;
  for (Eigen::Index i = 0; i < o.size(); ++i)
    if (o.reading(i).quantity == quantity) u.push_back(o.reading(i).u_random);
  if (u.empty()) return 0.0;
  std::nth_element(u.begin(), u.begin() + static_cast<std::ptrdiff_t>(u.size() / 2), u.end());
  return u[u.size() / 2];
}

EstimatedCommon estimate_common(const Observations& o, const NoiseModel& noise, bool free_setup,
                                const MatrixXd& columns, const VectorXd& raw) {
  const RestrictedLikelihood likelihood(o, noise, free_setup, columns, raw);
  const UnknownCommon unknown = has_unknown_common(o);
  EstimatedCommon out;
  if (unknown.displacement) out.displacement_mm = 0.0;
  if (unknown.rotation) out.rotation_rad = 0.0;
  // The two are nearly independent: readings of one quantity say little about the other.
  for (int pass = 0; pass < (unknown.displacement && unknown.rotation ? 2 : 1); ++pass) {
    if (unknown.displacement)
      out.displacement_mm = minimise([&](double t) { return likelihood(t, out.rotation_rad.value_or(0.0)); },
                                     typical_u(o, Quantity::displacement));
    if (unknown.rotation)
      out.rotation_rad = minimise([&](double t) { return likelihood(out.displacement_mm.value_or(0.0), t); },
                                  typical_u(o, Quantity::rotation));
  }
  return out;
}

}  // namespace trunnion::diagnosis
