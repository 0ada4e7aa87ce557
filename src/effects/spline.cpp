// Tensor product of natural cubic splines, with smoothing (Reinsch; Green & Silverman, Nonparametric
// Regression, 2.3.3):
//   along one argument the smoothed node values are g = (I + lambda K)^-1 y, K = Q R^-1 Q^T, which minimises
//   sum (y_i - g(x_i))^2 + lambda integral g''^2, x counted in mean spacings; lambda = 0 interpolates.
// On a grid the smoother of either argument is applied in turn, and so is the spline. C2 everywhere inside:
// no kinks in the path.
#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "effects/interpolants.hpp"

namespace trunnion::effects {
namespace {

// Natural cubic spline of one argument: node values to second derivatives, and to smoothed values.
struct Operators {
  Eigen::MatrixXd second;  // n x n: node values -> second derivatives at the nodes (first and last row 0)
  Eigen::MatrixXd smooth;  // n x n
};

Operators operators(const std::vector<double>& nodes, double smoothing) {
  const auto n = static_cast<Eigen::Index>(nodes.size());
  const auto h = [&](Eigen::Index i) {
    return nodes[static_cast<std::size_t>(i) + 1] - nodes[static_cast<std::size_t>(i)];
  };
  Operators out{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Identity(n, n)};
  if (n < 3) return out;  // a straight line has no second derivative
  Eigen::MatrixXd Q = Eigen::MatrixXd::Zero(n, n - 2);
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n - 2, n - 2);
  for (Eigen::Index j = 0; j < n - 2; ++j) {
    Q(j, j) = 1.0 / h(j);
    Q(j + 1, j) = -1.0 / h(j) - 1.0 / h(j + 1);
    Q(j + 2, j) = 1.0 / h(j + 1);
    R(j, j) = (h(j) + h(j + 1)) / 3.0;
    if (j + 1 < n - 2) R(j, j + 1) = R(j + 1, j) = h(j + 1) / 6.0;
  }
  const Eigen::MatrixXd inner = solve_square(R, Q.transpose());
  out.second.middleRows(1, n - 2) = inner;
  if (smoothing > 0.0) {
    const double spacing = (nodes.back() - nodes.front()) / static_cast<double>(n - 1);
    const double lambda = smoothing * spacing * spacing * spacing;  // the roughness in units of the spacing
    out.smooth = inverse_of(Eigen::MatrixXd::Identity(n, n) + lambda * Q * inner);
  }
  return out;
}

// Weights of value i, value i + 1, second derivative i, second derivative i + 1.
std::array<double, 4> weights(std::span<const double> nodes, double x, std::size_t& index) {
  const auto [i, b] = place_of(nodes, x);
  const double a = 1.0 - b;
  const double h2 = (nodes[i + 1] - nodes[i]) * (nodes[i + 1] - nodes[i]) / 6.0;
  index = i;
  return {a, b, (a * a * a - a) * h2, (b * b * b - b) * h2};
}

class Spline final : public Interpolant {
 public:
  Spline(const Grid& grid, double smoothing) : u_(grid.u), v_(grid.v) {
    const auto n = static_cast<Eigen::Index>(grid.u.size());
    const auto m = static_cast<Eigen::Index>(grid.columns());
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Operators along_u = operators(grid.u, smoothing);
    Eigen::MatrixXd f = along_u.smooth * Eigen::Map<const Rows>(grid.values.data(), n, m);
    Eigen::MatrixXd second_v = Eigen::MatrixXd::Zero(m, m);
    if (!v_.empty()) {
      const Operators along_v = operators(grid.v, smoothing);
      f = (f * along_v.smooth.transpose()).eval();
      second_v = along_v.second;
    }
    parts_[0][0] = f;
    parts_[0][1] = f * second_v.transpose();
    parts_[1][0] = along_u.second * f;
    parts_[1][1] = parts_[1][0] * second_v.transpose();
  }

  double value(double u, double v) const override {
    std::size_t i = 0, j = 0;
    const auto wu = weights(u_, u, i);
    std::array<double, 4> wv{1.0, 0.0, 0.0, 0.0};
    if (!v_.empty()) wv = weights(v_, v, j);
    const std::size_t last_v = v_.empty() ? 1 : 2;
    double sum = 0.0;
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        if (b % 2 >= last_v || wv[b] == 0.0) continue;
        const auto& part = parts_[a / 2][b / 2];
        sum +=
            wu[a] * wv[b] * part(static_cast<Eigen::Index>(i + a % 2), static_cast<Eigen::Index>(j + b % 2));
      }
    }
    return sum;
  }

  // One argument: the second derivative is linear between the nodes, so largest at one of them or an end.
  // Outside the range the end's value is held, inside the range of the motion: nothing is claimed there.
  std::optional<double> bend(double u0, double, double u1, double) const override {
    if (!v_.empty() || std::min(u0, u1) < u_.front() || std::max(u0, u1) > u_.back()) return std::nullopt;
    const std::size_t first = place_of(u_, std::min(u0, u1)).index;
    const std::size_t last = place_of(u_, std::max(u0, u1)).index + 1;
    double second = 0.0;
    for (std::size_t i = first; i <= last; ++i) {
      second = std::max(second, std::abs(parts_[1][0](static_cast<Eigen::Index>(i), 0)));
    }
    return second * (u1 - u0) * (u1 - u0) / 8.0;
  }

 private:
  std::vector<double> u_, v_;
  std::array<std::array<Eigen::MatrixXd, 2>, 2> parts_;  // [second derivative in u][in v]
};

}  // namespace

std::shared_ptr<const Interpolant> make_spline(const Grid& grid, double smoothing) {
  return std::make_shared<Spline>(grid, smoothing);
}

}  // namespace trunnion::effects
