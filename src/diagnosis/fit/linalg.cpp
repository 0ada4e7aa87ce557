#include "diagnosis/fit/linalg.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

namespace trunnion::diagnosis {

Svd thin_svd(const MatrixXd& a) {
  if (a.rows() == 0 || a.cols() == 0) return {MatrixXd(a.rows(), 0), MatrixXd(a.cols(), 0), VectorXd(0)};
  // Not BDCSVD: that of Eigen 3.4 reads beyond its permutation when a column is all but zero.
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

namespace {

// Few long columns: Cholesky of their products, and once more (CholeskyQR2; Fukaya et al. 2014), picks the
// same columns as Householder's at a fraction of the time. The squares of what is cut must stand clear of
// rounding.
bool long_and_clear(const MatrixXd& a, double threshold) {
  constexpr double kClearOfRounding = 2e-6;  // its square is 10 000 times the rounding of a product
  return a.rows() > 4 * a.cols() && threshold > kClearOfRounding * a.colwise().norm().maxCoeff();
}

PivotedQr cholesky_qr(const MatrixXd& a, double threshold) {
  const PivotedCholesky first = pivoted_cholesky(a.transpose() * a, threshold * threshold);
  PivotedQr out;
  out.order = first.order;
  out.diagonal = first.lower.diagonal();
  out.Q.resize(a.rows(), first.rank);
  for (Eigen::Index k = 0; k < first.rank; ++k) out.Q.col(k) = a.col(first.order[k]);
  first.lower.transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(out.Q);
  const Eigen::LLT<MatrixXd> second(out.Q.transpose() * out.Q);
  second.matrixU().solveInPlace<Eigen::OnTheRight>(out.Q);
  return out;
}

}  // namespace

PivotedCholesky pivoted_cholesky(MatrixXd a, double threshold) {
  const Eigen::Index n = a.rows();
  PivotedCholesky out;
  out.order = Eigen::VectorXi::LinSpaced(n, 0, std::max(0, static_cast<int>(n) - 1));
  for (Eigen::Index k = 0; k < n; ++k, ++out.rank) {
    Eigen::Index pivot = k;
    if (!(a.diagonal().tail(n - k).maxCoeff(&pivot) > threshold)) break;
    pivot += k;
    if (pivot != k) {
      a.row(k).swap(a.row(pivot));
      a.col(k).swap(a.col(pivot));
      std::swap(out.order[k], out.order[pivot]);
    }
    const double root = std::sqrt(a(k, k));
    a(k, k) = root;
    auto below = a.col(k).tail(n - k - 1);
    below /= root;
    a.bottomRightCorner(n - k - 1, n - k - 1).noalias() -= below * below.transpose();
  }
  out.lower = a.topLeftCorner(out.rank, out.rank).triangularView<Eigen::Lower>();
  return out;
}

PivotedQr pivoted_qr(const MatrixXd& a, double threshold) {
  PivotedQr out;
  if (a.rows() == 0 || a.cols() == 0) {
    out.Q.resize(a.rows(), 0);
    out.diagonal.resize(0);
    out.order = Eigen::VectorXi::LinSpaced(a.cols(), 0, std::max(0, static_cast<int>(a.cols()) - 1));
    return out;
  }
  if (long_and_clear(a, threshold)) return cholesky_qr(a, threshold);
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
