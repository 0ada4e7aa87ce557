// Arcs and drilling cycles of the program read back: what the control makes of them, stroke by stroke.
#include <algorithm>
#include <cmath>

#include "trunnion/nc/expand.hpp"

#include "post/verifier_state.hpp"

namespace trunnion::post {
namespace {

// Share of the tolerance that the chords of an arc may bow by: it counts as deviation.
constexpr double kBowShare = 0.05;

}  // namespace

bool Verifier::State::words_of_shape(const nc::AxisWords& words, SourceRef source, JointVector& out) {
  const std::uint16_t wanted = in_force.wanted();
  if ((words.mask & wanted) != wanted || progress.from_unknown) {
    findings.error(file, source, "an arc or a drilling cycle before all axes have been positioned");
    ++report.points_missed;
    progress.from_unknown = true;
    return false;
  }
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    out[id] = controller.numbers.axes.internal(axis_words.letters[id], words[axis_words.letters[id]]);
  return true;
}

void Verifier::State::take(const nc::Arc& arc) {
  ++report.points_out;
  ++report.feed_blocks;
  JointVector words;
  if (!words_of_shape(arc.words, arc.source, words)) return;
  const nc::ArcCourse course = nc::course_of(arc, controller.numbers.axes, kBowShare * options.tolerance_mm);
  for (const auto& xyz : course.xyz_mm) {
    BlockEnd v = in_force.end_at(axis_words.with_xyz(words, xyz));
    v.nc_line = arc.source.line;
    v.feed = arc.feed;
    v.off_chord_mm = static_cast<float>(course.off_chord_mm);
    put(v);
  }
}

void Verifier::State::take(const nc::Hole& hole) {
  ++report.points_out;
  ++report.feed_blocks;
  JointVector words;
  if (!words_of_shape(hole.words, hole.source, words)) return;
  for (const nc::Stroke& stroke : nc::strokes_of(hole, controller.cycles, controller.numbers.axes)) {
    BlockEnd v = in_force.end_at(axis_words.with_xyz(words, stroke.xyz_mm));
    v.nc_line = hole.source.line;
    v.rapid = stroke.rapid;
    v.feed = hole.feed;
    v.in_cycle = true;
    put(v);
    if (stroke.dwell_s > 0.0) mark(nc::Dwell{std::llround(stroke.dwell_s * 1000.0)});
    if (stroke.dwell_s > 0.0) waiting.add(nc::Dwell{std::llround(stroke.dwell_s * 1000.0)});
  }
}

bool Verifier::State::steps(const Vertex& v) {
  std::size_t end = at.segment + 1;
  if (end >= targets().size() || !targets()[end].step) {
    progress.drilled_mm = 0.0;
    return false;
  }
  while (end < targets().size() && targets()[end].step) ++end;
  if (end == targets().size()) return false;
  const Target& top = targets()[at.segment];
  const Target& bottom = targets()[end];
  const Vec3 down = (bottom.tip_P - top.tip_P).normalized();
  const double length_mm = (bottom.tip_P - top.tip_P).norm();
  double deepest_step_mm = 0.0;
  double before_mm = 0.0;
  for (std::size_t j = at.segment + 1; j <= end; ++j) {
    if (targets()[j].rapid) continue;
    const double depth_mm = down.dot(targets()[j].tip_P - top.tip_P);
    deepest_step_mm = std::max(deepest_step_mm, depth_mm - before_mm);
    before_mm = depth_mm;
  }
  const double depth_mm = down.dot(v.tip_P - top.tip_P);
  // Small steps may back above where the feed begins: out of the hole, along it.
  Target highest = top;
  highest.tip_P += std::min({0.0, depth_mm, down.dot(previous->tip_P - top.tip_P)}) * down;
  take_deviation(meter().of(*previous, v, highest, bottom, as_run.state, {}));
  const double too_deep_mm = depth_mm - progress.drilled_mm - (v.rapid ? 0.0 : deepest_step_mm);
  if (too_deep_mm > 0.0) take_deviation({{0.0, too_deep_mm}, {0.0, 0.0}});
  if (!v.rapid) progress.drilled_mm = std::max(progress.drilled_mm, depth_mm);
  const bool reached = !v.rapid && depth_mm > length_mm - options.tolerance_mm;
  if (reached) {
    point_hit((v.tip_P - bottom.tip_P).norm());
    at = {end, 0.0, 0.0};
    progress.drilled_mm = 0.0;
  }
  record_feed(v, bottom.line, reached);
  if (program_judge && !v.rapid) program_judge->comes_to(reached ? at.segment : end);
  return true;
}

}  // namespace trunnion::post
