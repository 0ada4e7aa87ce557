#pragma once
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/base/source_ref.hpp"
#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

/// One joint position of the path, and what the CL file prescribes there.
struct Point {
  JointVector q;  // mm, rad; rotary turns chosen; on the word grid of the control when the path was rounded
  Vec3 tip_P =
      Vec3::Zero();  // prescribed tip, mm: of the CL file, or the point of its segment for an inserted one
  /// Prescribed unit tool axis: of the CL file; for an inserted one of the great circle, or where it is put
  /// beside that when the flute counts.
  Vec3 axis_P = Vec3::UnitZ();
  SourceRef where;  // line of the CL file; of the segment's end for an inserted one
  bool inserted = false;
  /// Where the tip is put beside `tip_P`, mm: nodes of two-sided placement, moved programmed points. A
  /// compensation aims at tip_P + beside_P.
  Vec3 beside_P = Vec3::Zero();
  /// Share of the speed that is asked for, which the block that ends here can have: above 0, to 1.
  double pace = 1.0;
};

/// The grid on which the NC words stand. A quantum of 0 leaves that axis as it is.
struct Rounding {
  JointVector quantum;  // one unit of the word's last place, mm or rad
  JointVector offset;   // word minus joint position (words_of of q = 0), mm or rad

  /// The nearest joint position whose word is a whole number of quanta.
  double rounded(AxisId axis, double value) const {
    const double unit = quantum[axis];
    if (!(unit > 0.0)) return value;
    return unit * nearest((value + offset[axis]) / unit) - offset[axis];
  }
  /// Largest distance by which rounding of the linear words moves the tip, mm.
  double tip_error_mm(const Machine& machine) const;
  /// Largest angle by which rounding of the rotary words turns the tool axis, rad: two axes turn it to places
  /// at right angles at most.
  double axis_error_rad(const Machine& machine) const;
  /// True when no axis is rounded.
  bool is_identity() const;
  /// Grid of words with `quantum` on this machine and tool.
  static Rounding of(const Machine& machine, const Vec3& tool_mm, const JointVector& quantum);

 private:
  /// std::nearbyint (halves to even) without the call: adding 1.5 * 2^52 leaves no bit for a fraction.
  static double nearest(double x) {
    constexpr double kNoFraction = 6755399441055744.0;
    return std::abs(x) < 1e15 ? (x + kNoFraction) - kNoFraction : std::nearbyint(x);
  }
};

/// Sines of rotary positions that somebody knew already, and of which.
struct KnownSines {
  RotarySines sines;
  std::array<double, 2> angle{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::quiet_NaN()};

  /// Of the rotary positions of `q`: turned on from the known ones where these are near.
  RotarySines at(const TableKinematics& kinematics, const JointVector& q) const {
    RotarySines out = sines;
    for (std::size_t k = 0; k < kinematics.rotary_count(); ++k) {
      const double by = q[kinematics.rotary(k)] - angle[k];
      if (!(std::abs(by) <= RotarySines::kSmallTurn_rad)) return kinematics.sines(q);
      out.turn(k, by);
    }
    return out;
  }
};

/// Puts `q` on the word grid as the NC writer does: rotary axes first, then the linear axes such that the tip
/// stands at `tip_P` with the rounded angles, then those rounded too. The tip is then within half a linear
/// quantum in each word. Gives the sines of the rounded angles.
RotarySines round_to_words(const TableKinematics& kinematics, const Rounding& rounding, const Vec3& tip_P,
                           JointVector& q, const KnownSines& known = {});

}  // namespace trunnion::path
