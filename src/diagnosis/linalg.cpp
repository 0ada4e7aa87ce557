#include "diagnosis/linalg.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {

Svd thin_svd(const MatrixXd& a) {
  if (a.rows() == 0 || a.cols() == 0) return {MatrixXd(a.rows(), 0), MatrixXd(a.cols(), 0), VectorXd(0)};
  // Not BDCSVD: that of Eigen 3.4 reads beyond its permutation when a column is all but zero.
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

PivotedQr pivoted_qr(const MatrixXd& a, double threshold) {
  PivotedQr out;
  if (a.rows() == 0 || a.cols() == 0) {
    out.Q.resize(a.rows(), 0);
    out.diagonal.resize(0);
    out.order = Eigen::VectorXi::LinSpaced(a.cols(), 0, std::max(0, static_cast<int>(a.cols()) - 1));
    return out;
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  const Eigen::Index most = std::min(a.rows(), a.cols());
  Eigen::Index rank = 0;
  while (rank < most && std::abs(qr.matrixQR()(rank, rank)) > threshold) ++rank;
  out.diagonal = qr.matrixQR().diagonal().head(rank).cwiseAbs();
  out.order = qr.colsPermutation().indices();
  out.Q = MatrixXd::Identity(a.rows(), rank);
  if (rank > 0) out.Q.applyOnTheLeft(qr.householderQ());
  return out;
}

SymmetricEigen symmetric_eigen(const MatrixXd& a) {
  if (a.rows() == 0) return {VectorXd(0), MatrixXd(0, 0)};  // Eigen's solver wants a row
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(a);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

MatrixXd column_products(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd out(a.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    for (Eigen::Index k = 0; k < b.cols(); ++k) out.col(i * b.cols() + k) = a.col(i).cwiseProduct(b.col(k));
  return out;
}

VectorXd solve_positive(const MatrixXd& a, const VectorXd& b) {
  return a.ldlt().solve(b);
}

}  // namespace trunnion::diagnosis
