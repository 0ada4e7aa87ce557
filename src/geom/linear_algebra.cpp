#include "trunnion/geom/linear_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trunnion {
namespace {

// Not BDCSVD: that of Eigen 3.4 reads beyond its permutation when a column is all but zero.
Svd svd_of(const MatrixXd& a, unsigned parts) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, parts);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

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

VectorXd Svd::solve(const VectorXd& b) const {
  // As Eigen's solver: the rounding of as many sums.
  Eigen::Index rank = s.size();
  const double least = std::max(
      (s.size() > 0 ? s[0] : 0.0) * static_cast<double>(s.size()) * std::numeric_limits<double>::epsilon(),
      std::numeric_limits<double>::min());
  while (rank > 0 && s[rank - 1] < least) --rank;
  const VectorXd along = s.head(rank).cwiseInverse().cwiseProduct(U.leftCols(rank).transpose() * b);
  return V.leftCols(rank) * along;
}

Svd thin_svd(const MatrixXd& a) {
  if (a.rows() == 0 || a.cols() == 0) return {MatrixXd(a.rows(), 0), MatrixXd(a.cols(), 0), VectorXd(0)};
  return svd_of(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
}

Svd full_svd(const MatrixXd& a) {
  return svd_of(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
}

VectorXd singular_values(const MatrixXd& a) {
  return Eigen::JacobiSVD<MatrixXd>(a).singularValues();
}

struct LeastSquares::Parts {
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
};

LeastSquares::LeastSquares(const MatrixXd& a, std::optional<double> threshold)
    : parts_(std::make_unique<Parts>()) {
  if (threshold) parts_->qr.setThreshold(*threshold);
  parts_->qr.compute(a);
}
LeastSquares::~LeastSquares() = default;
LeastSquares::LeastSquares(LeastSquares&&) noexcept = default;
LeastSquares& LeastSquares::operator=(LeastSquares&&) noexcept = default;

Eigen::Index LeastSquares::rank() const {
  return parts_->qr.rank();
}

VectorXd LeastSquares::solve(const VectorXd& b) const {
  return parts_->qr.solve(b);
}

MatrixXd LeastSquares::solve_all(const MatrixXd& b) const {
  return parts_->qr.solve(b);
}

// (R' R)^-1, columns permuted.
MatrixXd LeastSquares::cofactor() const {
  const Eigen::Index n = parts_->qr.cols();
  const MatrixXd R_inverse =
      parts_->qr.matrixR().topRows(n).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(n, n));
  const MatrixXd permuted = parts_->qr.colsPermutation() * R_inverse;
  return permuted * permuted.transpose();
}

VectorXd shortest_least_squares(const MatrixXd& a, const VectorXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

MatrixXd pseudo_inverse(const MatrixXd& a) {
  return a.completeOrthogonalDecomposition().pseudoInverse();
}

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

struct Cholesky::Parts {
  Eigen::LLT<MatrixXd> llt;
};

Cholesky::Cholesky(const MatrixXd& a) : parts_(std::make_unique<Parts>()) {
  parts_->llt.compute(a);
}
Cholesky::~Cholesky() = default;
Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;

VectorXd Cholesky::solve(const VectorXd& b) const {
  return parts_->llt.solve(b);
}

MatrixXd Cholesky::solve_all(const MatrixXd& b) const {
  return parts_->llt.solve(b);
}

VectorXd Cholesky::solve_lower(const VectorXd& b) const {
  return parts_->llt.matrixL().solve(b);
}

MatrixXd Cholesky::solve_lower_all(const MatrixXd& b) const {
  return parts_->llt.matrixL().solve(b);
}

double Cholesky::log_determinant_of_lower() const {
  return parts_->llt.matrixLLT().diagonal().array().log().sum();
}

SymmetricEigen symmetric_eigen(const MatrixXd& a) {
  if (a.rows() == 0) return {VectorXd(0), MatrixXd(0, 0)};  // Eigen's solver wants a row
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(a);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

MatrixXd inverse_above(const MatrixXd& a, double threshold) {
  const SymmetricEigen eigen = symmetric_eigen(a);
  VectorXd inverse = eigen.values;
  for (double& v : inverse) v = v > threshold ? 1.0 / v : 0.0;
  return eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
}

VectorXd solve_positive(const MatrixXd& a, const VectorXd& b) {
  return a.ldlt().solve(b);
}

MatrixXd solve_positive_all(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

double log_determinant_of_positive(const MatrixXd& a, double least) {
  return a.ldlt().vectorD().array().max(least).log().sum();
}

MatrixXd solve_square(const MatrixXd& a, const MatrixXd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXd inverse_of(const MatrixXd& a) {
  return a.inverse();
}

void take_out(const MatrixXd& basis, VectorXd& x) {
  x -= basis * (basis.transpose() * x);
}

void take_out(const MatrixXd& basis, MatrixXd& x) {
  x -= basis * (basis.transpose() * x);
}

MatrixXd column_products(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd out(a.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    for (Eigen::Index k = 0; k < b.cols(); ++k) out.col(i * b.cols() + k) = a.col(i).cwiseProduct(b.col(k));
  return out;
}

MatrixXd row_echelon(const MatrixXd& a) {
  const Eigen::FullPivLU<MatrixXd> lu(a);
  const MatrixXd U = lu.matrixLU().triangularView<Eigen::Upper>();
  return U * lu.permutationQ().inverse();
}

}  // namespace trunnion
