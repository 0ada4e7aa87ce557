#pragma once
#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/certificate.hpp"

namespace trunnion::path {

/// One point carried by the chain while q runs linearly, s in [-1/2, 1/2]:
///     f(s) = exp(-s ga K1) [ exp(-s al K0) (r + s d) + b + s d1 ] + s d2 + const,   Kj v = nj x v
/// in the axes of the inner rotary axis' carried body at the middle position turned back into its fixed side
/// (an isometry of P).
struct Curve {
  const TableKinematics* kinematics = nullptr;
  double al = 0.0;  // turn of the outer axis over the piece, rad
  double ga = 0.0;  // of the inner one
  Vec3 r, d, b, d1;
  TableKinematics::Sines mid;
};

/// Sines and cosines of the middle position, from those of the ends where these are near enough.
TableKinematics::Sines middle_sines(const TableKinematics& kinematics, const Station& a, const Station& b);

/// The tip, and the tool axis, over the piece from a to b.
Curve tip_curve(const TableKinematics& kinematics, const Station& a, const Station& b);
Curve axis_curve(const TableKinematics& kinematics, const Station& a, const Station& b);

/// Derivatives of f at s = 0 from the second on (exact), and bounds on |f''''| and |f'''''| over the piece.
struct Expansion {
  Vec3 f2, f3, f4;
  double M4 = 0.0;
  double M5 = 0.0;
};
Expansion expand(const Curve& curve);
/// The same with the vectors in the axes of P.
Expansion expand_in_part(const Curve& curve);

/// First derivative of the tip by the piece's parameter t in [0, 1] at the station `at` (one of its ends), in
/// P.
Vec3 tip_slope(const TableKinematics& kinematics, const Station& at, const JointVector& q0,
               const JointVector& q1);

/// The same of the tool axis.
Vec3 axis_slope(const TableKinematics& kinematics, const Station& at, const JointVector& q0,
                const JointVector& q1);

}  // namespace trunnion::path
