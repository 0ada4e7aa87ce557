#include "path/node_maker.hpp"

#include <cmath>
#include <limits>

namespace trunnion::path {

// Of the solutions for the axis, the one nearest to the straight joint path; that path itself where there is
// none.
void NodeMaker::set_rotary(const Vec3& axis_P, JointVector& q) const {
  const std::size_t count = kinematics_->rotary_count();
  if (count == 0) return;
  const JointVector seed = q;
  const double seed_inner = seed[kinematics_->rotary(count - 1)];
  const RotarySolutions solutions = rotary_solutions(*machine_, axis_P, seed_inner);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < solutions.count; ++i) {
    JointVector candidate = seed;
    double travel = 0.0;
    bool reachable = true;
    for (std::size_t k = 0; k < count; ++k) {
      const AxisId id = kinematics_->rotary(k);
      const auto angle = nearest_turn(machine_->axes[id], solutions.at[i].angle[k], seed[id]);
      reachable = reachable && angle.has_value();
      candidate[id] = angle.value_or(seed[id]);
      travel += std::abs(candidate[id] - seed[id]);
    }
    if (!reachable || travel >= nearest) continue;
    nearest = travel;
    q = candidate;
  }
}

Node NodeMaker::node(double t, const Vec3& displacement_P, NodeAxis how, bool rounded) const {
  JointVector q = JointVector::interpolate(a_->q, b_->q, t);
  if (how == NodeAxis::great_circle) set_rotary(slerp(a_->axis_P, b_->axis_P, t), q);
  return node_at(t, q, (1.0 - t) * a_->tip_P + t * b_->tip_P + displacement_P, rounded);
}

Node NodeMaker::node_at(double t, const JointVector& q, const Vec3& tip_P, bool rounded) const {
  Node node;
  node.t = t;
  node.tip_P = (1.0 - t) * a_->tip_P + t * b_->tip_P;
  node.axis_P = slerp(a_->axis_P, b_->axis_P, t);
  node.beside_P = tip_P - node.tip_P;
  JointVector placed = q;
  if (rounded) {
    round_to_words(*machine_, *kinematics_, *rounding_, tip_P, placed);
  } else {
    kinematics_->solve_linear(tip_P, kinematics_->sines(placed), placed);
  }
  node.station = station(*kinematics_, placed);
  return node;
}

}  // namespace trunnion::path
