#include "post/making/run_choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/work_shift.hpp"

namespace trunnion::post {
namespace {

std::string degrees_text(Angle angle) {
  return fixed_text(angle.deg(), 4) + " deg";
}

constexpr std::size_t kMostNotes = 20;

}  // namespace

void tell_pole(ProgramInWork& work) {
  const auto& points = work.now.chunk->points;
  const auto& chosen = work.now.chunk->chosen;
  for (const path::PoleStretch& s : work.now.chunk->pole) {
    ++work.posting.report.pole_stretches;
    work.posting.report.largest_pole_tilt = std::max(work.posting.report.largest_pole_tilt, s.tilted_by);
    if (work.posting.report.pole_stretches > kMostNotes) continue;
    work.posting.diagnostics.note(work.posting.job.cl_file, points[s.first].where,
                                  "pole: up to line " + std::to_string(points[s.last].where.line) +
                                      " the tool axis is tilted by up to " + degrees_text(s.tilted_by) +
                                      ", the tip unchanged: the inner rotary axis turns by at most " +
                                      degrees_text(s.turn_after) + " between two points instead of " +
                                      degrees_text(s.turn_before) +
                                      (s.early ? "; it turns early, at the rapid" : ""));
  }
  // What is left of large turns near the pole while cutting, and C that a rapid turned early.
  if (work.tool.kinematics.rotary_count() < 2) return;
  const AxisId inner = work.tool.kinematics.rotary(1);
  const double upright = std::cos(work.posting.options.pole.cone.rad());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i == 0 && !work.at.known) continue;
    const double before = i > 0 ? chosen[i - 1].q_leave[inner] : work.at.point.q[inner];
    const double turn = std::abs(chosen[i].q[inner] - before);
    if (turn <= work.posting.options.pole.min_turn.rad() || chosen[i].reconfigure) continue;
    if (std::abs(work.tool.kinematics.direction(1).dot(points[i].pose.axis_P)) < upright) continue;
    const bool rapid = points[i].rapid;
    if (rapid && !chosen[i].singular) continue;
    std::size_t& count =
        rapid ? work.posting.report.pole_turns_early : work.posting.report.pole_turns_cutting;
    if (++count > kMostNotes) continue;
    work.posting.diagnostics.note(
        work.posting.job.cl_file, points[i].where,
        "pole: axis " + work.posting.machine.axes[inner].name + " turns by " +
            degrees_text(Angle::radians(turn)) +
            (rapid ? " early, at this rapid" : " while cutting; points are inserted"));
  }
}

void choose_plane(ProgramInWork& work) {
  const auto& chosen = work.now.chunk->chosen;
  const auto& points = work.now.chunk->points;
  constexpr double kSameAxis = 1e-9;
  work.planes.plan_none();
  const Vec3& axis_P = points[0].pose.axis_P;
  // Where the tool comes back to a cut it comes back in the plane: that of the place where it was.
  const bool comes_back = work.at.returns && !work.at.approaches && !points[0].rapid;
  bool wanted = !comes_back || (work.at.point.axis_P - axis_P).norm() < kSameAxis;
  for (std::size_t i = 0; i < chosen.size() && wanted; ++i) {
    wanted = (points[i].pose.axis_P - axis_P).norm() < kSameAxis && !chosen[i].reconfigure;
    for (const AxisId id : work.posting.machine.rotary_axes()) {
      wanted = wanted && std::abs(chosen[i].q[id] - chosen[0].q[id]) < kSameAxis &&
               std::abs(chosen[i].q_leave[id] - chosen[0].q[id]) < kSameAxis;
    }
  }
  JointVector q = chosen[0].q;
  for (const AxisId id : work.posting.machine.rotary_axes()) q[id] = work.axis_words.rounded(id, q[id]);
  const Mat3 axes_P = part_in_machine(work.posting.machine, q).R.transpose();
  // Where the part is not turned there is nothing to tilt.
  wanted = wanted && (axes_P - Mat3::Identity()).norm() > kSameAxis;
  nc::TiltedPlane block;
  const PlaneFrame frame = PlaneFrame::of(work.posting.controller, {axes_P, Vec3::Zero()},
                                          part_zero_in_words(work.posting.machine), block);
  if (wanted && q[work.posting.machine.rotary_axes().front()] < 0.0) block.direction = -1;
  const bool same = work.planes.in_force() && wanted && work.planes.has_words_of(block);
  if (same && !work.at.approaches) return;
  // Rapids alone, as the last one of a program, cut nothing: they go as they are.
  wanted = wanted &&
           std::any_of(points.begin(), points.end(), [](const path::ChoicePoint& p) { return !p.rapid; });
  const bool can_enter = work.at.approaches || comes_back || !work.at.known || points[0].rapid;
  if (wanted && can_enter) {
    work.planes.plan(frame, block);
    if (!comes_back) work.at.approaches = true;
  } else if (work.planes.in_force() && !comes_back) {
    // From a safe position, out of the plane: where the program cuts on, from where it was.
    (points[0].rapid ? work.at.approaches : work.at.returns) = true;
  }
}

}  // namespace trunnion::post
