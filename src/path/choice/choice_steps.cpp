#include "path/choice/choice_steps.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {
namespace {

// Of an axis on the way of a step: it turns by less than a whole turn.
constexpr std::size_t kTurnsOfStep = 8;

}  // namespace

ChoiceSteps::ChoiceSteps(const Machine& machine, const TableKinematics& kinematics,
                         const ChoiceOptions& options)
    : kinematics_(kinematics),
      inverse_(options.inverse),
      solver_(machine),
      connection_(kinematics, options.axis_tolerance),
      rotary_count_(kinematics.rotary_count()) {
  for (std::size_t k = 0; k < 3; ++k)
    linear_seconds_[k] = seconds_per_unit(machine.axes[kinematics.linear(k)]);
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    axis_[k] = machine.axes[kinematics.rotary(k)];
    rotary_seconds_[k] = seconds_per_unit(axis_[k]);
    limited_[k] = axis_[k].has_limits();
    middle_[k] = 0.5 * (axis_[k].min + axis_[k].max);
    travel_[k] = axis_[k].max - axis_[k].min;
    near_turn_[k] = kPi;
  }
  if (rotary_count_ < 2) return;
  reaches_pole_ = solver_.solve_within_limits(kinematics_.direction(1), 0.0).count > 0;
  oblique_ = std::abs(kinematics_.direction(0).dot(kinematics_.direction(1))) > 1e-9;
  if (oblique_) near_turn_[1] = 0.5 * kPi;
}

std::uint8_t ChoiceSteps::branch_of(const ChoicePosition& at, const Vec3& axis_P) const {
  if (rotary_count_ < 2) return 0;
  const RotarySolutions solutions = solver_.solve(axis_P, at.angle[1], inverse_);
  const auto away = [&](const RotarySolution& solution) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 2; ++k)
      sum += std::abs(std::remainder(solution.angle[k] - at.angle[k], kTwoPi));
    return sum;
  };
  const auto end = solutions.at.begin() + static_cast<std::ptrdiff_t>(solutions.count);
  const auto nearest =
      std::min_element(solutions.at.begin(), end,
                       [&](const RotarySolution& a, const RotarySolution& b) { return away(a) < away(b); });
  return nearest == end ? std::uint8_t{0} : nearest->branch;
}

double ChoiceSteps::least_cost(const ChoicePosition& from, const ChoicePosition& to, const Vec3& axis_a_P,
                               const ChoicePoint& point) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double way = std::abs(to.linear[i] - from.linear[i]) * linear_seconds_[k];
    if (!std::isnan(way)) sum += way;
  }
  ChoicePosition near = to;  // in the turns nearest to `from`
  bool any_angle = false;
  double turn = 0.0;
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const double by = std::remainder(to.angle[k] - from.angle[k], kTwoPi);
    if (std::isnan(by)) {
      any_angle = true;
      continue;
    }
    near.angle[k] = from.angle[k] + by;
    turn += std::abs(by);
    sum += std::abs(by) * rotary_seconds_[k];
  }
  if (any_angle || point.rapid || rotary_count_ < 2) return sum;
  if (turn < 1.0 && from.branch == to.branch) return sum;
  for (int other = 0; other < 4; ++other) {
    std::array<double, 2> angle = near.angle;
    for (std::size_t k = 0; k < 2; ++k) {
      if ((other >> k) % 2 == 1) angle[k] -= std::copysign(kTwoPi, angle[k] - from.angle[k]);
    }
    if (connection_.connects(from.angle, axis_a_P, angle, point.pose.axis_P)) return sum;
  }
  return sum + kReconfigureSeconds;
}

bool ChoiceSteps::same_position(const std::array<double, 2>& a, const std::array<double, 2>& b) const {
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const double d = b[k] - a[k];
    const double least = axis_[k].has_limits() || std::abs(d) < kPi ? d : std::remainder(d, kTwoPi);
    if (!(std::abs(least) < 1e-9)) return false;
  }
  return true;
}

// The tilt between two tool axes may be less, or beyond a right angle more, than at both, and where the
// rotary axes are not square to each other the inner one may go beyond both its ends: limits that hold at the
// ends may not hold on the way.
bool ChoiceSteps::way_within_limits(const ChoicePosition& a, const Vec3& axis_a_P,
                                    const Vec3& axis_b_P) const {
  if (rotary_count_ < 2) return true;
  const Vec3& n = kinematics_.direction(1);
  if (oblique_ && axis_[1].has_limits()) {
    constexpr int kLooks = 16;
    for (int i = 1; i < kLooks; ++i) {
      if (!holds_on_the_way(a, axis_a_P, slerp(axis_a_P, axis_b_P, static_cast<double>(i) / kLooks)))
        return false;
    }
    return true;
  }
  if (reaches_pole_ && n.dot(axis_a_P) >= 0.0 && n.dot(axis_b_P) >= 0.0) return true;
  const Vec3 normal = axis_a_P.cross(axis_b_P);
  if (!(normal.norm() > 1e-9)) return true;
  Vec3 foot = n - (n.dot(normal) / normal.squaredNorm()) * normal;
  if (foot.dot(axis_a_P + axis_b_P) < 0.0) foot = -foot;
  if (axis_a_P.cross(foot).dot(normal) <= 0.0 || foot.cross(axis_b_P).dot(normal) <= 0.0) return true;
  return holds_on_the_way(a, axis_a_P, foot.normalized());
}

// A position within the limits holds `axis_P`, and the axes come there from `a`.
bool ChoiceSteps::holds_on_the_way(const ChoicePosition& a, const Vec3& axis_a_P, const Vec3& axis_P) const {
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, a.angle[1], inverse_);
  for (std::size_t i = 0; i < solutions.count; ++i) {
    const Turns outer(axis_[0], solutions.at[i].angle[0], a.angle[0], kTurnsOfStep);
    const Turns inner(axis_[1], solutions.at[i].angle[1], a.angle[1], kTurnsOfStep);
    for (std::size_t k = 0; k < outer.count() * inner.count(); ++k) {
      const RotaryConnection::Angles angles = {outer.at(k % outer.count()), inner.at(k / outer.count())};
      if (connection_.connects(a.angle, axis_a_P, angles, axis_P)) return true;
    }
  }
  return false;
}

}  // namespace trunnion::path
