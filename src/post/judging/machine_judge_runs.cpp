// Many blocks at once: those of a run that nothing stands between, and those of a cut that are matched anew.
#include <algorithm>
#include <cmath>
#include <span>

#include "post/judging/machine_judge.hpp"

namespace trunnion::post {

/// A run with its ends.
struct MachineJudge::RunAtHand {
  const nc::MotionRun& run;
  const RunEnds& ends;

  BlockEnd end(std::size_t row) const {
    BlockEnd out;
    out.q = ends.stations.q(row);
    out.nc_line = run.source[row - 1].line;
    out.feed_mode = run.feed_mode;
    out.feed = run.feed[row - 1];
    return out;
  }
};

std::size_t MachineJudge::take(const nc::MotionRun& run, bool may) {
  at_once_.has_ends = false;
  sharing_.stepped = false;
  if (!waiting_.is_empty()) work();
  if (!may || !may_take_run()) return 0;
  const RunEnds& ends = ends_of(run);
  at_once_.placed = ends.within_limits ? meter().place(ends.stations, at_once_.with_errors) : nullptr;
  return at_once_.placed != nullptr ? step(run, ends) : 0;
}

bool MachineJudge::may_take_run() const {
  const Vertex& from = *ends_.previous;
  const bool stands_on_path = progress_.started && ends_.has_previous && from.placed && !progress_.away;
  return stands_on_path && !as_run_.late.are_late() && waiting_.holds_none() && !as_run_.offsets &&
         !options().collect && meter().may_bow(from, from) && meter().kinematics().side_by_side();
}

const RunEnds& MachineJudge::ends_of(const nc::MotionRun& run) {
  // The leader has mostly come from the same place.
  const MachineJudge* leader = sharing_.leader;
  if (leader != nullptr && sharing_.same_words && leader->at_once_.has_ends &&
      leader->at_once_.ends->stations.q(0) == ends_.previous->q)
    return *leader->at_once_.ends;
  at_once_.ends->evaluate(run, ends_.previous->q, words_, axes_.times, axes_.travel);
  at_once_.has_ends = true;
  return *at_once_.ends;
}

void MachineJudge::load(const RunAtHand& run, std::size_t row, Vertex& v) const {
  static_cast<BlockEnd&>(v) = row > 0 ? run.end(row) : BlockEnd{};
  v.q = run.ends.stations.q(row);
  v.station = run.ends.stations.station(row);
  static_cast<ToolPose&>(v) = at_once_.placed->pose(row);
  v.placed = true;
}

std::size_t MachineJudge::pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known) {
  Place place = at();
  const QuietRun::Found found = at_once_.quiet.advance(points(), *at_once_.placed, row, end, known,
                                                       record_.report.max_point_deviation_mm, place);
  path_.go_to(place);
  record_.take_axis(found.axis, found.axis_at_tip, known);
  record_.point_hit(found.point_off_mm);
  return found.count;
}

std::size_t MachineJudge::step(const nc::MotionRun& run, const RunEnds& ends) {
  const RunAtHand here{run, ends};
  sharing_.same_block = false;
  const auto known_figures = [&] { return record_.known_figures(points().longest_flute_mm()); };
  KnownFigures known = known_figures();
  mark_trail();
  std::size_t loaded = 0;  // the row that `previous` is
  std::size_t noted = 0;   // the last one that the trail has
  std::size_t judged = 0;  // the row up to which the judge has been told
  Place judged_at = at();
  const auto tell_judge = [&](std::size_t row) {
    judge_rows(here, judged, row, judged_at);
    judged = row;
    judged_at = at();
  };
  std::size_t change = row_of_change(ends, 0, run.count);
  std::size_t i = 0;
  for (; i < run.count && at().segment + 3 < points().size(); ++i) {
    if (i < change) i += pass_quiet(i, change, known);
    if (i == run.count || at().segment + 3 >= points().size()) break;
    // Near such a place it is asked block by block.
    if (i >= change) tell_judge(i);
    const ToolPose from = at_once_.placed->pose(i);
    const ToolPose to = at_once_.placed->pose(i + 1);
    const QuietTest test = cut_judge().quiet_test(known);
    const auto place = test.place(from, to);
    const QuietBlock quiet = place ? test.of(from, to, *place, at_once_.placed->bows(i)) : QuietBlock{};
    if (!quiet.surely()) {
      if (loaded != i) load(here, i, *ends_.previous);
      load(here, i + 1, *ends_.present);
      loaded = i;
    }
    if (place && cut_judge().proves_quiet(quiet, {*ends_.previous, *ends_.present, *place}, known)) {
      move_on(to, *place);
      if (i >= change) {
        tell_judge(i + 1);
        change = row_of_change(ends, i + 1, run.count);
      }
      if (quiet.surely()) continue;
    } else {
      if (!may_step() && !is_within_known(*ends_.present)) break;
      meter().put_errors(*ends_.previous);
      meter().put_errors(*ends_.present);
      ends_.last.bows.reset();
      ends_.present->placed = false;
      trail_.add(run, ends.stations, noted + 1, i);
      tell_judge(i);
      feed(*ends_.present);
      if (program_judge_)
        program_judge_->lasts(pace_of(*ends_.previous, *ends_.present, ends.seconds[i], ends.slowest_s[i]),
                              ends_.present->nc_line);
      if (as_run_.feeds) reach(*ends_.present, ends.seconds[i], progress_.away);
      judged = i + 1;
      judged_at = at();
      if (i >= change) change = row_of_change(ends, i + 1, run.count);
      noted = i + 1;
      known = known_figures();
    }
    std::swap(ends_.previous, ends_.present);
    loaded = i + 1;
    if (!progress_.away && ends_.previous->placed) continue;
    ++i;
    break;
  }
  tell_judge(i);
  if (noted < i && !trail_.empty()) trail_.add(run, ends.stations, noted + 1, i);
  if (loaded != i) load(here, i, *ends_.previous);
  meter().put_errors(*ends_.previous);
  ends_.last.bows.reset();  // none are known of the last block
  if (i > 0) count_blocks(here, i);
  forget_passed();
  return i;
}

std::size_t MachineJudge::row_of_change(const RunEnds& ends, std::size_t row, std::size_t end) const {
  if (!program_judge_) return end;
  const std::size_t change = program_judge_->next_change(path_.next());
  if (change >= points().size()) return end;
  // A block ends about where the tip has gone as far as the path.
  constexpr double kLonger = 0.9;
  double left_mm = kLonger * (points()[change - 1].along_mm - points()[at().segment].along_mm -
                              at().t * points()[path_.next()].way_mm) -
                   path_.hit_tolerance_mm();
  for (; row < end; ++row) {
    left_mm -= ends.way_mm[row];
    if (left_mm <= 0.0) return row;
  }
  return end;
}

/// Some of its rows, as the judge of the program asks for them.
struct MachineJudge::RowsAtHand {
  MachineJudge& machine;
  const RunAtHand& at_hand;
  std::size_t first;

  Pace pace(std::size_t i) const {
    const RunEnds& ends = at_hand.ends;
    const std::size_t row = first + i;
    Pace out{ends.way_mm[row],     0.0, ends.seconds[row], ends.slowest_s[row], at_hand.run.feed_mode,
             at_hand.run.feed[row]};
    const auto& words = machine.axis_words();
    for (AxisId id = 0; id < words.count; ++id) {
      const auto& q = ends.stations.of_axis(id);
      out.turn_rad = std::max(out.turn_rad, words.of[id].rotary_share * std::abs(q[row + 1] - q[row]));
    }
    return out;
  }
  double seconds(std::size_t i) const { return at_hand.ends.seconds[first + i]; }
  std::uint32_t line(std::size_t i) const { return at_hand.run.source[first + i].line; }
  /// The first `count` of them, as many as are looked at together at least.
  bool all_keep(const ProgramJudge::SurePace& pace, std::size_t count) const {
    bool keep = false;
    lanes::at_a_time(lanes::way(), [&]<class T>() {
      if (count < lanes::kCount<T>) return;
      const RunEnds& ends = at_hand.ends;
      lanes::Mask<T> all = ~lanes::Mask<T>{};
      for (std::size_t i = 0; i < count; i += lanes::kCount<T>) {
        const std::size_t row = first + std::min(i, count - lanes::kCount<T>);
        all &= pace.holds(lanes::load<T>(&ends.way_mm[row]), lanes::load<T>(&ends.seconds[row]),
                          lanes::load<T>(&ends.slowest_s[row]));
      }
      keep = !lanes::any(lanes::Mask<T>(~all));
    });
    return keep;
  }
  void judged(std::size_t i) const {
    if (!machine.as_run_.feeds) return;
    const RunEnds& ends = at_hand.ends;
    const std::size_t row = first + i;
    machine.reach({ends.stations.q(row), ends.stations.q(row + 1), ends.seconds[row], false,
                   at_hand.run.feed[row], line(i)});
  }
};

void MachineJudge::judge_rows(const RunAtHand& run, std::size_t first, std::size_t last, const Place& from) {
  const RowsAtHand rows{*this, run, first};
  if (program_judge_) return program_judge_->cut(from, at(), last - first, rows);
  for (std::size_t i = 0; i < last - first; ++i) rows.judged(i);
}

void MachineJudge::count_blocks(const RunAtHand& run, std::size_t count) {
  const RunEnds& ends = run.ends;
  for (AxisId id = 0; id < axis_words().count; ++id)
    axes_.travel.take_within(id, ends.smallest_q[id], ends.largest_q[id]);
  record_.report.max_speed_ratio = std::max(record_.report.max_speed_ratio, ends.speed_ratio);
  LastBlock& last = ends_.last;
  last.seconds = ends.seconds[count - 1];
  last.speed_ratio = last.seconds > 0.0 ? ends.slowest_s[count - 1] / last.seconds : 0.0;
  for (std::size_t i = 0; i < count; ++i) elapse(ends.seconds[i]);
}

TrailMark MachineJudge::trail_mark() const {
  return {trail_.empty() ? 0 : trail_.size() - 1,
          at(),
          static_cast<const CutFigures&>(record_.report),
          record_.judged_axis_rad,
          record_.report.blocks.size(),
          record_.path_mm,
          as_run_.state,
          as_run_.offsets,
          program_judge_ ? program_judge_->found() : ProgramJudge::Found{}};
}

void MachineJudge::mark_trail() {
  if (trail_.empty()) trail_.add(*ends_.previous);
  if (!trail_.wants_mark()) return;
  trail_.shorten();
  trail_.marks().push_back(trail_mark());
}

void MachineJudge::note_on_trail(const Vertex& v) {
  mark_trail();
  trail_.add(v);
}

// The time of the program and its travel are what they are wherever the blocks are matched.
void MachineJudge::go_back_to(const TrailMark& mark) {
  path_.go_to(mark.at);
  static_cast<CutFigures&>(record_.report) = mark.figures;
  record_.judged_axis_rad = mark.judged_axis_rad;
  if (program_judge_) program_judge_->go_back_to(mark.found);
  as_run_.state = mark.program;
  if (mark.offsets) as_run_.offsets.emplace(*mark.offsets);
  record_.of_block = {};
}

// The blocks behind the mark, evaluated again; the machine is then at the last of them.
std::vector<Vertex> MachineJudge::trail_from(const TrailMark& mark) {
  std::vector<Vertex> out(trail_.size() - mark.block);
  for (std::size_t i = 0; i < out.size(); ++i) {
    static_cast<BlockEnd&>(out[i]) = trail_.end(mark.block + i);
    meter().place(out[i], out[i].q, as_run_.state);
    if (i > 0) as_run_.move_to(out[i].q, trail_.seconds(mark.block + i));
  }
  return out;
}

bool MachineJudge::match_anew(LastBlockIs last, std::optional<std::size_t> last_point) {
  const TrailMark now = trail_mark();
  const CutRecord::Block of_block_now = record_.of_block;
  auto& blocks = record_.report.blocks;
  const std::size_t kept = trail_.marks().front().recorded;
  const std::vector<VerifiedBlock> recorded(blocks.begin() + static_cast<std::ptrdiff_t>(kept), blocks.end());
  Vertex* const stands = ends_.previous;
  const MatchLimits limits{options().tolerance_mm, options().axis_tolerance.rad(),
                           options().pole.tolerance.rad(), back_limit_mm()};
  bool found = false;
  for (std::size_t m = trail_.marks().size(); m-- > 0 && !found;) {
    const TrailMark& mark = trail_.marks()[m];
    go_back_to(mark);
    std::vector<Vertex> stands_at = trail_from(mark);
    const std::vector<ToolPose> poses(stands_at.begin(), stands_at.end());
    // Ends tell nothing of what lies between them: where that is beyond the tolerance the block is matched to
    // another segment, a few times.
    constexpr int kTries = 32;
    Matched known{last_point, {}};
    for (int i = 0; i < kTries && !found; ++i) {
      const auto places = match_places(points(), mark.at, poses, limits, known);
      if (places.empty()) break;
      go_back_to(mark);
      blocks.resize(mark.recorded);
      const auto beyond = judge_anew(stands_at, places, last);
      found = !beyond;
      if (beyond) known.not_on.insert({*beyond, places[*beyond].segment});
    }
    if (!found) continue;
    // What was recorded of the way and the time holds; the last block has none of them yet.
    for (std::size_t i = mark.recorded; i < std::min(kept + recorded.size(), blocks.size()); ++i) {
      blocks[i].path_mm = recorded[i - kept].path_mm;
      blocks[i].seconds = recorded[i - kept].seconds;
    }
    while (trail_.marks().size() > m + 1) trail_.marks().pop_back();
  }
  ends_.previous = stands;
  if (found) {
    as_run_.state = now.program;
    if (now.offsets) as_run_.offsets.emplace(*now.offsets);
    return true;
  }
  go_back_to(now);
  blocks.resize(kept);
  blocks.insert(blocks.end(), recorded.begin(), recorded.end());
  record_.of_block = of_block_now;
  return false;
}

std::optional<std::size_t> MachineJudge::judge_anew(std::span<Vertex> stands_at,
                                                    std::span<const Place> places, LastBlockIs last) {
  const std::size_t first = trail_.size() - stands_at.size();
  for (std::size_t i = 0; i < places.size(); ++i) {
    ends_.previous = &stands_at[i];
    const Vertex& v = stands_at[i + 1];
    const Place place = path_.placed_at(v, places[i].segment, places[i].t);
    const bool passed_point = cut_judge().judge({*ends_.previous, v, place});
    if (v.off_chord_mm > 0.0F) record_.bows_by(v.off_chord_mm, points().longest_flute_mm() > 0.0);
    const bool hit = place.t >= 1.0;
    if (hit) record_.point_hit(place.off_tip_mm);
    if (!record_.report.cuts_within_tolerance()) return i;
    const double seconds = trail_.seconds(first + i + 1);
    if (program_judge_) program_judge_->cut(at(), place);
    // How long the one at hand lasts is told later.
    if (program_judge_ && (i + 1 < places.size() || last == LastBlockIs::judged)) {
      const Vertex& from = *ends_.previous;
      program_judge_->lasts(pace_of(from, v, seconds, axes_.times.axes().slowest_axis_s(from.q, v.q)),
                            v.nc_line);
    }
    if (program_judge_) program_judge_->take_slow();  // it was asked about when it was at hand first
    path_.go_to(hit ? Place{place.segment + 1, 0.0, 0.0, place.off_tip_mm, place.off_axis} : place);
    record_.end_cut(v, points()[place.segment + 1].line, hit || passed_point);
    as_run_.move_to(v.q, seconds);
  }
  return std::nullopt;
}

bool MachineJudge::may_match_anew() const {
  return progress_.started && !progress_.away && !trail_.marks().empty() &&
         record_.report.cuts_within_tolerance();
}

std::size_t MachineJudge::end_of_cut() const {
  std::size_t end = at().segment;
  while (end + 1 < points().size() && !points()[end + 1].rapid && end < at().segment + kLookAhead) ++end;
  return end;
}

// A CL point ahead at which the tool stands, where that is not at the place that was found.
std::optional<std::size_t> MachineJudge::stands_ahead() const {
  const Vertex& stands = *ends_.previous;
  const double near_mm = path_.limits().on_truth ? options().tolerance_mm : words_rounding_mm();
  const double off_mm = path_.distance_to(stands, path_.here());
  if (off_mm <= near_mm) return std::nullopt;
  const std::size_t end = end_of_cut();
  for (std::size_t i = path_.next(); i <= end; ++i) {
    if ((stands.tip_P - points()[i].tip_P).norm() <= near_mm && path_.hits(stands, points()[i]) &&
        path_.distance_to(stands, points()[i]) + near_mm < off_mm)
      return i;
  }
  return std::nullopt;
}

// What is said here tells of the CL path where the tool is.
void MachineJudge::end_trail() {
  if (may_match_anew()) {
    if (const auto point = stands_ahead()) match_anew(LastBlockIs::judged, point);
  }
  trail_.clear();
}

void MachineJudge::match_end_of_cut() {
  if (!may_match_anew()) return;
  const std::size_t end = end_of_cut();
  if (end == at().segment || !path_.hits(*ends_.previous, points()[end])) return;
  match_anew(LastBlockIs::judged, end);
}

}  // namespace trunnion::post
