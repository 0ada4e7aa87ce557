#include "trunnion/path/point.hpp"

#include <cmath>

#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {

namespace {

double half_diagonal(const Rounding& rounding, const Machine& machine, AxisKind kind) {
  double sum = 0.0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (machine.axes[id].kind == kind) sum += rounding.quantum[id] * rounding.quantum[id];
  }
  return 0.5 * std::sqrt(sum);
}

}  // namespace

double Rounding::tip_error_mm(const Machine& machine) const {
  return half_diagonal(*this, machine, AxisKind::linear);
}

double Rounding::axis_error_rad(const Machine& machine) const {
  return half_diagonal(*this, machine, AxisKind::rotary);
}

bool Rounding::is_identity() const {
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    if (quantum[id] > 0.0) return false;
  }
  return true;
}

Rounding Rounding::of(const Machine& machine, const Vec3& tool_mm, const JointVector& quantum) {
  return {quantum, words_of(machine, JointVector(), tool_mm)};
}

RotarySines round_to_words(const TableKinematics& kinematics, const Rounding& rounding, const Vec3& tip_P,
                           JointVector& q, const KnownSines& known) {
  for (std::size_t k = 0; k < kinematics.rotary_count(); ++k) {
    const AxisId id = kinematics.rotary(k);
    q[id] = rounding.rounded(id, q[id]);
  }
  const RotarySines sines = known.at(kinematics, q);
  kinematics.solve_linear(tip_P, sines, q);
  for (std::size_t i = 0; i < 3; ++i)
    q[kinematics.linear(i)] = rounding.rounded(kinematics.linear(i), q[kinematics.linear(i)]);
  return sines;
}

}  // namespace trunnion::path
