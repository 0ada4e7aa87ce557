#pragma once
#include <array>
#include <limits>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/place_of.hpp"
#include "trunnion/path/point.hpp"

// Formulas that are evaluated for one position or for two at once: T is `double` or `Lanes`.
namespace trunnion::path {

/// Rounding of one evaluation of the chain in doubles: a few units in the last place of every coordinate in
/// it, the angles times the arm included.
inline constexpr double kUnitsInTheLastPlace = 32.0 * std::numeric_limits<double>::epsilon();

template <class T>
T magnitude(const lanes::Triple<T>& v) {
  return lanes::abs(v.x) + lanes::abs(v.y) + lanes::abs(v.z);
}

/// What is the same at every position of a machine whose linear axes stand before the rotary ones along X, Y
/// and Z of M: w at zero, b and g, the spindle and the directions of the rotary axes (TableKinematics).
template <class T>
struct ConstantsOf {
  lanes::Triple<T> w0, b, g, spindle;
  std::array<lanes::Triple<T>, 2> axis;
  T along_outer, between;  // AxisMotion
  T along_inner_fixed, along_inner_cos, along_inner_sin;

  /// Component of the tool axis along the inner rotary axis: that turns about it, only the outer one tells.
  T along_inner(const TableKinematics::SinesOf<T>& s) const {
    return along_inner_fixed + along_inner_cos * s.cos[0] - along_inner_sin * s.sin[0];
  }

  explicit ConstantsOf(const TableKinematics& k)
      : w0(of(k.constant(0))),
        b(of(k.constant(1))),
        g(of(k.constant(2))),
        spindle(of(k.spindle())),
        axis{of(k.direction(0)), of(k.direction(1))},
        along_outer(lanes::dot(axis[0], spindle)),
        between(lanes::dot(axis[0], axis[1])),
        along_inner_fixed(between * along_outer),
        along_inner_cos(lanes::dot(axis[1], spindle) - along_inner_fixed),
        along_inner_sin(lanes::dot(axis[1], lanes::cross(axis[0], spindle))) {}

 private:
  static lanes::Triple<T> of(const lanes::Triple<double>& v) {
    return {lanes::splat<T>(v.x), lanes::splat<T>(v.y), lanes::splat<T>(v.z)};
  }
  static lanes::Triple<T> of(const Vec3& v) { return of(lanes::Triple<double>{v.x(), v.y(), v.z()}); }
};

/// Positions of the linear axes that put the tip at `tip_P`: TableKinematics::linear_positions.
template <class T>
lanes::Triple<T> linear_positions(const TableKinematics& k, const ConstantsOf<T>& c,
                                  const lanes::Triple<T>& tip_P, const TableKinematics::SinesOf<T>& s) {
  return k.turned(0, k.turned(1, tip_P - c.g, s) - c.b, s) - c.w0;
}

/// As RotarySines::turn.
template <class T>
void turn_on(T& sin, T& cos, const T& by) {
  const T d = by - by * by * by / 6.0;
  const T e = 0.5 * by * by;
  const T s = sin;
  sin = s - e * s + d * cos;
  cos = cos - e * cos - d * s;
}

/// The grid on which the NC words stand.
template <class T>
class WordGridOf {
 public:
  explicit WordGridOf(const Rounding& rounding) {
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      rounds_[id] = rounding.quantum[id] > 0.0;
      unit_[id] = lanes::splat<T>(rounding.quantum[id]);
      offset_[id] = lanes::splat<T>(rounding.offset[id]);
    }
  }
  /// As Rounding::rounded, for values that a word can hold.
  T rounded(AxisId id, const T& value) const {
    if (!rounds_[id]) return value;
    return unit_[id] * lanes::nearest<T>((value + offset_[id]) / unit_[id]) - offset_[id];
  }

 private:
  std::array<T, kMaxAxes> unit_, offset_;
  std::array<bool, kMaxAxes> rounds_{};
};

/// What a Station says of its position, from w there and the sines.
template <class T>
struct StationOf {
  lanes::Triple<T> tip_P, axis_P;
  T arm2_outer, arm2_inner;
  T size_mm;

  StationOf(const TableKinematics& k, const ConstantsOf<T>& c, const lanes::Triple<T>& w,
            const TableKinematics::SinesOf<T>& s) {
    const lanes::Triple<T> inner = k.turned_back(0, w, s) + c.b;
    tip_P = k.turned_back(1, inner, s) + c.g;
    axis_P = k.turned_back(1, k.turned_back(0, c.spindle, s), s);
    arm2_outer = lanes::squared(lanes::cross(c.axis[0], w));
    arm2_inner = lanes::squared(lanes::cross(c.axis[1], inner));
    size_mm = magnitude(w) + magnitude(c.b) + magnitude(c.g);
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

/// Sines half way between rotary positions that are less than a right angle apart: middle_sines.
template <class T>
TableKinematics::SinesOf<T> middle_sines_of(const TableKinematics::SinesOf<T>& a,
                                            const TableKinematics::SinesOf<T>& b) {
  TableKinematics::SinesOf<T> out;
  for (std::size_t k = 0; k < 2; ++k) {
    const T sin = a.sin[k] + b.sin[k];
    const T cos = a.cos[k] + b.cos[k];
    const T scale = 1.0 / lanes::sqrt(T(sin * sin + cos * cos));
    out.sin[k] = sin * scale;
    out.cos[k] = cos * scale;
  }
  return out;
}

/// Largest |e - parabola| for |p'''| up to M3: of the parabola through the ends and the middle of a piece.
template <class T>
T beyond_parabola(const T& M3) {
  constexpr double kSqrt3 = 1.7320508075688772;
  return M3 / (72.0 * kSqrt3);
}
/// Up to this turn, rad, the sines half way are those of the bisector of the ends' directions, without a new
/// sine. Near half a turn between the ends it would lose digits.
inline constexpr double kBisectorTurn = 1.0;

/// What the bow of the tool axis over a motion of the rotary axes hangs on.
template <class T>
struct AxisMotion {
  T outer, inner;  // by which they turn, rad
  T along_outer;   // component of the tool axis along the outer one: the same everywhere
  T along_inner;   // along the inner one, where the motion ends
  T between;       // cosine of the angle between both: the same everywhere
};

/// How far a point 1 mm up the tool is at most off its place because of the axis, mm: `off_axis` at the ends
/// of a motion, and what axis and arc leave each other by in between, where the places of the path run
/// evenly. No sine is asked for. README, "The axis beside its arc".
template <class T>
T off_for_each_mm_up(const AxisMotion<T>& motion, const T& off_axis) {
  constexpr double kNotKnown = 1e300;
  const T& al = motion.outer;
  const T& ga = motion.inner;
  const T both = lanes::abs(T(al * ga));
  const T turn = lanes::abs(al) + lanes::abs(ga);
  // Of the turn w the part along the tool axis, and the speed of the axis, |w x u|: at the end, and anywhere.
  const T along = al * motion.along_outer + ga * motion.along_inner;
  const T speed2 = al * al + ga * ga + 2.0 * motion.between * al * ga - along * along;
  const T most_along = lanes::abs(along) + both;
  const T change = both + most_along * turn;
  const T speed = lanes::sqrt(lanes::select(speed2 > 0.0, speed2, T{})) + change;
  const T sideways = most_along * speed + both;
  // The arc's own speed differs by so much at most.
  const T chord = turn + 2.0 * off_axis;
  const T unlike = change + 0.5 * turn * turn + 2.0 * off_axis + chord * chord * chord * (1.0 / 21.0);
  const T arc = turn + unlike;
  const T inwards = unlike * (turn + arc);
  const T most = off_axis + (sideways + inwards + arc * arc * off_axis) / (8.0 - arc * arc);
  return lanes::select(chord <= 1.0, most, lanes::splat<T>(kNotKnown));
}

using lanes::across;

/// The motions that end at a few positions: from the last of those before, and between them.
template <class T>
struct MotionsOf {
  T outer, inner;  // turns, not below 0
  T bow_mm;        // by which the tip leaves its own chord at most
  T rounding_mm;   // of that

  MotionsOf(const PlaceOf<T>& last, const PlaceOf<T>& to) {
    const auto sum = [](const T& before, const T& now) -> T {
      return lanes::abs(across(before, now)) + lanes::abs(now);
    };
    outer = lanes::abs(turned(last, to, 0));
    inner = lanes::abs(turned(last, to, 1));
    rounding_mm = tip_rounding<T>(sum(last.size_mm, to.size_mm),
                                  sum(last.angle[0], to.angle[0]) + sum(last.angle[1], to.angle[1]));
    bow_mm = norms(last, to).M2() / 8.0 + rounding_mm;
  }

  NormsOf<T> norms(const PlaceOf<T>& last, const PlaceOf<T>& to) const {
    const auto larger = [](const T& before, const T& now) -> T {
      return lanes::larger(across(before, now), now);
    };
    const T D = lanes::sqrt(T(lanes::squared(way(last.w, to.w))));
    return {
        outer, inner, D, D, larger(last.arm2_outer, to.arm2_outer), larger(last.arm2_inner, to.arm2_inner)};
  }
  /// To positions at which the tool axis has this component along the inner one.
  static AxisMotion<T> of_axis(const ConstantsOf<T>& chain, const PlaceOf<T>& last, const PlaceOf<T>& to,
                               const T& along_inner) {
    return {turned(last, to, 0), turned(last, to, 1), chain.along_outer, along_inner, chain.between};
  }
  /// Of axis k, the outer one 0; from where a vector was to where it is.
  static T turned(const PlaceOf<T>& last, const PlaceOf<T>& to, std::size_t k) {
    return to.angle[k] - across(last.angle[k], to.angle[k]);
  }
  static lanes::Triple<T> way(const lanes::Triple<T>& last, const lanes::Triple<T>& to) {
    return {to.x - across(last.x, to.x), to.y - across(last.y, to.y), to.z - across(last.z, to.z)};
  }
};

/// The same of the tool axis, a unit vector.
template <class T>
T axis_rounding(const T& angles) {
  return kUnitsInTheLastPlace * (1.0 + angles);
}

}  // namespace trunnion::path
