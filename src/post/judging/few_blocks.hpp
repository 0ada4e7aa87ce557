#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "trunnion/path/station_run.hpp"

#include "post/judging/path_place.hpp"

// Private to QuietRun: a few blocks side by side, and places on the CL path beside them. T is `Lanes` or
// `Quads`.
namespace trunnion::post {

inline constexpr double kSamePoint2 = kSamePoint_mm * kSamePoint_mm;

// Summed in the order of Vec3, so that one block gives the same bits.
template <class T>
T inner(const lanes::Triple<T>& a, const lanes::Triple<T>& b) {
  return a.x * b.x + (a.y * b.y + a.z * b.z);
}
template <class T>
T length2(const lanes::Triple<T>& a) {
  return inner(a, a);
}
template <class T>
T length(const lanes::Triple<T>& a) {
  return lanes::sqrt(length2(a));
}
template <class T, class Mask>
lanes::Triple<T> chosen(const Mask& mask, const lanes::Triple<T>& a, const lanes::Triple<T>& b) {
  return {lanes::select(mask, a.x, b.x), lanes::select(mask, a.y, b.y), lanes::select(mask, a.z, b.z)};
}
// A number that is none is left as it is.
template <class T>
T clamped(const T& x, const T& least) {
  const T one = lanes::splat<T>(1.0);
  return lanes::select(x < least, least, lanes::select(x > one, one, x));
}
// Of the ends of the blocks what holds where each of them begins; `first`: of the end before them.
inline Lanes shifted(double first, const Lanes& of_ends) {
  return Lanes{first, of_ends[0]};
}
inline Quads shifted(double first, const Quads& of_ends) {
  return Quads{first, of_ends[0], of_ends[1], of_ends[2]};
}
// The chords of blocks.
template <class T>
struct Chords {
  lanes::Triple<T> from, to, from_axis, to_axis;
  lanes::Triple<T> way;
  T way2, way_mm;

  Chords(const path::PoseRun& poses, std::size_t row)
      : from(lanes::load_vectors<T>(poses.tip_P, row)),
        to(lanes::load_vectors<T>(poses.tip_P, row + 1)),
        from_axis(lanes::load_vectors<T>(poses.axis_P, row)),
        to_axis(lanes::load_vectors<T>(poses.axis_P, row + 1)),
        way(to - from),
        way2(length2(way)),
        way_mm(lanes::sqrt(way2)) {}

  // As `leaves` sees it.
  lanes::Mask<T> may_leave() const {
    const T out = inner(way, from_axis);
    return (out > 0.0) & (out * out > kAlong2 * way2);
  }
};

// By how much the blocks miss a CL point that they pass, squared: at its foot on the chord, the first one
// behind `least` of it.
template <class T>
struct PassedAt {
  T t, off2_mm2, off2_axis;
  PassedAt(const Chords<T>& block, const lanes::Triple<T>& tip_P, const lanes::Triple<T>& axis_P,
           const T& least)
      : t(clamped<T>(inner(tip_P - block.from, block.way) / block.way2, least)),
        off2_mm2(length2(block.from + t * block.way - tip_P)),
        off2_axis(length2(block.from_axis + t * (block.to_axis - block.from_axis) - axis_P)) {}
};

// Of ends of blocks: Place at a fraction of a segment. `plain`: the formulas for what is near hold.
template <class T>
struct Placed {
  T distance2, off2_axis;
  lanes::Mask<T> plain;

  Placed(const FollowLimits& limits, const lanes::Triple<T>& axis_P, const lanes::Triple<T>& axis0_P,
         const lanes::Triple<T>& axis1_P, const T& t, const T& off2_mm2) {
    const lanes::Triple<T> turn = axis1_P - axis0_P;
    const lanes::Triple<T> on_chord = axis0_P + t * turn;
    const lanes::Triple<T> on_arc = T(1.0 / length(on_chord)) * on_chord;
    const lanes::Triple<T> there = chosen(t >= 1.0, axis1_P, on_arc);
    off2_axis = length2(axis_P - there);
    plain = (length2(turn) < kNearChord2) & (off2_axis < kSmallChord2);
    if (limits.has_cone) {
      const Vec3& n = limits.cone_axis_P;
      const T cosine = there.x * n.x() + (there.y * n.y() + there.z * n.z());
      plain &= lanes::abs(cosine) < limits.cone_cosine;
    }
    const T turned_mm = kAxisWeight_mm * turn_of_chord(off2_axis);
    distance2 = off2_mm2 + turned_mm * turned_mm;
  }
};

// The second half of still_on: the tool axes are surely within their tolerance of the arc, about where they
// turned to. The chord's fraction is the arc's within 1e-4 where the arc is short.
template <class T>
lanes::Mask<T> keeps_axis(const FollowLimits& limits, const lanes::Triple<T>& axis_P,
                          const lanes::Triple<T>& axis0_P, const lanes::Triple<T>& axis1_P) {
  constexpr double kUnsure_rad = 1e-5;
  const lanes::Triple<T> turn = axis1_P - axis0_P;
  const T turn2 = length2(turn);
  const T share = lanes::sqrt(T(length2(axis_P - axis0_P) / turn2));
  const T t = lanes::select(turn2 > 0.0, clamped<T>(share, T{}), T{});
  const lanes::Triple<T> on_chord = axis0_P + t * turn;
  const lanes::Triple<T> on_arc = T(1.0 / length(on_chord)) * on_chord;
  const double left = std::max(0.0, limits.axis_tolerance_rad - kUnsure_rad);
  return (turn2 < kNearChord2) & (length2(axis_P - on_arc) <= left * left);
}

}  // namespace trunnion::post
