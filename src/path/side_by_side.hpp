#pragma once
#include <limits>

#include "trunnion/machine/table_kinematics.hpp"

// Formulas that are evaluated for one position or for two at once: T is `double` or `Lanes`.
namespace trunnion::path {

/// Rounding of one evaluation of the chain in doubles: a few units in the last place of every coordinate in
/// it, the angles times the arm included.
inline constexpr double kUnitsInTheLastPlace = 32.0 * std::numeric_limits<double>::epsilon();

template <class T>
T magnitude(const lanes::Triple<T>& v) {
  return lanes::abs(v.x) + lanes::abs(v.y) + lanes::abs(v.z);
}

/// What a Station says of its position, from w, b, g there and the sines.
template <class T>
struct StationOf {
  lanes::Triple<T> tip_P, axis_P;
  T arm2_outer, arm2_inner;
  T size_mm;

  template <class B>
  StationOf(const TableKinematics& k, const lanes::Triple<T>& w, const lanes::Triple<B>& b,
            const lanes::Triple<B>& g, const TableKinematics::SinesOf<T>& s) {
    const lanes::Triple<T> inner = k.turned_back(0, w, s) + b;
    tip_P = k.turned_back(1, inner, s) + g;
    const lanes::Triple<T> spindle{lanes::splat<T>(k.spindle().x()), lanes::splat<T>(k.spindle().y()),
                                   lanes::splat<T>(k.spindle().z())};
    axis_P = k.turned_back(1, k.turned_back(0, spindle, s), s);
    const auto direction = [&](std::size_t i) {
      const Vec3& n = k.direction(i);
      return lanes::Triple<double>{n.x(), n.y(), n.z()};
    };
    arm2_outer = lanes::squared(lanes::cross(direction(0), w));
    arm2_inner = lanes::squared(lanes::cross(direction(1), inner));
    size_mm = magnitude(w) + magnitude(b) + magnitude(g);
  }
};

/// Bounds on the derivatives of the tip over a piece from norms: no sine, no direction.
template <class T>
struct NormsOf {
  T al, ga;  // turns of the outer and the inner axis, not below 0
  T D;       // way of what the outer axis turns
  T al_rho, U1, U2, sig;

  /// `arm2_outer`, `arm2_inner`: the larger ones of the ends. Along a straight w the arm is largest at an
  /// end; a turn about n0 does not change it. `slope`: D and the way of b.
  NormsOf(const T& outer_turn, const T& inner_turn, const T& way, const T& slope, const T& arm2_outer,
          const T& arm2_inner)
      : al(outer_turn), ga(inner_turn), D(way) {
    al_rho = al * lanes::sqrt(arm2_outer);
    U1 = slope + al_rho;
    U2 = al * (2.0 * D + al_rho);
    sig = lanes::sqrt(arm2_inner) + U2 / 8.0;
  }
  /// max |p''|
  T M2() const { return ga * (ga * sig + 2.0 * U1) + U2; }
  /// max |p'''|
  T M3() const {
    const T U3 = al * al * (3.0 * D + al_rho);
    return ga * (ga * (ga * sig + 3.0 * U1) + 3.0 * U2) + U3;
  }
};

/// Rounding of the distances of the tip on a piece, mm: sizes of both ends, angles of all axes at both.
template <class T>
T tip_rounding(const T& sizes_mm, const T& angles) {
  return kUnitsInTheLastPlace * sizes_mm * (1.0 + angles);
}

}  // namespace trunnion::path
