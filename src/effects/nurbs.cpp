// NURBS surface through the nodes of a grid (paper 000, Eq. (5), section 3.3; Piegl & Tiller, The NURBS
// Book, 9.2.5):
//   e(u, v) = sum_kl N_k,r(u) M_l,s(v) w_kl e_kl / sum_kl N_k,r(u) M_l,s(v) w_kl
// The parameters are the arguments themselves, mapped to [0, 1]: all section lines of a grid share them, so
// that their knot vectors (by averaging, Eq. 9.8) are one, and no inversion is needed to find the error at a
// position.
#include <algorithm>
#include <array>

#include "trunnion/geom/linear_algebra.hpp"

#include "effects/interpolants.hpp"

namespace trunnion::effects {
namespace {

constexpr int kMaxDegree = 9;
using Basis = std::array<double, kMaxDegree + 1>;

// B-spline basis of one argument.
class Direction1 {
 public:
  Direction1(const std::vector<double>& nodes, int degree)
      : nodes_(nodes), degree_(std::min({degree, kMaxDegree, static_cast<int>(nodes.size()) - 1})) {
    const auto n = nodes.size();
    const auto p = static_cast<std::size_t>(degree_);
    knots_.assign(p + 1, 0.0);
    for (std::size_t j = 1; j + p < n; ++j) {
      double sum = 0.0;
      for (std::size_t i = j; i < j + p; ++i) sum += parameter(nodes[i]);
      knots_.push_back(sum / static_cast<double>(p));
    }
    knots_.insert(knots_.end(), p + 1, 1.0);
  }

  int degree() const { return degree_; }
  std::size_t size() const { return nodes_.size(); }
  double parameter(double x) const {
    return std::clamp((x - nodes_.front()) / (nodes_.back() - nodes_.front()), 0.0, 1.0);
  }

  // The degree + 1 functions that are not zero at x; returns the index of the first (The NURBS Book, A2.1 and
  // A2.2).
  std::size_t functions(double x, Basis& out) const {
    const double u = parameter(x);
    const auto p = static_cast<std::size_t>(degree_);
    const auto begin = knots_.begin() + static_cast<std::ptrdiff_t>(p) + 1;
    const auto end = knots_.end() - static_cast<std::ptrdiff_t>(p) - 1;
    const auto span = static_cast<std::size_t>(std::upper_bound(begin, end, u) - knots_.begin()) - 1;
    Basis left{}, right{};
    out[0] = 1.0;
    for (std::size_t j = 1; j <= p; ++j) {
      left[j] = u - knots_[span + 1 - j];
      right[j] = knots_[span + j] - u;
      double saved = 0.0;
      for (std::size_t r = 0; r < j; ++r) {
        const double part = out[r] / (right[r + 1] + left[j - r]);
        out[r] = saved + right[r + 1] * part;
        saved = left[j - r] * part;
      }
      out[j] = saved;
    }
    return span - p;
  }

  // Row i: all basis functions at node i.
  Eigen::MatrixXd collocation() const {
    const auto n = static_cast<Eigen::Index>(size());
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
    Basis basis{};
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t first = functions(nodes_[static_cast<std::size_t>(i)], basis);
      for (std::size_t k = 0; k <= static_cast<std::size_t>(degree_); ++k) {
        out(i, static_cast<Eigen::Index>(first + k)) = basis[k];
      }
    }
    return out;
  }

 private:
  std::vector<double> nodes_;
  int degree_;
  std::vector<double> knots_;
};

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Nurbs final : public Interpolant {
 public:
  Nurbs(Direction1 u, std::optional<Direction1> v, Matrix numerator, Matrix weights)
      : u_(std::move(u)), v_(std::move(v)), numerator_(std::move(numerator)), weights_(std::move(weights)) {}

  double value(double u, double v) const override {
    Basis N{}, M{1.0};
    const auto k0 = static_cast<Eigen::Index>(u_.functions(u, N));
    const auto l0 = v_ ? static_cast<Eigen::Index>(v_->functions(v, M)) : 0;
    const Eigen::Index r = u_.degree();
    const Eigen::Index s = v_ ? v_->degree() : 0;
    double top = 0.0, bottom = 0.0;
    for (Eigen::Index k = 0; k <= r; ++k) {
      double t = 0.0, b = 0.0;
      for (Eigen::Index l = 0; l <= s; ++l) {
        const double m = M[static_cast<std::size_t>(l)];
        t += m * numerator_(k0 + k, l0 + l);
        b += m * weights_(k0 + k, l0 + l);
      }
      top += N[static_cast<std::size_t>(k)] * t;
      bottom += N[static_cast<std::size_t>(k)] * b;
    }
    return top / bottom;
  }

 private:
  Direction1 u_;
  std::optional<Direction1> v_;
  Matrix numerator_;  // w_kl e_kl
  Matrix weights_;
};

}  // namespace

Result<std::shared_ptr<const Interpolant>> make_nurbs(const Grid& grid, const InterpolationOptions& options) {
  const auto n = static_cast<Eigen::Index>(grid.u.size());
  const auto m = static_cast<Eigen::Index>(grid.columns());
  if (!options.weights.empty() && options.weights.size() != grid.values.size()) {
    return fail(ErrorCode::wrong_input, std::to_string(options.weights.size()) + " weights for " +
                                            std::to_string(grid.values.size()) + " nodes");
  }
  if (!std::all_of(options.weights.begin(), options.weights.end(), [](double w) { return w > 0.0; })) {
    return fail(ErrorCode::wrong_input, "NURBS weights must be above 0");
  }
  Direction1 u(grid.u, options.degree[0]);
  std::optional<Direction1> v;
  if (!grid.v.empty()) v.emplace(grid.v, options.degree[1]);
  const Eigen::MatrixXd N = u.collocation();
  const Eigen::MatrixXd M = v ? v->collocation() : Eigen::MatrixXd::Identity(1, 1);
  Matrix weights = Matrix::Ones(n, m);
  if (!options.weights.empty()) weights = Eigen::Map<const Matrix>(options.weights.data(), n, m);
  const Eigen::MatrixXd values = Eigen::Map<const Matrix>(grid.values.data(), n, m);
  // Homogeneous coordinates: first along u for every section line, then along v through the control values
  // (section 3.3).
  const Eigen::MatrixXd at_nodes = values.cwiseProduct(N * weights * M.transpose());
  const Eigen::MatrixXd along_u = solve_square(N, at_nodes);
  const Eigen::MatrixXd control = solve_square(M, along_u.transpose());
  if (!control.allFinite())
    return fail(ErrorCode::wrong_input, "the nodes of the table lie too unevenly for a NURBS surface");
  return std::make_shared<Nurbs>(std::move(u), std::move(v), Matrix(control.transpose()), std::move(weights));
}

}  // namespace trunnion::effects
