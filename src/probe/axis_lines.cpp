#include "trunnion/probe/axis_lines.hpp"

#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion::probe {
namespace {

std::array<Vec3, 2> vectors_across(const Vec3& n) {
  // The machine axis that is nearest to n has the other two across it, in the order X, Y, Z.
  Eigen::Index along = 0;
  n.cwiseAbs().maxCoeff(&along);
  const Vec3 first = Vec3::Unit(along == 0 ? 1 : 0);
  const Vec3 u = (first - n * n.dot(first)).normalized();
  const Vec3 second = Vec3::Unit(along == 2 ? 1 : 2);
  Vec3 v = n.cross(u).normalized();
  if (v.dot(second) < 0.0) v = -v;
  return {u, v};
}

}  // namespace

AxisLines::AxisLines(const Machine& machine) : machine_(machine), axes_(machine.rotary_axes()) {
  for (const AxisId id : axes_) across_.push_back(vectors_across(machine.axes[id].direction));
}

Machine AxisLines::moved(const Eigen::VectorXd& by) const {
  TRUNNION_EXPECTS(by.size() == count());
  Machine out = machine_;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const Eigen::Index at = kEach * static_cast<Eigen::Index>(k);
    const auto& [u, v] = across_[k];
    Axis& axis = out.axes[axes_[k]];
    axis.point_mm += by[at] * u + by[at + 1] * v;
    // Turned towards u by the third and towards v by the fourth number.
    const Vec3 turn = axis.direction.cross(by[at + 2] * u + by[at + 3] * v);
    const double angle = turn.norm();
    if (angle > 0.0)
      axis.direction = (rotation_about(turn / angle, Angle::radians(angle)) * axis.direction).normalized();
  }
  return out;
}

}  // namespace trunnion::probe
