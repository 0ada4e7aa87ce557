#pragma once
#include <array>
#include <optional>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "path/choice/rotary_connection.hpp"
#include "path/choice/turns.hpp"

namespace trunnion::path {

/// A position that a choice may take: outer and inner rotary axis, and the linear axes in the order of
/// TableKinematics::linear.
struct ChoicePosition {
  std::array<double, 2> angle{};
  Vec3 linear = Vec3::Zero();
  std::uint8_t branch = 0;
};

/// What steps between positions cost, which positions there are of one solution of the inverse, and whether
/// the axes can follow from one to the next.
class ChoiceSteps {
 public:
  /// `kinematics` must outlive this.
  ChoiceSteps(const Machine& machine, const TableKinematics& kinematics, const ChoiceOptions& options);

  std::size_t rotary_count() const { return rotary_count_; }
  /// Of a position with this tool axis: the branch of the inverse's solution that it is nearest to.
  std::uint8_t branch_of(const ChoicePosition& at, const Vec3& axis_P) const;
  double cost(const ChoicePosition& from, const std::array<double, 2>& angle, const Vec3& linear) const {
    return cost<double>(from, angle, {linear.x(), linear.y(), linear.z()});
  }
  /// Of one position, or of two side by side.
  template <class T>
  T cost(const ChoicePosition& from, const std::array<T, 2>& angle, const lanes::Triple<T>& linear) const {
    return cost<T, double>(from.angle, {from.linear.x(), from.linear.y(), from.linear.z()}, angle, linear);
  }
  template <class T, class From>
  T cost(const std::array<From, 2>& from_angle, const lanes::Triple<From>& from_linear,
         const std::array<T, 2>& angle, const lanes::Triple<T>& linear) const {
    T sum = lanes::abs(T(linear.x - from_linear.x)) * linear_seconds_[0];
    sum += lanes::abs(T(linear.y - from_linear.y)) * linear_seconds_[1];
    sum += lanes::abs(T(linear.z - from_linear.z)) * linear_seconds_[2];
    for (std::size_t k = 0; k < rotary_count_; ++k)
      sum += lanes::abs(T(angle[k] - from_angle[k])) * rotary_seconds_[k];
    return sum;
  }
  /// What the rotary axes take at least, in whatever turns.
  template <class T>
  T least_turn(const std::array<T, 2>& from_angle, const std::array<T, 2>& angle) const {
    constexpr double kPerTurn = 1.0 / kTwoPi;  // half a turn is as long either way
    T sum{};
    for (std::size_t k = 0; k < rotary_count_; ++k) {
      const T by = angle[k] - from_angle[k];
      sum += lanes::abs(T(by - kTwoPi * lanes::nearest<T>(by * kPerTurn))) * rotary_seconds_[k];
    }
    return sum;
  }
  template <class T>
  T centre_preference(const std::array<T, 2>& angle) const {
    T sum{};
    for (std::size_t k = 0; k < rotary_count_; ++k) {
      if (limited_[k]) sum += lanes::abs(T(angle[k] - middle_[k])) / travel_[k];
    }
    return kCentreWeight_s * sum;
  }
  /// What no step between the two, in whatever turns of their rotary axes, costs less than. Angles that are
  /// not a number may be any; so may linear axes.
  double least_cost(const ChoicePosition& from, const ChoicePosition& to, const Vec3& axis_a_P,
                    const ChoicePoint& point) const;

  /// The turns of axis k that are looked at, at most `most` of an axis with limits.
  Turns turns(std::size_t k, double angle, double near, std::size_t most) const {
    return {axis_[k], angle, near, most, true};
  }
  /// The position of an axis, where no other whole turn is within its limits or of use: axes that are not
  /// square to each other may follow the tool axis by more than half a turn.
  std::optional<double> only_turn(std::size_t k, double angle, double near) const {
    double out = 0.0;
    return has_only_turn(k, angle, near, out) ? std::optional(out) : std::nullopt;
  }
  bool limited(std::size_t k) const { return limited_[k]; }
  /// Of an axis with limits: no other whole turn of these angles is within them.
  template <class T>
  lanes::Mask<T> only_within_limits(std::size_t k, const T& angle) const {
    return (angle >= axis_[k].min) & (angle <= axis_[k].max) & (angle - kTwoPi < axis_[k].min - kAtLimit) &
           (angle + kTwoPi > axis_[k].max + kAtLimit);
  }
  /// `only_turn` of two angles side by side; false where one of them has none.
  bool only_turns(std::size_t k, const Lanes& angle, const Lanes& near, Lanes& out) const {
    out = angle;
    if (limited_[k]) return !lanes::any(LaneMask(~only_within_limits(k, angle)));
    out = angle + kTwoPi * lanes::nearest<Lanes>((near - angle) / kTwoPi);
    return !(oblique_ && k == 1) || !lanes::any(LaneMask(lanes::abs(Lanes(out - near)) > 0.5 * kPi));
  }
  /// The same, which is false where there is none.
  bool has_only_turn(std::size_t k, double angle, double near, double& out) const {
    out = angle;
    if (limited_[k]) {
      const Axis& axis = axis_[k];
      return angle >= axis.min && angle <= axis.max && angle - kTwoPi < axis.min - kAtLimit &&
             angle + kTwoPi > axis.max + kAtLimit;
    }
    if (std::abs(near - angle) < near_turn_[k]) return true;
    out = angle + kTwoPi * lanes::nearest((near - angle) / kTwoPi);
    return !(oblique_ && k == 1) || std::abs(out - near) <= 0.5 * kPi;
  }
  /// Whole turns of an axis that may turn for ever make no difference to what follows.
  bool same_position(const std::array<double, 2>& a, const std::array<double, 2>& b) const;

  /// Where the rotary axes stay on their branch by turning by `turn` in all, and RotarySolver::apart is
  /// `apart` at least at both ends, cutting on to the other branch makes the tool leave the part.
  bool parts(double apart, double turn) const { return connection_.parts(apart, turn); }
  /// From `a`, with the tool axis `axis_a_P`, to `b` at `point` the tool has to leave the part.
  static constexpr double kSurelyNone = 10.0 * kRadPerDegree;  // turn of the axes on one branch
  bool reconfigures(const ChoicePosition& a, const Vec3& axis_a_P, const ChoicePosition& b,
                    const ChoicePoint& point) const {
    if (point.rapid) return false;
    double turn = 0.0;
    for (std::size_t k = 0; k < rotary_count_; ++k) turn += std::abs(b.angle[k] - a.angle[k]);
    if (turn < kSurelyNone && a.branch == b.branch) return false;
    return !connection_.connects(a.angle, axis_a_P, b.angle, point.pose.axis_P) ||
           !way_within_limits(a, axis_a_P, point.pose.axis_P);
  }

 private:
  // Mild preference for the middle of the travel, far below the cost of any motion: it decides ties only.
  static constexpr double kCentreWeight_s = 1e-6;

  bool way_within_limits(const ChoicePosition& a, const Vec3& axis_a_P, const Vec3& axis_b_P) const;
  bool holds_on_the_way(const ChoicePosition& a, const Vec3& axis_a_P, const Vec3& axis_P) const;

  const TableKinematics& kinematics_;
  InverseOptions inverse_;
  RotarySolver solver_;
  RotaryConnection connection_;
  std::size_t rotary_count_;
  std::array<Axis, 2> axis_;
  std::array<bool, 2> limited_{};
  std::array<double, 2> middle_{};  // of the limits, and from one to the other
  std::array<double, 2> travel_{};
  std::array<double, 2> near_turn_{};  // of axes that may turn for ever: nearer than this there is no other
  std::array<double, 2> rotary_seconds_{};
  std::array<double, 3> linear_seconds_{};
  bool reaches_pole_ = false;  // within the limits
  bool oblique_ = false;       // the rotary axes are not square to each other
};

}  // namespace trunnion::path
