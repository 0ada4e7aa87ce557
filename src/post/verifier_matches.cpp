// Blocks that were matched to the wrong places of the CL path, matched anew.
#include <algorithm>

#include "post/verifier_state.hpp"

namespace trunnion::post {

TrailMark Verifier::State::mark() const {
  return {trail.blocks.empty() ? 0 : trail.blocks.size() - 1,
          at,
          static_cast<const CutFigures&>(report),
          judged_axis_rad,
          report.blocks.size(),
          path_mm,
          as_run.state,
          as_run.offsets,
          program_judge ? program_judge->found() : ProgramJudge::Found{}};
}

void Verifier::State::mark_trail() {
  if (trail.blocks.empty()) trail.blocks.push_back({*previous, 0.0});
  if (!trail.wants_mark()) return;
  trail.shorten();
  trail.marks.push_back(mark());
}

void Verifier::State::note_on_trail(const Vertex& v) {
  mark_trail();
  trail.blocks.push_back({v, 0.0});
}

void Verifier::State::note_on_trail(const nc::MotionRun& run, const RunEnds& ends, std::size_t first,
                                    std::size_t last) {
  for (std::size_t row = first; row <= last; ++row) {
    BlockEnd& end = trail.blocks.emplace_back().end;
    end.q = ends.stations.q(row);
    end.nc_line = run.source[row - 1].line;
    end.feed_mode = run.feed_mode;
    end.feed = run.feed[row - 1];
  }
}

// The time of the program and its travel are what they are wherever the blocks are matched.
void Verifier::State::go_back_to(const TrailMark& mark) {
  at = mark.at;
  static_cast<CutFigures&>(report) = mark.figures;
  judged_axis_rad = mark.judged_axis_rad;
  if (program_judge) program_judge->go_back_to(mark.found);
  as_run.state = mark.program;
  if (mark.offsets) as_run.offsets.emplace(*mark.offsets);
  of_block = {};
}

MatchLimits Verifier::State::match_limits() const {
  return {options.tolerance_mm, options.axis_tolerance.rad(), options.pole.tolerance.rad(), back_limit_mm()};
}

bool Verifier::State::match_anew(std::optional<std::size_t> last_point) {
  const TrailMark now = mark();
  const BlockFigures of_block_now = of_block;
  const std::size_t kept = trail.marks.front().recorded;
  const std::vector<VerifiedBlock> recorded(report.blocks.begin() + static_cast<std::ptrdiff_t>(kept),
                                            report.blocks.end());
  Vertex* const stands = previous;
  bool found = false;
  for (std::size_t m = trail.marks.size(); m-- > 0 && !found;) {
    const TrailMark& mark = trail.marks[m];
    go_back_to(mark);
    std::vector<Vertex> stands_at(trail.blocks.size() - mark.block);
    std::vector<ToolPose> poses;
    for (std::size_t i = 0; i < stands_at.size(); ++i) {
      const BlockTrail::Block& block = trail.blocks[mark.block + i];
      static_cast<BlockEnd&>(stands_at[i]) = block.end;
      meter().place(stands_at[i], block.end.q, as_run.state);
      poses.push_back(stands_at[i]);
      if (i == 0) continue;
      as_run.move_to(block.end.q, block.seconds);
    }
    const auto places = match_places(targets(), mark.at, poses, match_limits(), last_point);
    if (places.empty()) continue;
    go_back_to(mark);
    report.blocks.resize(mark.recorded);
    found = judge_anew(stands_at, places);
    if (!found) continue;
    // What was recorded of the way and the time holds; the last block has none of them yet.
    for (std::size_t i = mark.recorded; i < std::min(kept + recorded.size(), report.blocks.size()); ++i) {
      report.blocks[i].path_mm = recorded[i - kept].path_mm;
      report.blocks[i].seconds = recorded[i - kept].seconds;
    }
    while (trail.marks.size() > m + 1) trail.marks.pop_back();
  }
  previous = stands;
  if (found) {
    as_run.state = now.program;
    if (now.offsets) as_run.offsets.emplace(*now.offsets);
    return true;
  }
  go_back_to(now);
  report.blocks.resize(kept);
  report.blocks.insert(report.blocks.end(), recorded.begin(), recorded.end());
  of_block = of_block_now;
  return false;
}

bool Verifier::State::judge_anew(std::span<Vertex> stands_at, std::span<const Place> places) {
  const std::size_t first = trail.blocks.size() - stands_at.size();
  for (std::size_t i = 0; i < places.size(); ++i) {
    previous = &stands_at[i];
    const Vertex& v = stands_at[i + 1];
    const Place place = placed_at(v, places[i].segment, places[i].t);
    const bool passed_point = judge(v, place);
    if (v.off_chord_mm > 0.0F) bows_by(v.off_chord_mm);
    const bool hit = place.t >= 1.0;
    if (hit) point_hit(place.off_tip_mm);
    if (!report.cuts_within_tolerance()) return false;
    if (program_judge && i + 1 < places.size()) {  // the last one is at hand
      const double seconds = trail.blocks[first + i + 1].seconds;
      program_judge->cut(at, place);
      program_judge->lasts(pace_of(*previous, v, seconds, planner.slowest_axis_s(previous->q, v.q)),
                           v.nc_line);
    } else if (program_judge) {
      program_judge->cut(at, place);
    }
    at = hit ? Place{place.segment + 1, 0.0, 0.0, place.off_tip_mm, place.off_axis} : place;
    record_feed(v, targets()[place.segment + 1].line, hit || passed_point);
    const double seconds = trail.blocks[first + i + 1].seconds;
    as_run.move_to(v.q, seconds);
  }
  return true;
}

void Verifier::State::match_end_of_cut() {
  if (!progress.started || progress.away || trail.marks.empty() || !report.cuts_within_tolerance()) return;
  std::size_t end = at.segment;
  while (end + 1 < targets().size() && !targets()[end + 1].rapid && end < at.segment + kLookAhead) ++end;
  if (end == at.segment ||
      distance_to(*previous, targets()[end].tip_P, targets()[end].axis_P) > hit_tolerance())
    return;
  match_anew(end);
}

}  // namespace trunnion::post
