#pragma once
#include <span>
#include <string>

#include "trunnion/base/result.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/machine/error_kinematics.hpp"
#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/error_course.hpp"

namespace trunnion::path {

/// A correction ends when the tip is this near to where it is prescribed, mm (1 nm: a hundredth of the finest
/// NC word).
inline constexpr double kCorrected_mm = 1e-6;

struct CompensationOptions {
  /// Correct the rotary axes too, where there are two. The outer one takes out what lies in the plane in
  /// which it tilts the tool; what lies across it takes dC = d / sin(tilt) of the inner one, which turns by
  /// no more than the sine of the tilt: nearer to the pole than the root of d a part of it stays
  /// (Corrected::axis_P), at the pole all.
  bool orientation = false;
};

/// What to command so that the erroneous machine does what the CL file prescribes.
struct Corrected {
  JointVector q;
  double before_mm = 0.0;     // deviation of the tip without correction
  double left_mm = 0.0;       // with it, before rounding: what it is, or a bound
  Vec3 aim_P = Vec3::Zero();  // from tip_P to where the nominal machine would put the tip, mm
  /// Actual tool axis with it, or before its last step: its deviation stays.
  Vec3 axis_P = Vec3::UnitZ();
  int steps = 0;  // evaluations of the error model that moved q
  /// The state lies outside a table's measured range, whose end value was held (see
  /// Compensator::range_message).
  bool held = false;
};

/// Finds joint positions whose actual pose, on the machine with the errors of a model, is the prescribed one:
///
///     target_0 = tip_P;   q_k = linear axes for target_k (rotary axes given);   target_k+1 = target_k -
///     (tip_actual(q_k) - tip_P)
///
/// tip_actual from the forward model with errors, less the datum shift (Machine::probed_at). The errors
/// change by 1e-4 of a step, so that each step gains four digits. The last step is not evaluated where what
/// it leaves is bounded (ErrorCourse::change_at_most). Thread-safe; does not allocate.
class Compensator {
 public:
  /// Keeps copies of what it needs of `machine` and `model`. `tool_mm`: vector from S to the tip, as
  /// programmed.
  Compensator(const Machine& machine, const Model& model, const Vec3& tool_mm,
              const CompensationOptions& options = {});
  Compensator(const Compensator&) = delete;
  Compensator& operator=(const Compensator&) = delete;

  /// @param tip_P, axis_P  what the CL file prescribes at this point (unit axis)
  /// @param at      the machine at this point: `at.q` nominal (its rotary positions are taken as they are,
  /// rounded or not), sense of
  ///                motion, velocities, spindle speed, temperatures, time
  /// @param lagged  values of evaluator().lags() at this point; empty for a model without memory, or at rest
  /// @param near    Corrected::aim_P of a point nearby, from which the iteration begins: one evaluation less
  /// Fails with check_failed: outside a table that says `outside = "error"`; no convergence (errors that
  /// change faster than the position).
  Result<Corrected> corrected(const Vec3& tip_P, const Vec3& axis_P, const MachineState& at,
                              std::span<const double> lagged = {}, const Vec3& near = Vec3::Zero()) const;

  /// Bounds on what its errors do between two positions.
  const ErrorCourse& course() const { return course_; }

  /// The tool in P on the machine with errors, as the shop sees it: less the datum shift.
  ToolPose actual(const MachineState& at, std::span<const double> lagged = {}) const;

  /// Why `Corrected::held` was set at this state.
  std::string range_message(const MachineState& at) const { return evaluator_.check_range(at).message; }
  const ModelEvaluator& evaluator() const { return evaluator_; }
  /// The machine with errors, those of links that do not vary held; its tips are not less the datum shift.
  const ErrorKinematics& with_errors() const { return with_errors_; }
  const CompensationOptions& options() const { return options_; }
  const Vec3& datum_shift() const { return datum_shift_P_; }

 private:
  struct ToolTurn;
  ToolPose actual(const MachineState& at, const RotarySines& sines, std::span<const double> lagged) const;
  Machine machine_;
  ModelEvaluator evaluator_;
  CompensationOptions options_;
  TableKinematics kinematics_;
  ErrorKinematics with_errors_;
  ErrorCourse course_;
  Vec3 datum_shift_P_;
};

}  // namespace trunnion::path
