#include "effects/library_support.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion::effects {

std::vector<AxisId> LibraryBuilder::axes(AxisKind kind) const {
  std::vector<AxisId> out;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == kind) out.push_back(id);
  }
  return out;
}

std::optional<std::size_t> LibraryBuilder::temperature(const std::string& name) const {
  const auto& names = context_.names.temperatures;
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? std::nullopt : std::optional<std::size_t>(it - names.begin());
}

Twist unit_twist(char letter) {
  if (is_rotation(letter)) return {Vec3::Zero(), Vec3::Unit(letter - 'A')};
  TRUNNION_EXPECTS(letter >= 'X' && letter <= 'Z');
  return {Vec3::Unit(letter - 'X'), Vec3::Zero()};
}

Parameter linear(std::string name, Unit unit, double usual) {
  return {.name = std::move(name),
          .unit = unit,
          .role = ParameterRole::linear,
          .usual = usual * unit_factor(unit),
          .min = 0.0,
          .max = 0.0,
          .integer = false,
          .candidates = {}};
}

Parameter shape(std::string name, Unit unit, double usual, double min, double max) {
  const double factor = unit_factor(unit);
  return {.name = std::move(name),
          .unit = unit,
          .role = ParameterRole::shape,
          .usual = usual * factor,
          .min = min * factor,
          .max = max * factor,
          .integer = false,
          .candidates = {}};
}

Parameter lag_time() {
  return shape("tau", Unit::s, 2000.0, 300.0, 15000.0);
}

double harmonic_bend(double amplitude, double turn) {
  // A sine is never farther from a chord of its own than twice its amplitude.
  return std::abs(amplitude) * std::min(2.0, turn * turn / 8.0);
}

TwistBend bend_along(const Twist& unit, double size) {
  return {size * unit.trans_mm.norm(), size * unit.rot_rad.norm()};
}

double largest_legendre_second(int n, double a, double b) {
  switch (n) {
    case 1:
      return 0.0;
    case 2:
      return 3.0;
    case 3:
      return 15.0 * std::max(std::abs(a), std::abs(b));
    default: {
      // (105 t^2 - 15) / 2: largest at an end, or -7.5 in the middle.
      const double t2 = std::max(a * a, b * b);
      return std::max(7.5, std::abs(52.5 * t2 - 7.5));
    }
  }
}

std::array<double, 4> TiltAndTurn::products(const MachineState& state) const {
  const double t = state.q[tilt], r = state.q[turn];
  return {std::sin(t) * std::cos(r), std::sin(t) * std::sin(r), std::cos(t) * std::cos(r),
          std::cos(t) * std::sin(r)};
}

double TiltAndTurn::bend(double amplitude, const MachineState& from, const MachineState& to) const {
  // No second derivative of a product of two sines of size 1 is larger than 1, mixed ones included.
  return harmonic_bend(amplitude, std::abs(to.q[tilt] - from.q[tilt]) + std::abs(to.q[turn] - from.q[turn]));
}

std::vector<TiltAndTurn> tilts_and_turns(const Machine& machine) {
  const auto place = [&](AxisId id) {
    return std::find(machine.part_chain.begin(), machine.part_chain.end(), id);
  };
  const auto turn = machine.axis("C");
  std::vector<TiltAndTurn> out;
  if (!turn || place(*turn) == machine.part_chain.end()) return out;
  for (const char* name : {"A", "B"}) {
    const auto tilt = machine.axis(name);
    if (!tilt || place(*tilt) == machine.part_chain.end()) continue;
    out.push_back({*tilt, *turn, place(*turn) < place(*tilt)});
  }
  return out;
}

double normalised_position(const Axis& axis, double x) {
  return (2.0 * x - (axis.max + axis.min)) / (axis.max - axis.min);
}

double legendre(int n, double t) {
  switch (n) {
    case 1:
      return t;
    case 2:
      return 0.5 * (3.0 * t * t - 1.0);
    case 3:
      return 0.5 * t * (5.0 * t * t - 3.0);
    default:
      return 0.125 * ((35.0 * t * t - 30.0) * t * t + 3.0);
  }
}

}  // namespace trunnion::effects
