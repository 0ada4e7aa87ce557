#include "diagnosis/heldout.hpp"

#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/linalg.hpp"

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

}  // namespace

std::optional<HeldOut> held_out(const Atoms& atoms, const std::vector<Atom>& set) {
  const Observations& o = atoms.observations();
  const FitCore& base = atoms.base();
  if (o.runs().size() < 2) return std::nullopt;
  const MatrixXd x = design(atoms, set);
  const auto& noise = base.whitening->noise();
  NormalEquations all{x.transpose() * x, x.transpose() * base.white};
  HeldOut out;
  double sum = 0.0, count = 0.0;
  for (const auto& rows : o.runs()) {
    MatrixXd part(static_cast<Eigen::Index>(rows.size()), x.cols());
    VectorXd y(part.rows());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      part.row(static_cast<Eigen::Index>(i)) = x.row(rows[i]);
      y[static_cast<Eigen::Index>(i)] = base.white[rows[i]];
    }
    const VectorXd theta = solve({all.a - part.transpose() * part, all.b - part.transpose() * y});
    const VectorXd r = y - part * theta;
    double run_sum = 0.0, run_count = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Index at = rows[i];
      if (!noise.used[static_cast<std::size_t>(at)]) continue;
      const double unit = o.reading(at).quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
      run_sum += std::pow(r[static_cast<Eigen::Index>(i)] * noise.u[at] / unit, 2);
      run_count += 1.0;
    }
    out.run_rms_um.push_back(run_count > 0.0 ? std::sqrt(run_sum / run_count) : 0.0);
    sum += run_sum;
    count += run_count;
  }
  out.rms_um = count > 0.0 ? std::sqrt(sum / count) : 0.0;
  return out;
}

}  // namespace trunnion::diagnosis
