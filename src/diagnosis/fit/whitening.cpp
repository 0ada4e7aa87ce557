#include "diagnosis/fit/whitening.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::diagnosis {

Eigen::Index NoiseModel::used_count() const {
  return static_cast<Eigen::Index>(std::count(used.begin(), used.end(), true));
}

double resolution(const Observations& o, Quantity quantity) {
  constexpr Eigen::Index kFewest = 20;
  const double unit = quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
  std::vector<double> values;
  for (Eigen::Index i = 0; i < o.size(); ++i)
    if (o.reading(i).quantity == quantity) values.push_back(o.values()[i] / unit);
  if (values.size() < static_cast<std::size_t>(kFewest)) return 0.0;
  for (double decade = 10.0; decade > 1e-7; decade *= 0.1)
    for (const double part : {0.5, 0.25, 0.2, 0.1}) {
      const double step = part * decade;
      const auto whole = [step](double value) {
        return std::abs(value / step - std::round(value / step)) < 1e-4;
      };
      if (!std::all_of(values.begin(), values.end(), whole)) continue;
      const bool any =
          std::any_of(values.begin(), values.end(), [step](double v) { return std::abs(v) > 0.5 * step; });
      return any ? unit * step : 0.0;
    }
  return 0.0;
}

// Of a reading's own uncertainty: beyond any error, so that the offset of a group that was set to 0 where it
// begins says nothing. In another unit it is as many times as large.
constexpr double kOfZeroed = 1e4;

NoiseModel stated_noise(const Observations& observations, double unknown_mm, double unknown_rad) {
  NoiseModel out;
  const Eigen::Index count = observations.size();
  const std::array<double, 2> rounding = {resolution(observations, Quantity::displacement) / std::sqrt(12.0),
                                          resolution(observations, Quantity::rotation) / std::sqrt(12.0)};
  out.u.resize(count);
  out.common.resize(count);
  out.used.assign(static_cast<std::size_t>(count), true);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Reading& r = observations.reading(i);
    // Rounding is noise too, whatever the file states.
    out.u[i] = std::max(r.u_random, rounding[r.quantity == Quantity::displacement ? 0 : 1]);
    out.common[i] =
        r.zeroed ? kOfZeroed * out.u[i]
                 : r.u_common.value_or(r.quantity == Quantity::displacement ? unknown_mm : unknown_rad);
  }
  return out;
}

Whitening::Whitening(const Observations& observations, NoiseModel noise, bool free_setup)
    : observations_(&observations), noise_(std::move(noise)) {
  inverse_u_ = noise_.u.cwiseInverse();
  for (Eigen::Index i = 0; i < inverse_u_.size(); ++i) {
    if (!noise_.used[static_cast<std::size_t>(i)])
      inverse_u_[i] = 0.0;
    else
      log_determinant_ += 2.0 * std::log(noise_.u[i]);
  }
  shared_ = noise_.common.cwiseProduct(inverse_u_);
  for (const auto& group : observations.groups()) {
    double s = 0.0;
    for (const Eigen::Index i : group) s += shared_[i] * shared_[i];
    // (I + v v')^-1/2 = I - shrink v v', |I + v v'| = 1 + s
    shrink_.push_back(s > 0.0 ? (1.0 - 1.0 / std::sqrt(1.0 + s)) / s : 0.0);
    log_determinant_ += std::log1p(s);
  }
  if (free_setup) make_setup_bases();
}

void Whitening::make_setup_bases() {
  MatrixXd setup(observations_->size(), 3);
  for (Eigen::Index i = 0; i < setup.rows(); ++i) setup.row(i) = observations_->setup_row(i);
  whiten(setup);
  constexpr double kRankTolerance =
      1e-7;  // relative singular value: a direction that no reading of the run sees
  for (const auto& rows : observations_->runs()) {
    MatrixXd part(static_cast<Eigen::Index>(rows.size()), 3);
    for (std::size_t i = 0; i < rows.size(); ++i) part.row(static_cast<Eigen::Index>(i)) = setup.row(rows[i]);
    Run run;
    if (rows.empty() || part.norm() == 0.0) {
      run.basis.resize(part.rows(), 0);
      run.to_setup.resize(3, 0);
    } else {
      const Svd svd = thin_svd(part);
      const VectorXd& s = svd.s;
      Eigen::Index rank = 0;
      while (rank < s.size() && s[rank] > kRankTolerance * s[0])
        log_determinant_ += 2.0 * std::log(s[rank++]);
      run.basis = svd.U.leftCols(rank);
      run.to_setup = svd.V.leftCols(rank) * s.head(rank).cwiseInverse().asDiagonal();
      setup_rank_ += rank;
    }
    runs_.push_back(std::move(run));
  }
}

void Whitening::whiten(Eigen::Ref<MatrixXd> x) const {
  x = inverse_u_.asDiagonal() * x;
  mix(x);
}

void Whitening::mix(Eigen::Ref<MatrixXd> x) const {
  for (auto column : x.colwise())
    for (std::size_t g = 0; g < shrink_.size(); ++g) {
      if (shrink_[g] == 0.0) continue;
      double sum = 0.0;
      for (const Eigen::Index i : observations_->groups()[g]) sum += shared_[i] * column[i];
      for (const Eigen::Index i : observations_->groups()[g]) column[i] -= shrink_[g] * shared_[i] * sum;
    }
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): a Ref by value is how Eigen passes what is written to
void Whitening::apply(Eigen::Ref<MatrixXd> x) const {
  if (x.cols() == 0) return;  // a model without parameters: there is no row to look at
  whiten(x);
  take_setups(x);
}

void Whitening::take_setups(Eigen::Ref<MatrixXd> x) const {
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    const MatrixXd& basis = runs_[run].basis;
    if (basis.cols() == 0) continue;
    const auto& rows = observations_->runs()[run];
    MatrixXd part = x(rows, Eigen::all);
    take_out(basis, part);
    x(rows, Eigen::all) = part;
  }
}

VectorXd Whitening::applied(const VectorXd& x) const {
  MatrixXd copy = x;
  apply(copy);
  return copy.col(0);
}

std::vector<Vec3> Whitening::setup_of(const VectorXd& residual) const {
  MatrixXd white = residual;
  whiten(white);
  std::vector<Vec3> out(observations_->runs().size(), Vec3::Zero());
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    const auto& rows = observations_->runs()[run];
    VectorXd part(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) part[static_cast<Eigen::Index>(i)] = white(rows[i], 0);
    if (runs_[run].basis.cols() > 0) out[run] = runs_[run].to_setup * (runs_[run].basis.transpose() * part);
  }
  return out;
}

}  // namespace trunnion::diagnosis
