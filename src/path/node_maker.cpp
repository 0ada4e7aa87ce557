#include "path/node_maker.hpp"

#include <cmath>
#include <limits>

namespace trunnion::path {

// Of the solutions for the axis, the one nearest to the straight joint path; that path itself where there is
// none.
void NodeMaker::set_rotary(const Vec3& axis_P, JointVector& q, KnownSines& known) const {
  const std::size_t count = kinematics_->rotary_count();
  if (count == 0) return;
  const JointVector seed = q;
  const double seed_inner = seed[kinematics_->rotary(count - 1)];
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, seed_inner);
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
    known = {};
    if (!solutions.at[i].sines_known) continue;
    known.sines = solutions.at[i].sines;
    for (std::size_t k = 0; k < count; ++k) known.angle[k] = q[kinematics_->rotary(k)];
  }
}

Node NodeMaker::node(double t, const Vec3& displacement_P, NodeAxis how, bool rounded) const {
  JointVector q = JointVector::interpolate(a_->q, b_->q, t);
  KnownSines known;
  const Vec3 axis_P = axis_at(t);
  if (how == NodeAxis::great_circle) set_rotary(axis_P, q, known);
  return node_at(t, q, (1.0 - t) * a_->tip_P + t * b_->tip_P + displacement_P, axis_P, rounded, known);
}

Node NodeMaker::node_at(double t, const JointVector& q, const Vec3& tip_P, const Vec3& axis_P, bool rounded,
                        const KnownSines& known) const {
  Node node;
  node.t = t;
  node.tip_P = (1.0 - t) * a_->tip_P + t * b_->tip_P;
  node.axis_P = axis_P;
  node.beside_P = tip_P - node.tip_P;
  JointVector placed = q;
  if (rounded) {
    const RotarySines sines = round_to_words(*kinematics_, *rounding_, tip_P, placed, known);
    node.station = station(*kinematics_, placed, sines);
  } else {
    const RotarySines sines = known.at(*kinematics_, placed);
    kinematics_->solve_linear(tip_P, sines, placed);
    node.station = station(*kinematics_, placed, sines);
  }
  return node;
}

}  // namespace trunnion::path
