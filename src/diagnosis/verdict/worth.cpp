#include "diagnosis/verdict/worth.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {

Worth worth(const MatrixXd& columns, const VectorXd& whole, const VectorXd& white, double price,
            const VectorXd& largest) {
  constexpr double kHardlySeen = 1e-4, kHardlyOwn = 1e-3;
  Worth out;
  std::vector<Eigen::Index> chosen;
  MatrixXd rest = columns;
  const auto next = [&]() -> std::pair<Eigen::Index, double> {
    std::pair<Eigen::Index, double> best{-1, price};
    const VectorXd products = rest.transpose() * white;
    for (Eigen::Index k = 0; k < rest.cols(); ++k) {
      const double own = rest.col(k).norm();
      if (!(own > kHardlySeen * whole[k]) || !(own > kHardlyOwn * columns.col(k).norm())) continue;
      const double gain = std::pow(products[k] / own, 2);
      if (gain > best.second) best = {k, gain};
    }
    return best;
  };
  while (out.count < static_cast<double>(columns.cols())) {
    const auto [k, gain] = next();
    if (k < 0) break;
    chosen.push_back(k);
    out.gained += gain;
    out.count += 1.0;
    const VectorXd q = rest.col(k).normalized();
    for (int twice = 0; twice < 2; ++twice) rest -= q * (q.transpose() * rest);
  }
  if (chosen.empty() || largest.size() == 0) return out;
  const MatrixXd used = columns(Eigen::all, chosen);
  out.coefficients = used.householderQr().solve(white);
  for (std::size_t k = 0; k < chosen.size(); ++k)
    if (std::abs(out.coefficients[static_cast<Eigen::Index>(k)]) > largest[chosen[k]]) return {};
  return out;
}

}  // namespace trunnion::diagnosis
