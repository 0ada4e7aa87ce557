#include "path/insertion/node_maker.hpp"

#include <cmath>
#include <limits>

#include "path/bounds/tool_segment.hpp"

namespace trunnion::path {

namespace {

RotaryConnection::Angles angles_of(const TableKinematics& kinematics, const JointVector& q) {
  return {kinematics.angle(q, 0), kinematics.angle(q, 1)};
}

}  // namespace

void NodeMaker::start(const Point& a, const Point& b) {
  a_ = &a;
  b_ = &b;
  follows_ = false;
  if (kinematics_->rotary_count() < 2) return;
  branch_ = solver_.branch_of(kinematics_->angle(a.q, 0));
  // Below it the position nearest to the straight path of the axes is the one.
  constexpr double kFar = 20.0 * kRadPerDegree;
  const auto from = angles_of(*kinematics_, a.q);
  const auto to = angles_of(*kinematics_, b.q);
  if (std::abs(to[0] - from[0]) + std::abs(to[1] - from[1]) < kFar) return;
  const auto turn = connection_.followed_turn(from, a.axis_P, to[0], b.axis_P);
  follows_ = turn && std::abs(to[1] - from[1] - *turn) < RotaryConnection::kSameTurn;
}

// How far a position is from where the axes come to on the great circle; or, where they do not follow it,
// from the straight path between the ends.
double NodeMaker::off_course(const Vec3& axis_P, const JointVector& straight,
                             const JointVector& candidate) const {
  const auto at = angles_of(*kinematics_, candidate);
  if (follows_) {
    const auto from = angles_of(*kinematics_, a_->q);
    const auto turn = connection_.followed_turn(from, a_->axis_P, at[0], axis_P);
    return turn ? std::abs(at[1] - from[1] - *turn) : kTwoPi;
  }
  double travel = 0.0;
  for (std::size_t k = 0; k < kinematics_->rotary_count(); ++k)
    travel += std::abs(at[k] - kinematics_->angle(straight, k));
  return travel;
}

// The turn of a solution on the way from a to b, where `q` is on the straight one; false where none is within
// the limits.
bool NodeMaker::reach(const RotarySolution& solution, const Vec3& axis_P, JointVector& q) const {
  bool reachable = true;
  for (std::size_t k = 0; k < kinematics_->rotary_count(); ++k) {
    const AxisId id = kinematics_->rotary(k);
    double near = q[id];
    if (follows_ && k == 1) {
      const auto from = angles_of(*kinematics_, a_->q);
      const double outer = q[kinematics_->rotary(0)];
      near = from[1] + connection_.followed_turn(from, a_->axis_P, outer, axis_P).value_or(near - from[1]);
    }
    const auto angle = nearest_turn(machine_->axes[id], solution.angle[k], near);
    reachable = reachable && angle.has_value();
    q[id] = angle.value_or(q[id]);
  }
  return reachable;
}

KnownSines NodeMaker::known_sines(const TableKinematics& kinematics, const RotarySolution& solution,
                                  const JointVector& q) {
  KnownSines known;
  if (!solution.sines_known) return known;
  known.sines = solution.sines;
  for (std::size_t k = 0; k < kinematics.rotary_count(); ++k) known.angle[k] = q[kinematics.rotary(k)];
  return known;
}

// Of the solutions for the axis, the one on the way from a to b; the straight joint path itself where there
// is none.
void NodeMaker::set_rotary(const Vec3& axis_P, JointVector& q, KnownSines& known) const {
  const std::size_t count = kinematics_->rotary_count();
  if (count == 0) return;
  const JointVector seed = q;
  // So near the straight path no other branch is nearer.
  RotarySolution near;
  if (count == 2 && !follows_ && solver_.solve_one_of_two(axis_P, branch_, near)) {
    JointVector candidate = seed;
    if (reach(near, axis_P, candidate) &&
        off_course(axis_P, seed, candidate) < 0.5 * RotarySolver::kApart_rad) {
      q = candidate;
      known = known_sines(*kinematics_, near, q);
      return;
    }
  }
  const double seed_inner = seed[kinematics_->rotary(count - 1)];
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, seed_inner);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < solutions.count; ++i) {
    JointVector candidate = seed;
    const bool reachable = reach(solutions.at[i], axis_P, candidate);
    const double off = reachable ? off_course(axis_P, seed, candidate) : nearest;
    if (!(off < nearest)) continue;
    nearest = off;
    q = candidate;
    known = known_sines(*kinematics_, solutions.at[i], q);
  }
}

std::optional<JointVector> NodeMaker::followed(const Point& from, const Vec3& axis_P) const {
  const auto at = angles_of(*kinematics_, from.q);
  const std::array<AxisId, 2> rotary = {kinematics_->rotary(0), kinematics_->rotary(1)};
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, at[1]);
  for (std::size_t i = 0; i < solutions.count; ++i) {
    const auto outer = nearest_turn(machine_->axes[rotary[0]], solutions.at[i].angle[0], at[0]);
    const auto turn =
        outer ? connection_.followed_turn(at, from.axis_P, *outer, axis_P) : std::optional<double>();
    if (!turn) continue;
    const auto inner = nearest_turn(machine_->axes[rotary[1]], solutions.at[i].angle[1], at[1] + *turn);
    if (!inner || std::abs(*inner - at[1] - *turn) > RotaryConnection::kSameTurn) continue;
    JointVector q = from.q;
    q[rotary[0]] = *outer;
    q[rotary[1]] = *inner;
    return q;
  }
  return std::nullopt;
}

JointVector NodeMaker::at_pole(const Vec3& axis_P, const JointVector& near) const {
  JointVector out = near;
  const std::array<AxisId, 2> rotary = {kinematics_->rotary(0), kinematics_->rotary(1)};
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, near[rotary[1]]);
  if (solutions.count == 0) return out;
  const auto outer = nearest_turn(machine_->axes[rotary[0]], solutions.at[0].angle[0], near[rotary[0]]);
  out[rotary[0]] = outer.value_or(near[rotary[0]]);
  return out;
}

bool NodeMaker::turn_to(const Vec3& axis_P, JointVector& q) const {
  const std::size_t count = kinematics_->rotary_count();
  if (count == 0) return false;
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, q[kinematics_->rotary(count - 1)]);
  double nearest = std::numeric_limits<double>::infinity();
  JointVector best = q;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    JointVector candidate = q;
    double travel = 0.0;
    bool reachable = true;
    for (std::size_t k = 0; k < count; ++k) {
      const AxisId id = kinematics_->rotary(k);
      const auto angle = nearest_turn(machine_->axes[id], solutions.at[i].angle[k], q[id]);
      reachable = reachable && angle.has_value();
      candidate[id] = angle.value_or(q[id]);
      travel += std::abs(candidate[id] - q[id]);
    }
    if (!reachable || !(travel < nearest)) continue;
    nearest = travel;
    best = candidate;
  }
  q = best;
  return nearest < std::numeric_limits<double>::infinity();
}

Node NodeMaker::node(double t, const ToolOff& displacement, NodeAxis how, bool rounded) const {
  JointVector q = JointVector::interpolate(a_->q, b_->q, t);
  KnownSines known;
  const Vec3 axis_P = axis_at(t);
  const bool beside = how == NodeAxis::great_circle && !displacement.axis_P.isZero(0.0);
  Vec3 aim_axis_P = axis_P;
  if (beside) {
    aim_axis_P = vector_of(axis_beside<double>(triple_of(axis_P), triple_of(displacement.axis_P)));
  }
  if (how == NodeAxis::great_circle) set_rotary(aim_axis_P, q, known);
  const Vec3 tip_P = (1.0 - t) * a_->tip_P + t * b_->tip_P + displacement.tip_P;
  Node node = node_at(t, q, {tip_P, axis_P}, rounded, known);
  if (how == NodeAxis::great_circle) node.aim_axis_P = aim_axis_P;
  return node;
}

Node NodeMaker::node_at(double t, const JointVector& q, const ToolPose& pose, bool rounded,
                        const KnownSines& known) const {
  const Vec3& tip_P = pose.tip_P;
  Node node;
  node.t = t;
  node.tip_P = (1.0 - t) * a_->tip_P + t * b_->tip_P;
  node.axis_P = pose.axis_P;
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
  // Rotary axes that are given stay: a correction takes out the errors there, and not the way to the great
  // circle.
  node.aim_axis_P = node.station.axis_P;
  return node;
}

}  // namespace trunnion::path
