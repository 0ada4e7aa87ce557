#pragma once
#include <cstdint>

#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

/// A joint position with what is evaluated once and used by both pieces that meet there.
struct Station {
  JointVector q;
  TableKinematics::Sines sines;
  Vec3 tip_P = Vec3::Zero();    // where the tip really is, mm
  Vec3 axis_P = Vec3::UnitZ();  // where the tool axis really points
  Vec3 w = Vec3::Zero();        // TableKinematics::w, mm
  double arm2_outer = 0.0;      // squared distance of the tip from the outer rotary axis, mm^2
  double arm2_inner = 0.0;      // from the inner one
  // What the errors of the machine add, where the bounds are to hold on one: the tip is at the nominal place
  // plus `tip_shift_P`, between two stations the shift runs straight.
  Vec3 tip_shift_P = Vec3::Zero();
  Vec3 axis_shift_P = Vec3::Zero();
  double size_mm = 0.0;  // sum of the coordinates' magnitudes: measure of rounding
};
Station station(const TableKinematics& kinematics, const JointVector& q);
void put_station(const TableKinematics& kinematics, const JointVector& q, Station& out);
void put_station(const TableKinematics& kinematics, const JointVector& q, const TableKinematics::Sines& sines,
                 Station& s);
/// The same where the sines are known.
Station station(const TableKinematics& kinematics, const JointVector& q, const TableKinematics::Sines& sines);
/// The station moved by what errors add to the nominal tip and axis. What a motion between two such stations
/// leaves of a straight course of these shifts must be added to its bounds (ErrorCourse).
Station shifted(Station nominal, const Vec3& tip_shift_P, const Vec3& axis_shift_P);
/// Half way between two stations, the shifts too.
Station halfway(const TableKinematics& kinematics, const Station& a, const Station& b);

/// What a piece must keep to: the segment from `tip0_P` to `tip1_P` (mm; may have length zero) and the arc of
/// the great circle from `axis0_P` to `axis1_P` (unit vectors).
struct Reference {
  Vec3 tip0_P, tip1_P;
  Vec3 axis0_P, axis1_P;
};

/// A proved interval for the largest deviation: the truth is in [lower, upper] (mm, or rad for the axis).
struct Bound {
  double lower = 0.0;
  double upper = 0.0;
};

/// Answer of a decision. `yes` and `no` are proved; `unknown`: the deviation meets the tolerance within
/// rounding, or the work limit was met.
enum class Within : std::uint8_t { yes, no, unknown };

/// A number that the sine of an angle >= 0 is not below, up to a right angle; beyond it that of one within.
inline double sine_at_least(double angle_rad) {
  const double x = angle_rad < 1.0 ? angle_rad : 1.0;  // the series' first terms are near up to there
  return x * (1.0 - x * x / 6.0);
}

/// Proved bounds for pieces of path as a control runs them without tool-centre-point control: q linear
/// between two stations, on the nominal machine. The ends of a piece need not lie on its reference.
/// Mathematics and proof: README of this layer. No allocation; one Certifier may serve many threads.
class Certifier {
 public:
  explicit Certifier(const TableKinematics& kinematics) : kinematics_(kinematics) {}

  /// Largest distance of the tip from the reference segment, mm. upper <= ratio * lower, or upper <=
  /// floor_mm.
  Bound tip(const Station& a, const Station& b, const Reference& reference, double ratio = 1.05,
            double floor_mm = 1e-7) const;
  /// Largest angle of the tool axis from the reference arc, rad; pi where it may be 90 degrees or more from
  /// it. Opposite ends have no arc: pi.
  Bound axis(const Station& a, const Station& b, const Reference& reference, double ratio = 1.05,
             double floor_rad = 1e-9) const;

  /// Is the piece within the tolerance? Cheap forms first, the next only while undecided.
  Within tip_within(const Station& a, const Station& b, const Reference& reference,
                    double tolerance_mm) const;
  Within axis_within(const Station& a, const Station& b, const Reference& reference, Angle tolerance) const;

  /// Largest distance of the tip from its own chord, from norms alone (no sine, no direction), mm.
  double bow_from_norms(const Station& a, const Station& b) const;
  /// The same, and of the tool axis as a vector from the chord of its ends.
  struct Bows {
    double tip_mm = 0.0;
    double axis = 0.0;
  };
  Bows bows_from_norms(const Station& a, const Station& b) const;
  /// Of the tip from the exact second and third derivative in the middle and a bound on the fourth.
  double bow_from_cubic(const Station& a, const Station& b) const;

  const TableKinematics& kinematics() const { return kinematics_; }

 private:
  TableKinematics kinematics_;
};

}  // namespace trunnion::path
