#pragma once
#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

/// A joint position and about where the nominal tip is in P at it.
struct KnownPlace {
  const JointVector& q;
  const Vec3& tip_P;  // mm
};

/// As Certifier::bow_from_norms for two positions whose tips are known within `off_mm`, without any sine: a
/// bound on the distance of the tip from its own chord, mm. Infinite where linear axes stand between or
/// beyond the rotary ones.
double bow_from_norms(const TableKinematics& kinematics, const KnownPlace& a, const KnownPlace& b,
                      double off_mm);

}  // namespace trunnion::path
