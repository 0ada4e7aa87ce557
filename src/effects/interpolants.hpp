#pragma once
#include <memory>
#include <span>
#include <vector>

#include "trunnion/effects/table.hpp"

namespace trunnion::effects {

// One kind a file; the grid is checked by make_interpolant before.
std::shared_ptr<const Interpolant> make_linear(const Grid& grid);
std::shared_ptr<const Interpolant> make_bilinear(const Grid& grid);
/// Fails when an argument's interpolation matrix is singular (cannot happen for knots by averaging) or a
/// weight is not positive.
Result<std::shared_ptr<const Interpolant>> make_nurbs(const Grid& grid, const InterpolationOptions& options);
std::shared_ptr<const Interpolant> make_spline(const Grid& grid, double smoothing);

/// Interval of ascending `nodes` in which x lies, held to the first and last, and the place in it, held to
/// [0, 1].
struct Place {
  std::size_t index;
  double fraction;
};
Place place_of(std::span<const double> nodes, double x);
/// Of a function that is straight between the nodes and held beyond them.
double straight_value(std::span<const double> nodes, std::span<const double> values, double x);

}  // namespace trunnion::effects
