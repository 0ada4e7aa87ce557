#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>

/// Decompositions of matrices of any size, compiled once: as templates they took a third of the time that it
/// took to compile the layers that use them. Fixed sizes (3 x 3, 4 x 4) stay with Eigen where they are.
namespace trunnion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// a = U diag(s) V', by one-sided Jacobi rotations.
struct Svd {
  MatrixXd U, V;
  VectorXd s;  // descending
  /// The shortest x of the smallest |a x - b|; singular values that are rounding beside the largest count as
  /// zero.
  VectorXd solve(const VectorXd& b) const;
};
/// U and V with as many columns as s has; matrices without rows or columns are taken, too.
Svd thin_svd(const MatrixXd& a);
/// U and V square.
Svd full_svd(const MatrixXd& a);
VectorXd singular_values(const MatrixXd& a);

/// Least squares by Householder's QR with column pivoting.
class LeastSquares {
 public:
  /// `threshold`: pivots that are smaller beside the largest count as zero; nothing: rounding.
  explicit LeastSquares(const MatrixXd& a, std::optional<double> threshold = {});
  ~LeastSquares();
  LeastSquares(LeastSquares&&) noexcept;
  LeastSquares& operator=(LeastSquares&&) noexcept;

  Eigen::Index rank() const;
  /// Of the smallest |a x - b|.
  VectorXd solve(const VectorXd& b) const;
  /// The same for every column.
  MatrixXd solve_all(const MatrixXd& b) const;
  /// (a' a)^-1 of a matrix of full rank.
  MatrixXd cofactor() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The shortest x of the smallest |a x - b|, by a complete orthogonal decomposition.
VectorXd shortest_least_squares(const MatrixXd& a, const VectorXd& b);
MatrixXd pseudo_inverse(const MatrixXd& a);

/// Householder QR with column pivoting, cut where |R_kk| falls to `threshold` (absolute).
struct PivotedQr {
  MatrixXd Q;             // rows x rank, orthonormal
  VectorXd diagonal;      // |R_kk|, rank of them
  Eigen::VectorXi order;  // all columns, the pivots first
};
PivotedQr pivoted_qr(const MatrixXd& a, double threshold);

/// a = L L' of a symmetric positive definite a.
class Cholesky {
 public:
  explicit Cholesky(const MatrixXd& a);
  ~Cholesky();
  Cholesky(Cholesky&&) noexcept;
  Cholesky& operator=(Cholesky&&) noexcept;

  /// a^-1 b.
  VectorXd solve(const VectorXd& b) const;
  MatrixXd solve_all(const MatrixXd& b) const;
  /// L^-1 b.
  VectorXd solve_lower(const VectorXd& b) const;
  MatrixXd solve_lower_all(const MatrixXd& b) const;
  /// log det L, half of that of a.
  double log_determinant_of_lower() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Cholesky of a positive semidefinite matrix, the largest rest first, cut where a pivot falls to
/// `threshold`: a(order, order) = lower lower' on the first `rank` of them.
struct PivotedCholesky {
  MatrixXd lower;  // rank x rank
  Eigen::VectorXi order;
  Eigen::Index rank = 0;
};
PivotedCholesky pivoted_cholesky(MatrixXd a, double threshold);

struct SymmetricEigen {
  VectorXd values;  // ascending
  MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const MatrixXd& a);
/// Inverse of a symmetric matrix on the directions whose eigenvalues exceed `threshold`, 0 on the others.
MatrixXd inverse_above(const MatrixXd& a, double threshold);

/// a^-1 b for a symmetric a that is positive definite, or all but (L D L').
VectorXd solve_positive(const MatrixXd& a, const VectorXd& b);
MatrixXd solve_positive_all(const MatrixXd& a, const MatrixXd& b);
/// log det of the same; entries of D below `least` count as that.
double log_determinant_of_positive(const MatrixXd& a, double least);

/// a^-1 b of a square a, by LU with row pivoting.
MatrixXd solve_square(const MatrixXd& a, const MatrixXd& b);
MatrixXd inverse_of(const MatrixXd& a);

/// `x` less its part along the orthonormal columns of `basis`.
void take_out(const MatrixXd& basis, VectorXd& x);
void take_out(const MatrixXd& basis, MatrixXd& x);

/// Every column of a times every column of b, element by element: column i * b.cols() + k is a_i b_k.
MatrixXd column_products(const MatrixXd& a, const MatrixXd& b);

/// A basis of the rows of `a` in echelon form, by LU with full pivoting: each row mixes as few columns as
/// elimination leaves.
MatrixXd row_echelon(const MatrixXd& a);

}  // namespace trunnion
