#include "effects/interpolants.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/effects/effect.hpp"

namespace trunnion {
namespace effects {

Place place_of(std::span<const double> nodes, double x) {
  // Most tables are evenly spaced.
  const double span = nodes.back() - nodes.front();
  const double guess = (x - nodes.front()) / span * static_cast<double>(nodes.size() - 1);
  if (guess >= 0.0 && guess < static_cast<double>(nodes.size() - 1)) {
    const auto i = static_cast<std::size_t>(guess);
    if (nodes[i] <= x && x < nodes[i + 1]) return {i, (x - nodes[i]) / (nodes[i + 1] - nodes[i])};
  }
  const auto upper = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, x);
  const auto i = static_cast<std::size_t>(upper - nodes.begin()) - 1;
  return {i, std::clamp((x - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)};
}

double straight_value(std::span<const double> nodes, std::span<const double> values, double x) {
  const auto [i, t] = place_of(nodes, x);
  return (1.0 - t) * values[i] + t * values[i + 1];
}

namespace {

// Fractions of the way from x0 to x1 at which a node is passed, 0 and 1 excluded.
void add_crossings(const std::vector<double>& nodes, double x0, double x1, std::vector<double>& out) {
  const auto first = std::upper_bound(nodes.begin(), nodes.end(), std::min(x0, x1));
  for (auto node = first; node != nodes.end() && *node < std::max(x0, x1); ++node) {
    out.push_back((*node - x0) / (x1 - x0));
  }
}

// Of a function that is straight along each argument between the nodes: both are met at nodes.
Interpolant::Range range_of(const Grid& grid) {
  Interpolant::Range out;
  for (std::size_t i = 0; i < grid.u.size(); ++i) {
    for (std::size_t j = 0; j < grid.columns(); ++j) {
      const double here = grid.at(i, j);
      out.largest = std::max(out.largest, std::abs(here));
      if (i > 0)
        out.slope_u = std::max(out.slope_u, std::abs(here - grid.at(i - 1, j)) / (grid.u[i] - grid.u[i - 1]));
      if (j > 0)
        out.slope_v = std::max(out.slope_v, std::abs(here - grid.at(i, j - 1)) / (grid.v[j] - grid.v[j - 1]));
    }
  }
  return out;
}

// Paper 000, Eq. (1)-(2): e = (1 - t) e_i + t e_i+1.
class Linear final : public Interpolant {
 public:
  explicit Linear(const Grid& grid) : grid_(grid) {}
  double value(double u, double) const override { return straight_value(grid_.u, grid_.values, u); }
  std::optional<Range> range() const override { return range_of(grid_); }
  const Grid* straight() const override { return &grid_; }
  // Straight between the nodes: farthest off at one of them.
  std::optional<double> bend(double u0, double, double u1, double) const override {
    const auto [low, high] = std::minmax(u0, u1);
    const std::size_t cell = place_of(grid_.u, low).index;
    if (grid_.u[cell] <= low && high <= grid_.u[cell + 1]) return 0.0;
    const auto first = std::upper_bound(grid_.u.begin(), grid_.u.end(), low);
    if (first == grid_.u.end() || !(*first < high)) return 0.0;
    const double at0 = value(u0, 0.0);
    const double at1 = value(u1, 0.0);
    double largest = 0.0;
    for (auto node = first; node != grid_.u.end() && *node < high; ++node) {
      const double t = (*node - u0) / (u1 - u0);
      largest = std::max(largest, std::abs(value(*node, 0.0) - ((1.0 - t) * at0 + t * at1)));
    }
    return largest;
  }

 private:
  Grid grid_;
};

// Paper 000, Eq. (3)-(4).
class Bilinear final : public Interpolant {
 public:
  explicit Bilinear(const Grid& grid) : grid_(grid) {}
  double value(double u, double v) const override {
    const auto [i, s] = place_of(grid_.u, u);
    const auto [j, t] = place_of(grid_.v, v);
    // Initialised: clang before 16 captures no structured bindings.
    const auto row = [this, j = j, t = t](std::size_t k) {
      return (1.0 - t) * grid_.at(k, j) + t * grid_.at(k, j + 1);
    };
    return (1.0 - s) * row(i) + s * row(i + 1);
  }
  std::optional<Range> range() const override { return range_of(grid_); }
  // Between the grid lines that the motion crosses the value is a quadratic of second derivative 2 c du dv, c
  // the mixed difference of the cell.
  std::optional<double> bend(double u0, double v0, double u1, double v1) const override {
    std::vector<double> cuts{0.0, 1.0};
    add_crossings(grid_.u, u0, u1, cuts);
    add_crossings(grid_.v, v0, v1, cuts);
    std::sort(cuts.begin(), cuts.end());
    const double at0 = value(u0, v0);
    const double at1 = value(u1, v1);
    const auto off = [&](double t) {
      return std::abs(value(u0 + t * (u1 - u0), v0 + t * (v1 - v0)) - ((1.0 - t) * at0 + t * at1));
    };
    double largest = 0.0;
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double h = cuts[k + 1] - cuts[k];
      const double middle = cuts[k] + 0.5 * h;
      const auto i = place_of(grid_.u, u0 + middle * (u1 - u0)).index;
      const auto j = place_of(grid_.v, v0 + middle * (v1 - v0)).index;
      const double mixed =
          (grid_.at(i + 1, j + 1) - grid_.at(i + 1, j) - grid_.at(i, j + 1) + grid_.at(i, j)) /
          ((grid_.u[i + 1] - grid_.u[i]) * (grid_.v[j + 1] - grid_.v[j]));
      const double bow = 0.25 * h * h * std::abs(mixed * (u1 - u0) * (v1 - v0));
      largest = std::max(largest, std::max(off(cuts[k]), off(cuts[k + 1])) + bow);
    }
    return largest;
  }

 private:
  Grid grid_;
};

std::optional<std::string> fault_of(const std::vector<double>& nodes, const char* name) {
  if (nodes.size() < 2)
    return std::string("an error table needs 2 nodes or more in each argument; ") + name + " has " +
           std::to_string(nodes.size());
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    if (!(nodes[i] < nodes[i + 1])) {
      return std::string("nodes of ") + name + " must ascend; " + shortest_text(nodes[i]) + " comes before " +
             shortest_text(nodes[i + 1]);
    }
  }
  return std::nullopt;
}

}  // namespace

std::shared_ptr<const Interpolant> make_linear(const Grid& grid) {
  return std::make_shared<Linear>(grid);
}
std::shared_ptr<const Interpolant> make_bilinear(const Grid& grid) {
  return std::make_shared<Bilinear>(grid);
}

}  // namespace effects

std::size_t StraightCourse::piece_at(double x) const {
  return effects::place_of(nodes, x).index;
}

std::optional<double> Interpolant::bend(double, double, double, double) const {
  return std::nullopt;
}
std::optional<Interpolant::Range> Interpolant::range() const {
  return std::nullopt;
}

std::string_view text_of(Interpolation method) {
  constexpr std::array<std::string_view, 4> kNames = {"linear", "bilinear", "nurbs", "spline"};
  return kNames[static_cast<std::size_t>(method)];
}

std::optional<Interpolation> interpolation_of(std::string_view text) {
  for (const Interpolation m :
       {Interpolation::linear, Interpolation::bilinear, Interpolation::nurbs, Interpolation::spline}) {
    if (text_of(m) == text) return m;
  }
  return std::nullopt;
}

Result<std::shared_ptr<const Interpolant>> make_interpolant(const Grid& grid,
                                                            const InterpolationOptions& options) {
  auto fault = effects::fault_of(grid.u, "the first argument");
  if (!fault && !grid.v.empty()) fault = effects::fault_of(grid.v, "the second argument");
  if (fault) return fail(ErrorCode::wrong_input, *fault);
  if (grid.values.size() != grid.u.size() * grid.columns()) {
    return fail(ErrorCode::wrong_input, "a grid of " + std::to_string(grid.u.size()) + " x " +
                                            std::to_string(grid.columns()) + " nodes has " +
                                            std::to_string(grid.values.size()) + " values");
  }
  switch (options.method) {
    case Interpolation::linear:
      if (!grid.v.empty())
        return fail(ErrorCode::wrong_input,
                    "linear interpolation takes one argument, the table has two: use bilinear");
      return effects::make_linear(grid);
    case Interpolation::bilinear:
      if (grid.v.empty())
        return fail(ErrorCode::wrong_input,
                    "bilinear interpolation takes two arguments, the table has one: use linear");
      return effects::make_bilinear(grid);
    case Interpolation::nurbs:
      return effects::make_nurbs(grid, options);
    case Interpolation::spline:
      if (!(options.smoothing >= 0.0)) return fail(ErrorCode::wrong_input, "smoothing must not be negative");
      return effects::make_spline(grid, options.smoothing);
  }
  return fail(ErrorCode::wrong_input, "unknown interpolation");
}

}  // namespace trunnion
