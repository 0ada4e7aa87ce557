#include "diagnosis/search/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kSeries = 48;               // simulated: their spread is known to 10 %
constexpr std::size_t kFewestPairs = 12;  // along one axis
constexpr double kSameGap = 0.25;  // of an axis' measured range: readings farther apart are no neighbours

struct Pairs {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> along;
  double product(const Eigen::Ref<const VectorXd>& r) const {
    double sum = 0.0, squares = 0.0;
    for (const auto& [a, b] : along) {
      sum += r[a] * r[b];
      squares += 0.5 * (r[a] * r[a] + r[b] * r[b]);
    }
    return squares > 0.0 ? sum / squares : 0.0;
  }
};

// Neighbours along an axis while it moves: sorted by its position within a group, and within what the other
// axes do.
Pairs pairs_along(const Observations& o, const std::vector<bool>& used, AxisId axis) {
  Pairs out;
  double low = INFINITY, high = -INFINITY;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    low = std::min(low, o.state(i).q[axis]);
    high = std::max(high, o.state(i).q[axis]);
  }
  const double reach = kSameGap * (high - low);
  if (!(reach > 1e-9)) return out;
  for (const auto& group : o.groups()) {
    std::vector<Eigen::Index> order;
    for (const Eigen::Index i : group)
      if (used[static_cast<std::size_t>(i)]) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return o.state(a).q[axis] < o.state(b).q[axis]; });
    if (order.size() < 3 || o.state(order.back()).q[axis] - o.state(order.front()).q[axis] < 1e-9) continue;
    for (std::size_t k = 1; k < order.size(); ++k)
      if (o.state(order[k]).q[axis] - o.state(order[k - 1]).q[axis] <= reach)
        out.along.emplace_back(order[k - 1], order[k]);
  }
  return out;
}

// Noise of the readings with the correlation that was found, one series a column.
MatrixXd simulated(const Atoms& atoms, const NoiseScale& noise, std::uint64_t seed) {
  const Observations& o = atoms.observations();
  const auto& u = atoms.base().whitening->noise().u;
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  MatrixXd e(o.size(), kSeries);
  for (Eigen::Index c = 0; c < kSeries; ++c)
    for (Eigen::Index i = 0; i < e.rows(); ++i) e(i, c) = normal(engine);
  if (noise.phi > 0.0)
    for (const auto& s : noise.sequences)
      for (std::size_t i = 1; i < s.size(); ++i)
        e.row(s[i]) = noise.phi * e.row(s[i - 1]) + std::sqrt(1.0 - noise.phi * noise.phi) * e.row(s[i]);
  return u.asDiagonal() * e;
}

}  // namespace

std::vector<Company> companions(const Observations& o, const std::vector<bool>& outliers,
                                const VectorXd& white) {
  constexpr double kMost = 3.0;       // of one neighbour: it may be an outlier by chance
  constexpr double kTimeless = 1e-4;  // time decides between equal poses only
  const std::size_t axes = o.machine().axes.size();
  std::vector<double> low(axes, INFINITY), high(axes, -INFINITY);
  for (Eigen::Index i = 0; i < o.size(); ++i)
    for (AxisId a = 0; a < axes; ++a) {
      low[a] = std::min(low[a], o.state(i).q[a]);
      high[a] = std::max(high[a], o.state(i).q[a]);
    }
  std::vector<Company> out(outliers.size());
  for (const auto& group : o.groups())
    for (const Eigen::Index i : group) {
      if (!outliers[static_cast<std::size_t>(i)]) continue;
      const MachineState& s = o.state(i);
      const double duration = std::max(o.data().context.runs[s.run].duration_s, 1e-9);
      const auto beside = [&](Eigen::Index k) {
        return std::clamp(white[i] > 0.0 ? white[k] : -white[k], -kMost, kMost);
      };
      Company& here = out[static_cast<std::size_t>(i)];
      double nearest = INFINITY, next = INFINITY;
      for (const Eigen::Index k : group) {
        if (k == i) continue;
        double distance = kTimeless * std::pow((o.state(k).time_s - s.time_s) / duration, 2);
        for (AxisId a = 0; a < axes; ++a)
          if (high[a] > low[a]) distance += std::pow((o.state(k).q[a] - s.q[a]) / (high[a] - low[a]), 2);
        if (distance < nearest) {
          next = nearest, here.next = here.nearest;
          nearest = distance, here.nearest = beside(k);
        } else if (distance < next) {
          next = distance, here.next = beside(k);
        }
      }
    }
  return out;
}

double company(const Observations& o, const std::vector<bool>& outliers, const VectorXd& white) {
  double nearest = 0.0, both = 0.0, count = 0.0;
  for (const Company& c : companions(o, outliers, white)) {
    if (c.nearest == 0.0) continue;
    nearest += c.nearest;
    both += c.nearest + c.next;
    count += 1.0;
  }
  return count > 0.0 ? std::max(nearest / std::sqrt(count), both / std::sqrt(2.0 * count)) : 0.0;
}

std::vector<NeighbourTest> neighbour_tests(const Atoms& atoms, const Remainder& set, const NoiseScale& noise,
                                           std::uint64_t seed) {
  const Observations& o = atoms.observations();
  const auto& used = atoms.base().whitening->noise().used;
  MatrixXd series = atoms.base().projected(simulated(atoms, noise, seed));
  take_out(set.basis, series);
  std::vector<NeighbourTest> out;
  for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis) {
    const Pairs pairs = pairs_along(o, used, axis);
    if (pairs.along.size() < kFewestPairs) continue;
    double mean = 0.0, square = 0.0;
    for (Eigen::Index c = 0; c < kSeries; ++c) {
      const double v = pairs.product(series.col(c));
      mean += v / kSeries;
      square += v * v / kSeries;
    }
    const double spread = std::sqrt(std::max(square - mean * mean, 1e-12));
    out.push_back(
        {o.machine().axes[axis].name, (pairs.product(set.residual) - mean) / spread, pairs.along.size()});
  }
  return out;
}

}  // namespace trunnion::diagnosis
