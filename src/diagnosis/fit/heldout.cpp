#include "diagnosis/fit/heldout.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::diagnosis {
namespace {

struct NormalEquations {
  MatrixXd a;
  VectorXd b;
};

// Least squares with the directions that the data do not see left at 0.
VectorXd solve(const NormalEquations& n) {
  if (n.b.size() == 0) return n.b;
  VectorXd scale = n.a.diagonal();
  for (double& s : scale) s = s > 0.0 ? 1.0 / std::sqrt(s) : 0.0;
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * n.a * scale.asDiagonal());
  VectorXd along = eigen.vectors.transpose() * (scale.asDiagonal() * n.b);
  for (Eigen::Index k = 0; k < along.size(); ++k)
    along[k] = eigen.values[k] > 1e-9 ? along[k] / eigen.values[k] : 0.0;
  return scale.asDiagonal() * (eigen.vectors * along);
}

// Base columns reach the held-out test as their whitened span: parameters of it are corrections to the fitted
// base.
MatrixXd design(const Atoms& atoms, const std::vector<Atom>& set) {
  const FitCore& base = atoms.base();
  std::vector<MatrixXd> blocks = {base.basis};
  Eigen::Index width = base.basis.cols();
  for (const Atom& atom : set) {
    blocks.push_back(base.projected(atoms.observations().linear_columns(atoms.effect(atom), atom.shape)));
    width += blocks.back().cols();
  }
  MatrixXd out(base.white.size(), width);
  Eigen::Index at = 0;
  for (const MatrixXd& block : blocks) {
    out.middleCols(at, block.cols()) = block;
    at += block.cols();
  }
  return out;
}

// The rows of one run of columns and of the residual.
struct RunRows {
  MatrixXd x;
  VectorXd y;
};
RunRows rows_of_run(const std::vector<Eigen::Index>& rows, const MatrixXd& x, const VectorXd& white) {
  RunRows out{MatrixXd(static_cast<Eigen::Index>(rows.size()), x.cols()),
              VectorXd(static_cast<Eigen::Index>(rows.size()))};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out.x.row(static_cast<Eigen::Index>(i)) = x.row(rows[i]);
    out.y[static_cast<Eigen::Index>(i)] = white[rows[i]];
  }
  return out;
}

// What the other runs say of the parameters: estimate and covariance (noise units) along the directions that
// they see, and the directions that they do not.
struct FromOthers {
  VectorXd theta;
  MatrixXd half;    // covariance = half half'
  MatrixXd unseen;  // parameters x count
};
FromOthers from_others(const NormalEquations& n) {
  constexpr double kSeen = 1e-9;
  VectorXd scale = n.a.diagonal();
  for (double& s : scale) s = s > 0.0 ? 1.0 / std::sqrt(s) : 1.0;
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * n.a * scale.asDiagonal());
  const VectorXd along = eigen.vectors.transpose() * (scale.asDiagonal() * n.b);
  const MatrixXd directions = scale.asDiagonal() * eigen.vectors;
  Eigen::Index hidden = 0;
  while (hidden < along.size() && eigen.values[hidden] <= kSeen) ++hidden;  // in ascending order
  const Eigen::Index seen = along.size() - hidden;
  FromOthers out;
  out.unseen = directions.leftCols(hidden);
  out.theta = directions.rightCols(seen) * along.tail(seen).cwiseQuotient(eigen.values.tail(seen));
  out.half = directions.rightCols(seen) * eigen.values.tail(seen).cwiseSqrt().cwiseInverse().asDiagonal();
  return out;
}

// -2 ln of the probability of a run's readings, and its chi-square: y ~ N(x theta, variance (I + x C x')).
struct Predictive {
  double cost = 0.0, chi2 = 0.0;
};
Predictive predictive(const RunRows& run, const FromOthers& others, double variance) {
  const VectorXd r = run.y - run.x * others.theta;
  const MatrixXd z = run.x * others.half;
  const SymmetricEigen eigen = symmetric_eigen(z.transpose() * z);
  const VectorXd along = eigen.vectors.transpose() * (z.transpose() * r);
  const VectorXd wider = (1.0 + eigen.values.array().max(0.0)).matrix();
  Predictive out;
  out.chi2 = (r.squaredNorm() - along.cwiseAbs2().cwiseQuotient(wider).sum()) / variance;
  out.cost = out.chi2 + wider.array().log().sum();
  return out;
}

}  // namespace

std::optional<HeldOut> held_out(const Atoms& atoms, const std::vector<Atom>& set) {
  const Observations& o = atoms.observations();
  const FitCore& base = atoms.base();
  if (o.runs().size() < 2) return std::nullopt;
  const MatrixXd x = design(atoms, set);
  const auto& noise = base.whitening->noise();
  const NormalEquations all{x.transpose() * x, x.transpose() * base.white};
  double um = 0.0, um_count = 0.0, urad = 0.0, urad_count = 0.0;
  for (const auto& rows : o.runs()) {
    const RunRows run = rows_of_run(rows, x, base.white);
    const VectorXd theta = solve({all.a - run.x.transpose() * run.x, all.b - run.x.transpose() * run.y});
    const VectorXd r = run.y - run.x * theta;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Index at = rows[i];
      if (!noise.used[static_cast<std::size_t>(at)]) continue;
      const double error = r[static_cast<Eigen::Index>(i)] * noise.u[at];
      const bool length = o.reading(at).quantity == Quantity::displacement;
      // Of a single reading, also where several are taken together.
      (length ? um : urad) += (error * error + o.scatter(at)) / std::pow(length ? kMmPerUm : kRadPerUrad, 2);
      (length ? um_count : urad_count) += 1.0;
    }
  }
  const auto rms = [](double sum, double count) {
    return count > 0.0 ? std::sqrt(sum / count) : std::nan("");
  };
  return HeldOut{rms(um, um_count), rms(urad, urad_count)};
}

std::optional<Harm> held_out_harm(const Atoms& atoms, const std::vector<Atom>& set, double variance) {
  constexpr double kChance = 1e-3;  // of any run, were the set the whole truth
  const Observations& o = atoms.observations();
  const FitCore& base = atoms.base();
  if (o.runs().size() < 2 || set.empty()) return std::nullopt;
  const MatrixXd with = design(atoms, set);
  const Eigen::Index without = base.basis.cols();
  const MatrixXd gram = with.transpose() * with;
  const VectorXd moments = with.transpose() * base.white;
  // The set being true, the ratio of the two probabilities exceeds k with a chance of at most 1/k (Markov).
  const double limit = 2.0 * std::log(static_cast<double>(o.runs().size()) / kChance);
  std::optional<Harm> worst;
  for (std::size_t r = 0; r < o.runs().size(); ++r) {
    RunRows run = rows_of_run(o.runs()[r], with, base.white);
    const MatrixXd a = gram - run.x.transpose() * run.x;
    const VectorXd b = moments - run.x.transpose() * run.y;
    const FromOthers others = from_others({a, b});
    // What the others do not tell, they cannot tell wrongly: such directions are left to the run itself.
    const MatrixXd open = run.x * others.unseen;
    if (open.cols() > 0) {
      const MatrixXd own = pivoted_qr(open, 1e-8).Q;
      take_out(own, run.y);
      take_out(own, run.x);
    }
    const Predictive after = predictive(run, others, variance);
    const FromOthers base_only = from_others({a.topLeftCorner(without, without), b.head(without)});
    const Predictive before = predictive({run.x.leftCols(without), run.y}, base_only, variance);
    // A prediction that is only vague is not wrong: the readings themselves must lie farther off.
    const double ratio = std::min(after.cost - before.cost, after.chi2 - before.chi2);
    if (ratio > limit && (!worst || ratio > worst->ratio)) worst = Harm{r, before.chi2, after.chi2, ratio};
  }
  return worst;
}

}  // namespace trunnion::diagnosis
