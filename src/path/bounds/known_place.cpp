#include "trunnion/path/known_place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "path/bounds/side_by_side.hpp"

namespace trunnion::path {

// A turn about the inner axis keeps the distance from it: that of the tip in P.
double bow_from_norms(const TableKinematics& kinematics, const KnownPlace& a, const KnownPlace& b,
                      double off_mm) {
  if (!kinematics.linear_axes_first()) return std::numeric_limits<double>::infinity();
  const auto triple = [](const Vec3& v) { return lanes::Triple<double>{v.x(), v.y(), v.z()}; };
  const auto arm2 = [](const auto& n, const auto& u, const auto& v) {
    return std::max(lanes::squared(lanes::cross(n, u)), lanes::squared(lanes::cross(n, v)));
  };
  const auto g = kinematics.constant(2);
  const auto w_a = triple(kinematics.w(a.q));
  const auto w_b = triple(kinematics.w(b.q));
  const double arm2_outer = arm2(triple(kinematics.direction(0)), w_a, w_b);
  const double arm_inner =
      std::sqrt(arm2(triple(kinematics.direction(1)), triple(a.tip_P) - g, triple(b.tip_P) - g)) + off_mm;
  const double way = std::sqrt(lanes::squared(w_b - w_a));
  double angles = 0.0;
  std::array<double, 2> turn{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double from = kinematics.angle(a.q, k);
    const double to = kinematics.angle(b.q, k);
    turn[k] = std::abs(to - from);
    angles += std::abs(from) + std::abs(to);
  }
  const NormsOf<double> norms(turn[0], turn[1], way, way, arm2_outer, arm_inner * arm_inner);
  const double constants_mm = magnitude(kinematics.constant(1)) + magnitude(g);
  return norms.M2() / 8.0 + tip_rounding(magnitude(w_a) + magnitude(w_b) + 2.0 * constants_mm, angles);
}

}  // namespace trunnion::path
