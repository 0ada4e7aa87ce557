#include "diagnosis/fit/noise_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/wander.hpp"

namespace trunnion::diagnosis {
namespace {

// The stated uncertainty is trusted as if it came from this many readings: a standard deviation known to
// about 20 %.
constexpr double kPriorDof = 12.0;
constexpr int kScaleSeries = 24;         // simulated series for each correlation
constexpr double kSureDeviations = 3.0;  // of the lag-1 correlation of white noise
constexpr std::array kPhi = {0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9};

using Sequences = std::vector<std::vector<Eigen::Index>>;

double lag_one(const VectorXd& r, const Sequences& sequences) {
  double c0 = 0.0, c1 = 0.0;
  for (const auto& s : sequences)
    for (std::size_t i = 0; i < s.size(); ++i) {
      c0 += r[s[i]] * r[s[i]];
      if (i > 0) c1 += r[s[i]] * r[s[i - 1]];
    }
  return c0 > 0.0 ? c1 / c0 : 0.0;
}

struct Moments {
  double correlation = 0.0, spread = 0.0, variance = 1.0;
};

// What AR(1) noise of correlation phi looks like after everything has been projected out of it.
Moments simulated(const Atoms& atoms, const MatrixXd& basis, const Sequences& sequences, double phi,
                  std::uint64_t seed) {
  const Observations& o = atoms.observations();
  const auto& noise = atoms.base().whitening->noise();
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  MatrixXd e = MatrixXd::Zero(o.size(), kScaleSeries);
  for (const auto& s : sequences)
    for (int c = 0; c < kScaleSeries; ++c) {
      double last = normal(engine);
      for (std::size_t i = 0; i < s.size(); ++i) {
        if (i > 0) last = phi * last + std::sqrt(1.0 - phi * phi) * normal(engine);
        e(s[i], c) = last * noise.u[s[i]];
      }
    }
  MatrixXd p = atoms.base().projected(e);
  take_out(basis, p);
  Moments out;
  double square = 0.0, power = 0.0;
  for (int c = 0; c < kScaleSeries; ++c) {
    const double r = lag_one(p.col(c), sequences);
    out.correlation += r / kScaleSeries;
    square += r * r / kScaleSeries;
    power += p.col(c).squaredNorm() / kScaleSeries;
  }
  out.spread = std::sqrt(std::max(square - out.correlation * out.correlation, 0.0));
  out.variance = power;
  return out;
}

struct Correlation {
  double phi = 0.0, excess = 0.0, power = 0.0;
};

Correlation correlation_along(const Atoms& atoms, const MatrixXd& basis, const VectorXd& r,
                              const Sequences& sequences, std::uint64_t seed) {
  Correlation out;
  const double seen = lag_one(r, sequences);
  Moments last = simulated(atoms, basis, sequences, 0.0, seed);
  out.power = last.variance;
  const double spread = std::max(last.spread, 0.7 / std::sqrt(static_cast<double>(r.size())));
  out.excess = (seen - last.correlation) / spread;
  if (out.excess < kSureDeviations) return out;
  for (std::size_t k = 1; k < kPhi.size(); ++k) {
    const Moments next = simulated(atoms, basis, sequences, kPhi[k], seed);
    if (next.correlation >= seen || k + 1 == kPhi.size()) {
      const double t = std::clamp(
          (seen - last.correlation) / std::max(next.correlation - last.correlation, 1e-9), 0.0, 1.0);
      out.phi = kPhi[k - 1] + t * (kPhi[k] - kPhi[k - 1]);
      out.power = last.variance + t * (next.variance - last.variance);
      return out;
    }
    last = next;
  }
  return out;
}

}  // namespace

MatrixXd joined_basis(const MatrixXd& set, const MatrixXd& surrogate) {
  MatrixXd rest = surrogate;
  take_out(set, rest);
  for (Eigen::Index k = 0; k < rest.cols(); ++k)
    if (const double norm = surrogate.col(k).norm(); norm > 0.0) rest.col(k) /= norm;
  const MatrixXd q = pivoted_qr(rest, 1e-4).Q;
  MatrixXd out(set.rows(), set.cols() + q.cols());
  out << set, q;
  return out;
}

double NoiseScale::test_dof() const {
  return dof + kPriorDof;
}

NoiseScale noise_scale(const Atoms& atoms, const Remainder& set, const MatrixXd& surrogate,
                       std::uint64_t seed) {
  const Observations& o = atoms.observations();
  const auto& used = atoms.base().whitening->noise().used;
  const MatrixXd basis = joined_basis(set.basis, surrogate);
  VectorXd r = atoms.base().white;
  take_out(basis, r);
  NoiseScale out;
  out.dof = std::max(1.0, atoms.base().dof() - static_cast<double>(basis.cols()));
  const Sequences by_group = sequences_of(o, false, used), by_run = sequences_of(o, true, used);
  const Correlation group = correlation_along(atoms, basis, r, by_group, seed);
  const Correlation run = correlation_along(atoms, basis, r, by_run, seed + 1);
  const bool along_run = run.excess > group.excess;
  const Correlation& best = along_run ? run : group;
  out.phi = best.phi;
  out.sequences = along_run ? by_run : by_group;
  const double power = out.phi > 0.0 ? best.power : out.dof;
  out.raw_variance = r.squaredNorm() / std::max(power, 1.0);
  out.variance = (kPriorDof + out.dof * out.raw_variance) / (kPriorDof + out.dof);
  // Scatter and correlation are estimated from the same few moments: where the second is large by chance, the
  // first is small. Correlated noise is never taken to be smaller than was stated.
  if (out.phi > 0.0) out.variance = std::max(out.variance, 1.0);
  return out;
}

double corrected_drop(const MatrixXd& U, const VectorXd& r, const NoiseScale& noise) {
  if (U.cols() == 0) return 0.0;
  const VectorXd b = U.transpose() * r;
  if (noise.phi == 0.0) return b.squaredNorm() / noise.variance;
  MatrixXd ru = U;
  for (const auto& s : noise.sequences) {
    for (Eigen::Index c = 0; c < U.cols(); ++c) {
      double carried = 0.0;
      for (std::size_t i = 0; i < s.size(); ++i) {
        ru(s[i], c) += noise.phi * carried;
        carried = U(s[i], c) + noise.phi * carried;
      }
      carried = 0.0;
      for (std::size_t i = s.size(); i-- > 0;) {
        ru(s[i], c) += noise.phi * carried;
        carried = U(s[i], c) + noise.phi * carried;
      }
    }
  }
  MatrixXd v = U.transpose() * ru;
  v = 0.5 * (v + v.transpose()).eval();
  const SymmetricEigen eigen = symmetric_eigen(v);
  const VectorXd along = eigen.vectors.transpose() * b;
  double drop = 0.0;
  for (Eigen::Index k = 0; k < along.size(); ++k)
    drop += along[k] * along[k] / std::max(eigen.values[k], 1.0);
  return drop / noise.variance;
}

}  // namespace trunnion::diagnosis
