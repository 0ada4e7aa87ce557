#include "effects/closed_turn.hpp"

#include <algorithm>

#include "trunnion/base/units.hpp"

namespace trunnion {

bool lacks_end_of_turn(const std::vector<double>& nodes) {
  if (nodes.empty()) return false;
  double widest = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) widest = std::max(widest, nodes[i + 1] - nodes[i]);
  const double gap = nodes.front() + kTwoPi - nodes.back();
  constexpr double kSlack = 1e-9;  // rad: a table from 0 to 360 deg is closed already
  constexpr double kSameStep = 1.001;
  return gap >= kSlack && gap <= kSameStep * widest;
}

void close_turn(Grid& grid, std::size_t k) {
  const std::size_t columns = grid.columns();
  std::vector<double>& nodes = k == 0 ? grid.u : grid.v;
  nodes.push_back(nodes.front() + kTwoPi);
  if (k == 0) {
    const std::vector<double> first(grid.values.begin(),
                                    grid.values.begin() + static_cast<std::ptrdiff_t>(columns));
    grid.values.insert(grid.values.end(), first.begin(), first.end());
    return;
  }
  std::vector<double> wider;
  wider.reserve(grid.u.size() * (columns + 1));
  for (std::size_t i = 0; i < grid.u.size(); ++i) {
    for (std::size_t j = 0; j <= columns; ++j) wider.push_back(grid.values[i * columns + j % columns]);
  }
  grid.values = std::move(wider);
}

}  // namespace trunnion
