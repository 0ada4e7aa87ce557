// What is said of the pole, and the tilted planes.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/making/pipeline.hpp"

namespace trunnion::post {
namespace {

std::string degrees_text(Angle angle) {
  return fixed_text(angle.deg(), 4) + " deg";
}

constexpr std::size_t kMostNotes = 20;

}  // namespace

void Pipeline::tell_notes() {
  const auto& motions = now_.chunk->motions;
  const auto& chosen = now_.chunk->chosen;
  for (const path::PoleStretch& s : now_.chunk->pole) {
    ++posting_.report.pole_stretches;
    posting_.report.largest_pole_tilt = std::max(posting_.report.largest_pole_tilt, s.tilted_by);
    if (posting_.report.pole_stretches > kMostNotes) continue;
    posting_.diagnostics.note(posting_.job.cl_file, motions[s.first].point.where,
                              "pole: up to line " + std::to_string(motions[s.last].point.where.line) +
                                  " the tool axis is tilted by up to " + degrees_text(s.tilted_by) +
                                  ", the tip unchanged: the inner rotary axis turns by at most " +
                                  degrees_text(s.turn_after) + " between two points instead of " +
                                  degrees_text(s.turn_before) +
                                  (s.early ? "; it turns early, at the rapid" : ""));
  }
  // What is left of large turns near the pole while cutting, and C that a rapid turned early.
  if (tool_.kinematics.rotary_count() < 2) return;
  const AxisId inner = tool_.kinematics.rotary(1);
  const double upright = std::cos(posting_.options.pole.cone.rad());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i == 0 && !at_.known) continue;
    const double before = i > 0 ? chosen[i - 1].q_leave[inner] : at_.point.q[inner];
    const double turn = std::abs(chosen[i].q[inner] - before);
    if (turn <= posting_.options.pole.min_turn.rad() || chosen[i].reconfigure) continue;
    if (std::abs(tool_.kinematics.direction(1).dot(motions[i].point.pose.axis_P)) < upright) continue;
    const bool rapid = motions[i].point.rapid;
    if (rapid && !chosen[i].singular) continue;
    std::size_t& count = rapid ? posting_.report.pole_turns_early : posting_.report.pole_turns_cutting;
    if (++count > kMostNotes) continue;
    posting_.diagnostics.note(posting_.job.cl_file, motions[i].point.where,
                              "pole: axis " + posting_.machine.axes[inner].name + " turns by " +
                                  degrees_text(Angle::radians(turn)) +
                                  (rapid ? " early, at this rapid" : " while cutting; points are inserted"));
  }
}

// 3+2: all motions of the run have one tool axis and one position of the rotary axes. Planes are entered
// where the run begins with a rapid or from a safe position.
void Pipeline::choose_plane() {
  const auto& chosen = now_.chunk->chosen;
  const auto& motions = now_.chunk->motions;
  constexpr double kSameAxis = 1e-9;
  planes_.plan_none();
  const Vec3& axis_P = motions[0].point.pose.axis_P;
  bool wanted = true;
  for (std::size_t i = 0; i < chosen.size() && wanted; ++i) {
    wanted = (motions[i].point.pose.axis_P - axis_P).norm() < kSameAxis && !chosen[i].reconfigure;
    for (const AxisId id : posting_.machine.rotary_axes()) {
      wanted = wanted && std::abs(chosen[i].q[id] - chosen[0].q[id]) < kSameAxis &&
               std::abs(chosen[i].q_leave[id] - chosen[0].q[id]) < kSameAxis;
    }
  }
  JointVector q = chosen[0].q;
  for (const AxisId id : posting_.machine.rotary_axes()) q[id] = axis_words_.rounded(id, q[id]);
  const Mat3 axes_P = part_in_machine(posting_.machine, q).R.transpose();
  // Where the part is not turned there is nothing to tilt.
  wanted = wanted && (axes_P - Mat3::Identity()).norm() > kSameAxis;
  nc::TiltedPlane block;
  const PlaneFrame frame = PlaneFrame::of(posting_.controller, axes_P, Vec3::Zero(), block);
  if (wanted && q[posting_.machine.rotary_axes().front()] < 0.0) block.direction = -1;
  const bool same = planes_.in_force() && wanted && planes_.has_words_of(block);
  if (same && !at_.approaches) return;
  // Rapids alone, as the last one of a program, cut nothing: they go as they are.
  wanted =
      wanted && std::any_of(motions.begin(), motions.end(), [](const Pending& m) { return !m.point.rapid; });
  const bool can_enter = at_.approaches || !at_.known || motions[0].point.rapid;
  if (wanted && can_enter) {
    planes_.plan(frame, block);
    at_.approaches = true;
  } else if (planes_.in_force()) {
    at_.approaches = true;  // from a safe position, out of the plane
  }
}

}  // namespace trunnion::post
