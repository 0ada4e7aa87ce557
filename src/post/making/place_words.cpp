#include "post/making/place_words.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::post {

JointVector PlaceWords::of(const JointVector& q) const {
  if (work_.in_part()) return of_part(q);
  return work_.axis_words.of(q);
}

Vec3 PlaceWords::tip_P(const JointVector& q) const {
  const JointVector at = of_part(q);
  Vec3 tip = Vec3::Zero();
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind == AxisKind::linear)
      tip[static_cast<Eigen::Index>(nc::index(work_.posting.letters[id]))] =
          work_.posting.controller.numbers.axes.rounded(work_.posting.letters[id], at[id]);
  }
  return work_.planes.in_force() ? work_.planes.in_force()->X_PF * tip : tip;
}

// X, Y and Z words, not rounded, of the tip at `tip_P` with the rotary axes of `at`.
Vec3 PlaceWords::xyz(const Vec3& tip_P, const JointVector& at) const {
  JointVector q = at;
  work_.tool.kinematics.solve_linear(tip_P, work_.tool.kinematics.sines(q), q);
  return xyz_of(of(q));
}

Vec3 PlaceWords::xyz_of(const JointVector& words) const {
  Vec3 out = Vec3::Zero();
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind == AxisKind::linear && nc::index(work_.posting.letters[id]) < 3)
      out[static_cast<Eigen::Index>(nc::index(work_.posting.letters[id]))] = words[id];
  }
  return out;
}

nc::AxisWords PlaceWords::quanta_of(const Vec3& xyz_mm) const {
  nc::AxisWords out;
  for (const nc::AxisLetter letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z})
    out.set(letter, work_.posting.controller.numbers.axes.quanta(
                        letter, xyz_mm[static_cast<Eigen::Index>(nc::index(letter))]));
  return out;
}

// Where the axes stand for these words, the rotary axes as in `at`.
JointVector PlaceWords::joints_of(const nc::AxisWords& words, const JointVector& at) const {
  JointVector q = at;
  Vec3 tip = Vec3::Zero();
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind != AxisKind::linear) continue;
    const double word = work_.posting.controller.numbers.axes.internal(work_.posting.letters[id],
                                                                       words[work_.posting.letters[id]]);
    tip[static_cast<Eigen::Index>(nc::index(work_.posting.letters[id]))] = word;
    q[id] = word - work_.axis_words.offset(id);
  }
  if (work_.in_part())
    work_.tool.kinematics.solve_linear(work_.planes.in_force() ? work_.planes.in_force()->X_PF * tip : tip,
                                       work_.tool.kinematics.sines(q), q);
  return q;
}

void PlaceWords::round(JointVector& q) const {
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.planes.in_force() && work_.posting.machine.axes[id].kind == AxisKind::linear) continue;
    q[id] = work_.axis_words.rounded(id, q[id]);
  }
}

// Words under tool-centre-point control and in a tilted plane: the tip in P or in the plane, for linear axes
// named X, Y and Z.
JointVector PlaceWords::of_part(const JointVector& q) const {
  JointVector words = q;
  Vec3 tip = work_.tool.kinematics.pose(q).tip_P;
  if (work_.planes.in_force()) tip = work_.planes.in_force()->X_PF.inverse() * tip;
  // A CL file of more digits has points half way between two words: away from zero then, however the
  // evaluation of the tip was rounded.
  constexpr double kHalfWay_mm = 1e-9;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind != AxisKind::linear) continue;
    const double word = tip[static_cast<Eigen::Index>(nc::index(work_.posting.letters[id]))];
    words[id] = word + std::copysign(kHalfWay_mm, word);
  }
  return words;
}

}  // namespace trunnion::post
