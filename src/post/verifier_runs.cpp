// Motions of the program read back that follow one another with nothing between them.
#include <algorithm>
#include <cmath>
#include <span>

#include "post/verifier_state.hpp"

namespace trunnion::post {

void Verifier::State::take(const nc::MotionRun& run) {
  has_ends = false;
  if (next_waiting < waiting.size()) work();
  std::size_t done = 0;
  if (may_take(run)) {
    const RunEnds& ends = ends_of(run);
    placed_run = ends.within_limits ? meter().place(ends.stations, with_errors) : nullptr;
    if (placed_run != nullptr) done = step(run, ends);
  }
  if (program_judge && run.count > 0) program_judge->take_axes(run.mask, run.source[0].line);
  for (; done < run.count; ++done) take(run.motion(done), nullptr);
  last_end.reset();
  stepped = false;
}

bool Verifier::State::may_take(const nc::MotionRun& run) const {
  const bool stands_on_path =
      started && have_previous && previous->placed && !away && !from_unknown && !walk.goes_on();
  const bool words_are_joints = !in_force.tcp && !in_force.plane && in_force.shift.is_idle() &&
                                (run.mask & axis_words.all) == axis_words.all;
  return stands_on_path && words_are_joints && waiting.empty() && !in_force.compensates && !offsets &&
         !options.collect && meter().may_bow(*previous, *previous) && meter().kinematics().side_by_side();
}

const Verifier::State::RunEnds& Verifier::State::ends_of(const nc::MotionRun& run) {
  // Who reads the same text has mostly come from the same place.
  if (leader != nullptr && same_words && leader->has_ends && leader->run_ends->stations.q(0) == previous->q)
    return *leader->run_ends;
  evaluate(run, *run_ends);
  has_ends = true;
  return *run_ends;
}

void Verifier::State::evaluate(const nc::MotionRun& run, RunEnds& out) const {
  path::StationRun& stations = out.stations;
  stations.resize(run.count + 1);
  for (AxisId id = 0; id < kMaxAxes; ++id) stations.of_axis(id)[0] = previous->q[id];
  lanes::at_a_time(four, [&]<class T>() { put_words<T>(run, out); });
  out.within_limits = true;
  for (AxisId id = 0; id < axis_words.count; ++id)
    out.within_limits = out.within_limits && travel.holds(id, out.smallest_q[id], out.largest_q[id]);
  stations.evaluate();
  std::array<const double*, kMaxAxes> q{};
  for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = stations.of_axis(id).data();
  out.seconds.resize(run.count + lanes::kCount<Quads>);
  out.slowest_s.resize(run.count + lanes::kCount<Quads>);
  planner.times_of(q, run.feed_mode, std::span(run.feed).first(run.count), out.seconds, out.slowest_s);
  lanes::at_a_time(four, [&]<class T>() { find_speed<T>(run.count, out); });
  out.within_limits = out.within_limits && out.speed_ratio <= 1.0 + kSpeedRounding;
}

template <class T>
void Verifier::State::put_words(const nc::MotionRun& run, RunEnds& out) const {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  for (AxisId id = 0; id < axis_words.count; ++id) {
    const WordOfAxis& word = axis_words.of[id];
    const std::int32_t* const quanta = run.quanta[word.letter].data();
    double* const q = out.stations.of_axis(id).data() + 1;
    T smallest = lanes::splat<T>(previous->q[id]);
    T largest = smallest;
    const auto put = [&](std::size_t i, const T& words) {
      const T place = words / word.scale * word.factor - in_force.offset[id];
      lanes::store(q + i, place);
      largest = lanes::larger(largest, place);
      smallest = lanes::select(smallest < place, smallest, place);
    };
    std::size_t i = 0;
    for (; i + kTogether <= run.count; i += kTogether) put(i, lanes::load_whole<T>(quanta + i));
    if (i < run.count)
      put(i, lanes::collect<T>(
                 [&](std::size_t k) { return static_cast<double>(quanta[std::min(i + k, run.count - 1)]); }));
    out.smallest_q[id] = out.largest_q[id] = smallest[0];
    for (int k = 0; k < static_cast<int>(kTogether); ++k) {
      out.smallest_q[id] = std::min(out.smallest_q[id], smallest[k]);
      out.largest_q[id] = std::max(out.largest_q[id], largest[k]);
    }
  }
}

template <class T>
void Verifier::State::find_speed(std::size_t count, RunEnds& out) {
  T largest{};
  for (std::size_t i = 0; i < count; i += lanes::kCount<T>) {
    const T seconds = lanes::load<T>(&out.seconds[i]);
    // What takes no time has no speed.
    const T ratio =
        lanes::load<T>(&out.slowest_s[i]) / lanes::select(seconds > 0.0, seconds, lanes::splat<T>(1.0));
    largest = lanes::larger<T>(largest, lanes::select(seconds > 0.0, ratio, T{}));
  }
  out.speed_ratio = 0.0;
  for (int k = 0; k < static_cast<int>(lanes::kCount<T>); ++k)
    out.speed_ratio = std::max(out.speed_ratio, largest[k]);
}

void Verifier::State::load(const nc::MotionRun& run, const RunEnds& ends, std::size_t row, Vertex& v) const {
  static_cast<BlockEnd&>(v) = BlockEnd{};
  v.q = ends.stations.q(row);
  v.nc_line = run.source[row - 1].line;
  v.feed_mode = run.feed_mode;
  v.feed = run.feed[row - 1];
  v.station = ends.stations.station(row);
  static_cast<ToolPose&>(v) = placed_run->pose(row);
  v.placed = true;
}

std::size_t Verifier::State::pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known) {
  const QuietRun::Found found =
      quiet_run.advance(targets(), *placed_run, row, end, known, report.max_point_deviation_mm, at);
  note_axis(found.axis, found.axis_at_tip, known);
  point_hit(found.point_off_mm);
  return found.count;
}

std::size_t Verifier::State::step(const nc::MotionRun& run, const RunEnds& ends) {
  shares_block = false;
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
    const ToolPose from = placed_run->pose(i);
    const ToolPose to = placed_run->pose(i + 1);
    Place place;
    double axis = 0.0;
    const Quiet quiet = is_quiet(from, to, placed_run->bows(i), known, place, axis);
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
      bows.reset();
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
    if (!away && previous->placed) continue;
    ++i;
    break;
  }
  tell_judge(i);
  if (noted < i && !trail.blocks.empty()) note_on_trail(run, ends, noted + 1, i);
  if (loaded != i) load(run, ends, i, *previous);
  if (i > 0) walk.stands(previous->q);
  meter().put_errors(*previous);
  bows.reset();  // none are known of the last block
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
  last_seconds = ends.seconds[count - 1];
  last_speed_ratio = last_seconds > 0.0 ? ends.slowest_s[count - 1] / last_seconds : 0.0;
  for (std::size_t i = 0; i < count; ++i) elapse(ends.seconds[i]);
}

}  // namespace trunnion::post
