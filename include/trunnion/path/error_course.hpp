#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/effects/model.hpp"
#include "trunnion/machine/axis_turn.hpp"
#include "trunnion/machine/error_columns.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::path {

/// How far the errors of a machine leave a straight course while the axes make one straight motion: what a
/// certificate of the nominal curve lacks on a machine with errors.
///
/// Over a motion from q0 to q1 let delta(t) be the actual minus the nominal tip in P (mm), epsilon(t) the
/// same of the tool axis. Proved: |delta(t) - [(1 - t) delta(0) + t delta(1)]| <= tip_mm and likewise for
/// epsilon. Proof: README of this layer, "A machine with errors". No allocation; thread-safe.
class ErrorCourse {
 public:
  /// `model` must outlive the object. `tool_mm`: vector from S to the tip.
  ErrorCourse(const Machine& machine, const Vec3& tool_mm, const ModelEvaluator& model);

  struct Bend {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    const Effect* unbounded = nullptr;  // an effect that knows no bound: the figures say nothing then
  };
  /// @param from, to  states at the ends of the motion; all but `q` equal
  /// @param lagged  values of the model's lags on the way; empty for a model without memory, or at rest
  Bend over(const MachineState& from, const MachineState& to, std::span<const double> lagged = {}) const;

  /// An end of a motion with what is known there: sines of the rotary positions and the model's errors.
  struct End {
    const MachineState& state;
    const RotarySines& sines;
    const ChainErrors& errors;
  };
  Bend over(const End& from, const End& to) const;

  /// A bound that is not as near as `over`, from what the errors are at most anywhere (Effect::range), and
  /// needs none of their values: q0 and q1 are the ends of the motion. Nothing outside the travel of the
  /// axes, or where an effect knows no range.
  std::optional<Bend> at_most(const JointVector& q0, const JointVector& q1) const;
  /// The same of motions that follow one another: from each row of these columns (positions by axis) to the
  /// next, `motions` of them, in columns that have room for three more. Three more rows of positions can be
  /// read and are within the travel where these are. False where of one of them nothing is known.
  using Columns = std::array<const double*, kMaxAxes>;
  bool at_most(const Columns& q, std::size_t motions, double* tip_mm, double* axis_rad) const;

  /// Bound on |delta(q1) - delta(q0)|, mm, where the rotary axes stand the same in both and all else of the
  /// state, too, from the same ranges. Nothing where `at_most` has nothing to say.
  std::optional<double> change_at_most(const JointVector& q0, const JointVector& q1) const {
    const double most = change_at_most<double>(q0, q1);
    return most < kNoBound ? std::optional(most) : std::nullopt;
  }
  /// The same of a few motions side by side; kNoBound where it has nothing to say. Joints by axis.
  template <class T, class Joints>
  T change_at_most(const Joints& q0, const Joints& q1) const;
  static constexpr double kNoBound = std::numeric_limits<double>::infinity();

 private:
  struct Joint {
    AxisId id = 0;
    bool rotary = false;
    AxisTurn turn;  // its direction, for a linear joint too
    Vec3 point_mm = Vec3::Zero();
    double min = 0.0, max = 0.0;  // its travel
    TwistBend per_unit;           // of `range_`, where there is one
  };
  template <class T>
  std::optional<std::array<T, 2>> largest(const std::array<T, kMaxAxes>& q0,
                                          const std::array<T, kMaxAxes>& q1) const;
  // What `at_most` knows of an axis.
  struct Share {
    AxisId id = 0;
    TwistBend per_unit;
    double min = 0.0, max = 0.0;
    double change_per_mm = 0.0;  // of delta, at most
  };
  void find_change_per_mm();
  const ModelEvaluator& model_;
  std::vector<Share> linear_shares_, rotary_shares_;
  Vec3 tool_mm_;
  Vec3 part_zero_mm_;
  std::vector<Joint> tool_chain_;  // from the tool inwards
  std::vector<Joint> part_chain_;  // from the bed outwards
  std::optional<TwistRange> range_;
  bool knows_change_ = false;  // of the linear axes
  lanes::Way way_ = lanes::way();
  double constant_mm_ = 0.0;  // the tip is no farther from any link than this and the positions' sum
};

template <class T, class Joints>
T ErrorCourse::change_at_most(const Joints& q0, const Joints& q1) const {
  T sum = lanes::splat<T>(knows_change_ ? 0.0 : kNoBound);
  for (const Share& axis : linear_shares_) {
    const T a = q0[axis.id];
    const T b = q1[axis.id];
    const auto within = (a >= axis.min) & (b >= axis.min) & (a <= axis.max) & (b <= axis.max);
    sum =
        lanes::select(within, T(sum + axis.change_per_mm * lanes::abs(T(b - a))), lanes::splat<T>(kNoBound));
  }
  return sum;
}

}  // namespace trunnion::path
