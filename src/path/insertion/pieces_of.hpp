#pragma once
#include "trunnion/path/bowed_line.hpp"

#include "path/bounds/side_by_side.hpp"
#include "path/bounds/tool_segment.hpp"

// Pieces of a few segments side by side, and what the closed forms of the certificate (closed_forms.hpp) say
// of them. T is Lanes or Quads.
namespace trunnion::path {

/// Where the machine stands on a few segments, and how far off them.
template <class T>
struct StandOf : PlaceOf<T> {
  TableKinematics::SinesOf<T> sines;
  lanes::Triple<T> tip_P, axis_P;
  T off_mm;     // of the tip, from the segment
  T off2_axis;  // of the tool axis, from some axis of the reference, squared
};

/// Chords of a few segments.
template <class T>
struct ChordOf {
  lanes::Triple<T> from, way;
  T length2;

  ChordOf(const lanes::Triple<T>& a, const lanes::Triple<T>& b)
      : from(a), way(b - a), length2(lanes::squared(way)) {}
  /// As from_segment.
  lanes::Triple<T> to(const lanes::Triple<T>& point) const {
    const lanes::Triple<T> v = point - from;
    const T one = lanes::splat<T>(1.0);
    const T along = lanes::dot(v, way) / lanes::select(length2 > 0.0, length2, one);
    const T t = lanes::select(along < 0.0, T{}, lanes::select(along > 1.0, one, along));
    return v - t * way;
  }
  /// As distance_to_segment.
  T distance(const lanes::Triple<T>& point) const { return lanes::sqrt(T(lanes::squared(to(point)))); }
};

/// Largest distance from a chord of the parabola through the ends and the middle of a piece: the bound of
/// ParabolaForm but for its last resort.
template <class T>
T parabola_mm(const ChordOf<T>& chord, const lanes::Triple<T>& a, const lanes::Triple<T>& middle,
              const lanes::Triple<T>& b) {
  constexpr double kLeast = 1e-300;  // for a bow that is none, the ends tell
  const T one = lanes::splat<T>(1.0);
  const auto some = chord.length2 > 0.0;
  const T per_length2 = lanes::select(some, T(one / lanes::select(some, chord.length2, one)), T{});
  const auto along_of = [&](const lanes::Triple<T>& v) { return T(lanes::dot(v, chord.way) * per_length2); };
  const lanes::Triple<T> from_a = a - chord.from;
  const lanes::Triple<T> from_b = b - chord.from;
  const lanes::Triple<T> bow = middle - 0.5 * (a + b);
  const T along_a = along_of(from_a);
  const T along_b = along_of(from_b);
  const T along = along_of(bow);
  const lanes::Triple<T> across_a = from_a - along_a * chord.way;
  const lanes::Triple<T> across_b = from_b - along_b * chord.way;
  const lanes::Triple<T> across = bow - along * chord.way;
  // Across the chord, along the bow: -x (1 - t) - y t + 4 c t (1 - t), and what the ends are off beside it.
  const T size = lanes::larger(lanes::sqrt(T(lanes::squared(across))), lanes::splat<T>(kLeast));
  const T x = lanes::dot(across_a, across) / size;
  const T y = lanes::dot(across_b, across) / size;
  const T reach = lanes::larger(largest_bowed_of(x, y, size), lanes::larger(T(-x), T(-y)));
  const T beside2 = lanes::larger(
      T{}, lanes::larger(T(lanes::squared(across_a) - x * x), T(lanes::squared(across_b) - y * y)));
  const T over =
      lanes::larger(T{}, lanes::larger(largest_bowed_of<T>(-along_a, -along_b, lanes::abs(along)),
                                       largest_bowed_of<T>(along_a - 1.0, along_b - 1.0, lanes::abs(along))));
  return lanes::sqrt(T(reach * reach + beside2 + over * over * chord.length2));
}

/// The same bound on each quarter of the parabola, the largest of them: what its ends are off beside the bow
/// does not stand where the bow is at its largest.
template <class T>
T parabola_in_quarters_mm(const ChordOf<T>& chord, const lanes::Triple<T>& a, const lanes::Triple<T>& middle,
                          const lanes::Triple<T>& b) {
  constexpr int kQuarters = 4;
  const lanes::Triple<T> bow = middle - 0.5 * (a + b);
  const auto at = [&](double t) { return a + t * (b - a) + (4.0 * t * (1.0 - t)) * bow; };
  T largest{};
  lanes::Triple<T> from = a;
  for (int i = 0; i < kQuarters; ++i) {
    const lanes::Triple<T> to = i + 1 == kQuarters ? b : at(static_cast<double>(i + 1) / kQuarters);
    largest = lanes::larger<T>(largest, parabola_mm(chord, from, at((i + 0.5) / kQuarters), to));
    from = to;
  }
  return largest;
}

/// A piece between two stands on each of a few segments, both axes of which turn by less than half a right
/// angle.
template <class T>
class PieceOf {
 public:
  PieceOf(const TableKinematics& kinematics, const ConstantsOf<T>& chain, const StandOf<T>& from,
          const StandOf<T>& to)
      : kinematics_(kinematics),
        chain_(chain),
        from_(from),
        to_(to),
        outer_(lanes::abs(T(to.angle[0] - from.angle[0]))),
        inner_(lanes::abs(T(to.angle[1] - from.angle[1]))),
        way_(lanes::sqrt(T(lanes::squared(to.w - from.w)))),
        norms_(outer_, inner_, way_, way_, lanes::larger(from.arm2_outer, to.arm2_outer),
               lanes::larger(from.arm2_inner, to.arm2_inner)) {
    const T angles = lanes::abs(from.angle[0]) + lanes::abs(to.angle[0]) + lanes::abs(from.angle[1]) +
                     lanes::abs(to.angle[1]);
    rounding_mm_ = tip_rounding<T>(from.size_mm + to.size_mm, angles);
  }

  const T& rounding_mm() const { return rounding_mm_; }
  /// By which the tip leaves its own chord at most, from norms.
  T bow_mm() const { return norms_.M2() / 8.0; }
  T beyond_parabola_mm() const { return beyond_parabola<T>(norms_.M3()); }
  /// Larger turn of the two axes.
  T turn() const { return lanes::larger(outer_, inner_); }

  /// As middle_tip.
  lanes::Triple<T> middle_P() const {
    const TableKinematics::SinesOf<T> mid = middle_sines_of(from_.sines, to_.sines);
    const lanes::Triple<T> inner = kinematics_.turned_back(0, 0.5 * (from_.w + to_.w), mid);
    return kinematics_.turned_back(1, inner + chain_.b, mid) + chain_.g;
  }
  /// As middle_axis.
  lanes::Triple<T> middle_axis_P() const {
    const TableKinematics::SinesOf<T> mid = middle_sines_of(from_.sines, to_.sines);
    return kinematics_.turned_back(1, kinematics_.turned_back(0, chain_.spindle, mid), mid);
  }
  /// Of `middle_P` from the middle of the chord.
  T midpoint_mm(const lanes::Triple<T>& middle_P) const {
    return lanes::sqrt(T(lanes::squared(middle_P - 0.5 * (from_.tip_P + to_.tip_P))));
  }

  /// The tool axis surely keeps.
  lanes::Mask<T> axis_keeps(Angle tolerance) const {
    const double limit = tolerance.rad() * 2.0 / kPi;  // below its sine
    const T turn = outer_ + inner_;
    const T left = limit - turn * turn / 8.0;
    return (left >= 0.0) & (lanes::larger(from_.off2_axis, to_.off2_axis) <= left * left);
  }
  /// How far the tip leaves the segment at most, mm. A bound of `enough_mm` is not made sharper; of what is
  /// not `asked` nothing is said.
  T tip_off_mm(const ChordOf<T>& segment, double enough_mm, const lanes::Mask<T>& asked) const {
    const T ends = lanes::larger(from_.off_mm, to_.off_mm) + rounding_mm_;
    T off = ends + bow_mm();
    if (!lanes::any(lanes::Mask<T>(asked & (off > enough_mm)))) return off;
    const lanes::Triple<T> middle = middle_P();
    const T beyond = beyond_parabola_mm();
    off = lanes::smaller<T>(off, ends + midpoint_mm(middle) + beyond);
    if (!lanes::any(lanes::Mask<T>(asked & (off > enough_mm)))) return off;
    // Rounded ends stand off where the bow is not at its largest.
    return lanes::smaller<T>(off,
                             parabola_mm(segment, from_.tip_P, middle, to_.tip_P) + beyond + rounding_mm_);
  }

  /// The rounding of a tool with a flute.
  T tool_rounding_mm(double flute_mm) const {
    const T angles = lanes::abs(from_.angle[0]) + lanes::abs(to_.angle[0]) + lanes::abs(from_.angle[1]) +
                     lanes::abs(to_.angle[1]);
    return rounding_mm_ + flute_mm * axis_rounding<T>(angles);
  }
  /// How far the tool, from its tip to its flute length, is off the segment at most while its place runs
  /// evenly from `t0` to `t1`: FluteCertifier's parabola through the ends and the middle.
  T tool_off_mm(const ToolSegmentOf<T>& segment, const T& t0, const T& t1) const {
    const double flute_mm = segment.flute_mm();
    const ToolOffOf<T> begin = segment.off(from_.tip_P, from_.axis_P, t0);
    const ToolOffOf<T> end = segment.off(to_.tip_P, to_.axis_P, t1);
    const ToolOffOf<T> middle = segment.off(middle_P(), middle_axis_P(), T(0.5 * (t0 + t1)));
    const auto largest = [&](double up_mm) {
      const lanes::Triple<T> a = begin.at(up_mm);
      const lanes::Triple<T> b = end.at(up_mm);
      return farthest_bowed<T>(a, b, middle.at(up_mm) - 0.5 * (a + b));
    };
    const auto axis_arm2 = [&](const StandOf<T>& at) -> T {
      return lanes::squared(lanes::cross(chain_.axis[1], at.axis_P));
    };
    const T spindle_arm2 = lanes::squared(lanes::cross(chain_.axis[0], chain_.spindle));
    const NormsOf<T> axis(outer_, inner_, T{}, T{}, spindle_arm2,
                          lanes::larger(axis_arm2(from_), axis_arm2(to_)));
    const T turn = (t1 - t0) * segment.arc().turn();
    const T tip_M3 = norms_.M3();
    const T end_M3 = tip_M3 + flute_mm * (axis.M3() + turn * turn * turn);
    return lanes::larger<T>(largest(0.0) + beyond_parabola<T>(tip_M3),
                            largest(flute_mm) + beyond_parabola<T>(end_M3)) +
           tool_rounding_mm(flute_mm);
  }

 private:
  const TableKinematics& kinematics_;
  const ConstantsOf<T>& chain_;
  const StandOf<T>& from_;
  const StandOf<T>& to_;
  T outer_, inner_, way_;
  NormsOf<T> norms_;
  T rounding_mm_;
};

}  // namespace trunnion::path
