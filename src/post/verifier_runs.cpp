// Motions of the program read back that follow one another with nothing between them.
#include <algorithm>
#include <cmath>
#include <span>

#include "post/verifier_state.hpp"

namespace trunnion::post {

void Verifier::State::take(const nc::MotionRun& run) {
  at_once.has_ends = false;
  if (!waiting.is_empty()) work();
  std::size_t done = 0;
  if (may_take(run)) {
    const RunEnds& ends = ends_of(run);
    at_once.placed = ends.within_limits ? meter().place(ends.stations, at_once.with_errors) : nullptr;
    if (at_once.placed != nullptr) done = step(run, ends);
  }
  if (program_judge && run.count > 0) program_judge->take_axes(run.mask, run.source[0].line);
  for (; done < run.count; ++done) take(run.motion(done), nullptr);
  shared.begin_motion();
}

bool Verifier::State::may_take(const nc::MotionRun& run) const {
  const bool stands_on_path = progress.started && have_previous && previous->placed && !progress.away &&
                              !progress.from_unknown && !walk.goes_on();
  const bool words_are_joints = !in_force.tcp && !in_force.plane && in_force.shift.is_idle() &&
                                (run.mask & axis_words.all) == axis_words.all;
  return stands_on_path && words_are_joints && waiting.blocks.empty() && !in_force.compensates &&
         !as_run.offsets && !options.collect && meter().may_bow(*previous, *previous) &&
         meter().kinematics().side_by_side();
}

const RunEnds& Verifier::State::ends_of(const nc::MotionRun& run) {
  // Who reads the same text has mostly come from the same place.
  if (shared.leader != nullptr && shared.same_words && shared.leader->at_once.has_ends &&
      shared.leader->at_once.ends->stations.q(0) == previous->q)
    return *shared.leader->at_once.ends;
  at_once.ends->evaluate(run, previous->q, in_force, planner, travel);
  at_once.has_ends = true;
  return *at_once.ends;
}

void Verifier::State::load(const nc::MotionRun& run, const RunEnds& ends, std::size_t row, Vertex& v) const {
  static_cast<BlockEnd&>(v) = BlockEnd{};
  v.q = ends.stations.q(row);
  v.nc_line = run.source[row - 1].line;
  v.feed_mode = run.feed_mode;
  v.feed = run.feed[row - 1];
  v.station = ends.stations.station(row);
  static_cast<ToolPose&>(v) = at_once.placed->pose(row);
  v.placed = true;
}

std::size_t Verifier::State::pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known) {
  const QuietRun::Found found =
      at_once.quiet.advance(targets(), *at_once.placed, row, end, known, report.max_point_deviation_mm, at);
  note_axis(found.axis, found.axis_at_tip, known);
  point_hit(found.point_off_mm);
  return found.count;
}

std::size_t Verifier::State::step(const nc::MotionRun& run, const RunEnds& ends) {
  shared.same_block = false;
  KnownFigures known = known_figures();
  mark_trail();
  std::size_t loaded = 0;  // the row that `previous` is
  std::size_t noted = 0;   // the last one that the trail has
  std::size_t judged = 0;  // the row up to which the judge has been told
  Place judged_at = at;
  const auto tell_judge = [&](std::size_t row) {
    if (program_judge) judge_rows(run, ends, judged, row, judged_at);
    judged = row;
    judged_at = at;
  };
  std::size_t change = row_of_change(ends, 0, run.count);
  std::size_t i = 0;
  for (; i < run.count && at.segment + 3 < targets().size(); ++i) {
    if (i < change) i += pass_quiet(i, change, known);
    if (i == run.count || at.segment + 3 >= targets().size()) break;
    // Near such a place it is asked block by block.
    if (i >= change) tell_judge(i);
    const ToolPose from = at_once.placed->pose(i);
    const ToolPose to = at_once.placed->pose(i + 1);
    Place place;
    double axis = 0.0;
    const Quiet quiet = is_quiet(from, to, at_once.placed->bows(i), known, place, axis);
    if (!quiet.surely()) {
      if (loaded != i) load(run, ends, i, *previous);
      load(run, ends, i + 1, *present);
      loaded = i;
    }
    if (proves_quiet(quiet, *present, place, known, axis)) {
      move_on(to, place);
      if (i >= change) {
        tell_judge(i + 1);
        change = row_of_change(ends, i + 1, run.count);
      }
      if (quiet.surely()) continue;
    } else {
      if (!may_step() && !is_within_known(*present)) break;
      meter().put_errors(*previous);
      meter().put_errors(*present);
      last_block.bows.reset();
      present->placed = false;
      note_on_trail(run, ends, noted + 1, i);
      tell_judge(i);
      feed(*present);
      if (program_judge)
        program_judge->lasts(pace_of(*previous, *present, ends.seconds[i], ends.slowest_s[i]),
                             present->nc_line);
      judged = i + 1;
      judged_at = at;
      if (i >= change) change = row_of_change(ends, i + 1, run.count);
      noted = i + 1;
      known = known_figures();
    }
    std::swap(previous, present);
    loaded = i + 1;
    if (!progress.away && previous->placed) continue;
    ++i;
    break;
  }
  tell_judge(i);
  if (noted < i && !trail.blocks.empty()) note_on_trail(run, ends, noted + 1, i);
  if (loaded != i) load(run, ends, i, *previous);
  if (i > 0) walk.stands(previous->q);
  meter().put_errors(*previous);
  last_block.bows.reset();  // none are known of the last block
  if (i > 0) count_blocks(run, ends, i);
  forget_passed();
  return i;
}

std::size_t Verifier::State::row_of_change(const RunEnds& ends, std::size_t row, std::size_t end) const {
  if (!program_judge) return end;
  const std::size_t change = program_judge->next_change(at.segment + 1);
  if (change >= targets().size()) return end;
  // A block ends about where the tip has gone as far as the path.
  constexpr double kLonger = 0.9;
  double left_mm = kLonger * (targets()[change - 1].along_mm - targets()[at.segment].along_mm -
                              at.t * targets()[at.segment + 1].way_mm) -
                   hit_tolerance();
  const path::PoseRun& poses = ends.stations.poses();
  for (; row < end; ++row) {
    double way2 = 0.0;
    for (const auto& tip : poses.tip_P) way2 += (tip[row + 1] - tip[row]) * (tip[row + 1] - tip[row]);
    left_mm -= std::sqrt(way2);
    if (left_mm <= 0.0) return row;
  }
  return end;
}

void Verifier::State::judge_rows(const nc::MotionRun& run, const RunEnds& ends, std::size_t first,
                                 std::size_t last, const Place& from) {
  const path::PoseRun& poses = ends.stations.poses();
  program_judge->cut(
      from, at, last - first,
      [&](std::size_t i) {
        const std::size_t row = first + i;
        Pace out;
        double way2 = 0.0;
        for (const auto& tip : poses.tip_P) way2 += (tip[row + 1] - tip[row]) * (tip[row + 1] - tip[row]);
        out.way_mm = std::sqrt(way2);
        for (AxisId id = 0; id < axis_words.count; ++id) {
          const auto& q = ends.stations.of_axis(id);
          out.turn_rad =
              std::max(out.turn_rad, axis_words.of[id].rotary_share * std::abs(q[row + 1] - q[row]));
        }
        out.seconds = ends.seconds[row];
        out.slowest_s = ends.slowest_s[row];
        out.mode = run.feed_mode;
        out.feed = run.feed[row];
        return out;
      },
      [&](std::size_t i) { return run.source[first + i].line; });
}

void Verifier::State::count_blocks(const nc::MotionRun& run, const RunEnds& ends, std::size_t count) {
  report.points_out += count;
  report.feed_blocks += count;
  const nc::AxisWords words = run.motion(count - 1).words;
  for (AxisId id = 0; id < axis_words.count; ++id) {
    travel.take_within(id, ends.smallest_q[id], ends.largest_q[id]);
    if (axis_words.of[id].rotary != 0) in_force.rotary[id] = axis_words.of[id].internal(words);
  }
  report.max_speed_ratio = std::max(report.max_speed_ratio, ends.speed_ratio);
  last_block.seconds = ends.seconds[count - 1];
  last_block.speed_ratio = last_block.seconds > 0.0 ? ends.slowest_s[count - 1] / last_block.seconds : 0.0;
  for (std::size_t i = 0; i < count; ++i) elapse(ends.seconds[i]);
}

}  // namespace trunnion::post
