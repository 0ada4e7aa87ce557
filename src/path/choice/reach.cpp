#include "path/choice/reach.hpp"

#include <algorithm>
#include <limits>

#include "trunnion/base/number_text.hpp"

namespace trunnion::path {
namespace {

std::string degrees_text(double rad) {
  return fixed_text(rad * kDegreePerRad, 4) + " deg";
}

/// The axis of a solution that is farthest beyond its limits.
Reach reach_of_solution(const Machine& machine, const RotarySolution& solution) {
  Reach out;
  const auto rotary = machine.rotary_axes();
  for (std::size_t k = 0; k < rotary.size(); ++k) {
    const Axis& axis = machine.axes[rotary[k]];
    if (!axis.has_limits() || nearest_turn(axis, solution.angle[k], 0.5 * (axis.min + axis.max))) continue;
    // The turn that comes nearest to the travel.
    double by = std::numeric_limits<double>::infinity();
    double best = 0.0;
    for (int turn = -1; turn <= 1; ++turn) {
      const double value = solution.angle[k] + turn * kTwoPi;
      const double beyond = std::max(axis.min - value, value - axis.max);
      if (beyond < by) {
        by = beyond;
        best = value;
      }
    }
    if (by <= out.beyond_rad) continue;
    out.beyond_rad = by;
    out.text = "axis " + axis.name + " would have to go to " + degrees_text(best) + ", " + degrees_text(by) +
               " beyond its limits of " + degrees_text(axis.min) + " to " + degrees_text(axis.max);
  }
  return out;
}

}  // namespace

Reach reach_of(const Machine& machine, const Vec3& axis_P, const InverseOptions& options) {
  const RotarySolutions solutions = rotary_solutions(machine, axis_P, 0.0, options);
  if (solutions.count == 0)
    return {solutions.missing_by.rad(),
            "the rotary axes miss it by " + degrees_text(solutions.missing_by.rad())};
  Reach least = reach_of_solution(machine, solutions.at[0]);
  for (std::size_t i = 1; i < solutions.count; ++i) {
    const Reach other = reach_of_solution(machine, solutions.at[i]);
    if (other.beyond_rad < least.beyond_rad) least = other;
  }
  return least;
}

std::string unreachable_text(const Machine& machine, const Vec3& axis_P, const InverseOptions& options) {
  return "tool axis (" + fixed_text(axis_P.x(), 7) + ", " + fixed_text(axis_P.y(), 7) + ", " +
         fixed_text(axis_P.z(), 7) + ") cannot be reached: " + reach_of(machine, axis_P, options).text;
}

}  // namespace trunnion::path
