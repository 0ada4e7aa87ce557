#pragma once
#include <Eigen/Core>

namespace trunnion::diagnosis {

// Decompositions of Eigen, instantiated once: they take most of the compile time of whoever includes them.

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Svd {
  MatrixXd U, V;  // thin
  VectorXd s;     // descending
};
Svd thin_svd(const MatrixXd& a);

/// Householder QR with column pivoting, cut where |R_kk| falls to `threshold` (absolute).
struct PivotedQr {
  MatrixXd Q;             // rows x rank, orthonormal
  VectorXd diagonal;      // |R_kk|, rank of them
  Eigen::VectorXi order;  // all columns, the pivots first
};
PivotedQr pivoted_qr(const MatrixXd& a, double threshold);

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

/// Every column of a times every column of b, element by element: column i * b.cols() + k is a_i b_k.
MatrixXd column_products(const MatrixXd& a, const MatrixXd& b);

/// a^-1 b for a symmetric positive definite a.
VectorXd solve_positive(const MatrixXd& a, const VectorXd& b);

}  // namespace trunnion::diagnosis
