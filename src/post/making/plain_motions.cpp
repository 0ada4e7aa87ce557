#include "post/making/plain_motions.hpp"

#include <algorithm>

#include "trunnion/base/lanes.hpp"

#include "post/intake/joint_pair.hpp"

namespace trunnion::post {

bool PlainMotions::serve() const {
  return (!work_.errors.compensator || work_.errors.by_place) && !work_.thermal.has_offsets() &&
         !work_.in_part() && !work_.at.approaches && work_.at.known && !work_.at.turn_due &&
         work_.cutter.is_idle() && !work_.lead.is_on();
}

Result<std::size_t> PlainMotions::make(std::size_t first, std::size_t end) {
  if (work_.errors.compensator &&
      !work_.posting.writer.takes_run(work_.posting.letters, work_.planner.run_mode()))
    return first;
  const Chunk& chunk = *work_.now.chunk;
  PlainRun run;
  const FeedPlanner::Stop from =
      first == 0
          ? FeedPlanner::Stop{&work_.now.chunk->before.q, &work_.now.chunk->before.tip_P}
          : FeedPlanner::Stop{&work_.now.chunk->joints[first - 1], &chunk.points[first - 1].pose.tip_P};
  run.begin(from, first);
  if (work_.errors.compensator) {
    run.begin(work_.at.joints, *from.tip_P, first);
    run.first = first;
    work_.posting.report.largest_error_mm =
        std::max(work_.posting.report.largest_error_mm, work_.now.chunk->corrections.largest_error_mm);
    work_.posting.report.largest_correction_mm = std::max(work_.posting.report.largest_correction_mm,
                                                          work_.now.chunk->corrections.largest_correction_mm);
  }
  InForce said(chunk.words, first);
  cl::Feed feed = said.at(first).words.feed;
  double feed_mm_s = feed.value;
  std::size_t feed_end = first;
  std::size_t i = first;
  while (i < end) {
    if (i == feed_end) {
      feed = said.at(i).words.feed;
      feed_end = said.end(end);
    }
    if (feed.mode == cl::FeedMode::per_minute && feed.value == feed_mm_s)
      i = work_.errors.compensator ? add_known(run, i, feed_end) : add_kept(run, i, feed_end);
    if (i == feed_end) continue;
    const PreparedSegment& segment = chunk.segments[i];
    const path::ChosenPoint& chosen = chunk.chosen[i];
    if (!segment.known() || chosen.reconfigure || feed.mode != cl::FeedMode::per_minute ||
        !same_joints(chosen.q_leave, chosen.q))
      break;
    const std::size_t blocks = 1 + chunk.inserted_in(segment).size();
    if (feed.value != feed_mm_s || run.count + blocks > PlainRun::kMost) {
      if (auto done = write_run(run); !done) return tl::unexpected(done.error());
      feed_mm_s = feed.value;
    }
    if (segment.report >= 0) segments_.note(chunk.reports[static_cast<std::size_t>(segment.report)]);
    if (auto done = add(run, i); !done) return tl::unexpected(done.error());
    ++i;
  }
  if (auto done = write_run(run); !done) return tl::unexpected(done.error());
  if (i > first) work_.at.point = work_.now.chunk->point(i - 1);
  if (work_.errors.compensator && i > first) blocks_.begin_segment(i - 1);
  return i;
}

// Its segment keeps, and it is plain.
inline bool PlainMotions::goes_on(std::size_t i) const {
  const path::ChosenPoint& chosen = work_.now.chunk->chosen[i];
  return work_.now.chunk->segments[i].report == PreparedSegment::kKept && !chosen.reconfigure &&
         same_joints(chosen.q_leave, chosen.q);
}

// The motions from `i` on that go on so, as far as they find room. Gives the next one.
std::size_t PlainMotions::add_kept(PlainRun& run, std::size_t i, std::size_t end) const {
  const Chunk& chunk = *work_.now.chunk;
  const path::ChoicePoint* const points = chunk.points.data();
  const JointVector* const joints = work_.now.chunk->joints.data();
  std::size_t count = run.count;
  for (; i < end && count < PlainRun::kMost && goes_on(i); ++i) {
    ++count;
    run.stops[count] = {&joints[i], &points[i].pose.tip_P, chunk.pace(i)};
    run.motions[count] = i;
  }
  run.count = count;
  return i;
}

// The path's axis turns at nearly all points: that is asked first.
inline bool PlainMotions::axis_stands(std::size_t i) const {
  const Chunk& chunk = *work_.now.chunk;
  const Vec3& before_P = i > 0 ? chunk.points[i - 1].pose.axis_P : chunk.before.axis_P;
  const Vec3& axis_P = chunk.points[i].pose.axis_P;
  return axis_P.x() == before_P.x() && axis_P.y() == before_P.y() && axis_P.z() == before_P.z();
}

// Where the path's axis stands, too.
bool PlainMotions::turns_idly(std::size_t i, const JointVector& from, const JointVector& to) const {
  const Chunk& chunk = *work_.now.chunk;
  const JointVector& before = i > 0 ? chunk.joints[i - 1] : chunk.before.q;
  return !work_.same_rotary(from, to) && work_.same_rotary(chunk.joints[i], before);
}

// The same on a machine with errors, as far as their blocks were corrected and bounded beforehand, and leave
// nothing to be asked.
std::size_t PlainMotions::add_known(PlainRun& run, std::size_t i, std::size_t end) {
  const Chunk::Corrections& known = work_.now.chunk->corrections;
  if (known.keeps.empty()) return i;
  const bool turns_tool = work_.errors.turner != nullptr;
  const JointVector* last = &work_.at.joints;
  std::size_t count = run.count;
  for (; i < end && count < PlainRun::kMost && goes_on(i); ++i) {
    const std::size_t k = work_.now.chunk->segments[i].end;
    if (known.keeps[k] == 0) break;
    const JointVector* const from = &known.joints[k - 1];
    const JointVector& q = known.joints[k];
    if ((from != last && !same_joints(*from, *last)) || same_joints(q, *from) ||
        !work_.axis_words.are_within_travel(q) || (turns_tool && axis_stands(i) && turns_idly(i, *from, q)))
      break;
    last = &q;
    ++count;
    run.stops[count] = {&q, &work_.now.chunk->points[i].pose.tip_P, work_.now.chunk->pace(i)};
    run.motions[count] = i;
  }
  if (count == run.count) return i;
  run.count = count;
  work_.at.joints = *last;
  work_.at.holds_digits = false;
  return i;
}

// The blocks of motion `i`.
Result<void> PlainMotions::add(PlainRun& run, std::size_t i) {
  const ToolPose& end = work_.now.chunk->points[i].pose;
  const auto inserted = work_.now.chunk->inserted_in(work_.now.chunk->segments[i]);
  Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
  if (work_.errors.compensator) {
    if (i > run.first) work_.at.point = work_.now.chunk->point(i - 1);
    blocks_.begin_segment(i);
    std::size_t number = work_.now.chunk->segments[i].end - inserted.size();
    for (const path::Point& point : inserted) {
      done = add_corrected(run, point, point.tip_P, i, number++);
      if (!done) return done;
    }
    return add_corrected(run, work_.now.chunk->point(i), end.tip_P, i, number);
  }
  for (const path::Point& point : inserted) {
    if (run.count == PlainRun::kMost) done = write_run(run);
    if (!done) return done;
    run.add({&point.q, &point.tip_P, point.pace}, i);
  }
  if (run.count == PlainRun::kMost) done = write_run(run);
  run.add({&work_.now.chunk->joints[i], &end.tip_P, work_.now.chunk->pace(i)}, i);
  return done;
}

// Of Chunk::corrections, as far as it is known and within the travel.
const JointVector* PlainMotions::known_correction(std::size_t number) const {
  const Chunk::Corrections& corrections = work_.now.chunk->corrections;
  if (corrections.known.empty() || corrections.known[number] == 0) return nullptr;
  // Where one of them is too large each is asked for by itself, which tells the place.
  if (corrections.largest_correction_mm > work_.posting.options.largest_correction_mm) return nullptr;
  const JointVector* const q = &corrections.joints[number];
  return work_.axis_words.are_within_travel(*q) ? q : nullptr;
}

// The block to `to`, whose tip is `tip_P` of the chunk, of motion `i` and this number among the corrections:
// as BlockMaker::cut_to, but that it waits where it needs no point before it.
Result<void> PlainMotions::add_corrected(PlainRun& run, const path::Point& to, const Vec3& tip_P,
                                         std::size_t i, std::size_t number) {
  Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
  if (run.count == PlainRun::kMost) done = write_run(run);
  if (!done) return done;
  const JointVector* known = known_correction(number);
  if (known != nullptr && !work_.same_rotary(*known, work_.at.joints) && places_.stands(to)) known = nullptr;
  const auto found = known != nullptr ? Result<JointVector>(*known) : places_.of(to, 0.0);
  if (!found) return tl::unexpected(found.error());
  // As it was bounded beforehand.
  const Chunk::Corrections& corrections = work_.now.chunk->corrections;
  const bool bounded = known != nullptr && number > 0 && corrections.known[number - 1] != 0 &&
                       same_joints(corrections.joints[number - 1], work_.at.joints);
  const bool keeps = bounded && corrections.keeps[number] != 0;
  if (*found != work_.at.joints && work_.axis_words.are_within_travel(*found) &&
      (keeps || !bend_.leaves_path(to, *found, bounded))) {
    if (known != nullptr) {
      run.add({known, &tip_P, to.pace}, i);
    } else {
      run.add(*found, {nullptr, &tip_P, to.pace}, i);
    }
    work_.at.joints = *found;
    work_.at.point = to;
    work_.at.holds_digits = false;
    return done;
  }
  done = write_run(run);
  if (!done) return done;
  const ChunkMotion motion = work_.now.chunk->motion(i);
  if (*found != work_.at.joints)
    done = blocks_.cut_to_place(to, *found, {motion.feed.value, motion.feed, motion.point.where, 0});
  work_.at.point = to;
  run.begin(work_.at.joints, tip_P, i);
  return done;
}

// All of them; afterwards the run begins at the last one.
Result<void> PlainMotions::write_run(PlainRun& run) {
  Result<void> one;  // default-initialised: `{}` would clear the room of an Error first
  if (run.count == 0) return one;
  if (work_.errors.compensator) work_.at.joints = *run.stops[0].q;
  bool asked = false;
  for (std::size_t done = 0; done < run.count;) {
    const std::size_t most = std::min(run.count - done, run.together);
    const std::size_t written = work_.axis_words.fill_runs() ? write_together(run, done) : 0;
    done += written;
    run.together = written == most ? std::min(4 * run.together, PlainRun::kMost) : PlainRun::kFewest;
    if (written == most) continue;
    asked = true;
    ++done;
    one = write_one(run, done);
    if (!one) return one;
  }
  const FeedPlanner::Stop& end = run.stops[run.count];
  const std::size_t motion = run.motions[run.count];
  if (!work_.errors.compensator) {
    run.begin(FeedPlanner::Stop(end), motion);
    return one;
  }
  if (asked) {
    work_.at.point = point_of(end, motion);
    blocks_.begin_segment(motion);
  }
  run.begin(work_.at.joints, *end.tip_P, motion);
  return one;
}

// The point of the chunk with this tip, of motion `i` or where it begins.
path::Point PlainMotions::point_of(const FeedPlanner::Stop& stop, std::size_t i) const {
  const auto ends_there = [&](std::size_t k) { return stop.tip_P == &work_.now.chunk->points[k].pose.tip_P; };
  if (ends_there(i)) return work_.now.chunk->point(i);
  if (i > 0 && ends_there(i - 1)) return work_.now.chunk->point(i - 1);
  for (const path::Point& inserted : work_.now.chunk->inserted_in(work_.now.chunk->segments[i])) {
    if (stop.tip_P == &inserted.tip_P) return inserted;
  }
  return work_.now.chunk->before;
}

// Writes blocks from number `done` on, and stops before the first that needs the general way. Gives how many.
std::size_t PlainMotions::write_together(const PlainRun& run, std::size_t done) {
  if (!(*run.stops[done].q == work_.at.joints) ||
      !work_.posting.writer.takes_run(work_.posting.letters, work_.planner.run_mode()))
    return 0;
  RunFeeds feeds;
  const std::size_t most = std::min(run.count - done, run.together);
  const std::span<const FeedPlanner::Stop> stops(run.stops.data() + done, most + 1);
  const std::size_t planned =
      work_.planner.plan_run(stops, work_.now.chunk->words_at(run.motions[done + 1]).feed.value, feeds);
  std::array<nc::RunBlock, PlainRun::kMost> blocks;
  std::size_t count = 0;
  for (; count < planned && work_.axis_words.put(*stops[count + 1].q, blocks[count]); ++count)
    blocks[count].feed = feeds.quanta[count];
  count =
      work_.posting.writer.write_run(work_.posting.letters, work_.planner.run_mode(), {blocks.data(), count});
  if (count == 0) return 0;
  double duration_s = work_.posting.report.duration_s;
  double lost_s = work_.posting.report.feed_time_lost_s;
  for (std::size_t i = 0; i < count; ++i) {
    duration_s += feeds.seconds[i];
    lost_s += feeds.lost_s[i];
  }
  work_.posting.report.duration_s = duration_s;
  work_.posting.report.feed_time_lost_s = lost_s;
  work_.at.holds_digits = false;
  work_.at.joints = *stops[count].q;
  return count;
}

// One block in the general way.
Result<void> PlainMotions::write_one(const PlainRun& run, std::size_t block) {
  const JointVector& q = *run.stops[block].q;
  const Vec3& from_P = *run.stops[block - 1].tip_P;
  const Vec3& to_P = *run.stops[block].tip_P;
  const double pace = run.stops[block].pace;
  const std::size_t i = run.motions[block];
  const ChunkMotion motion = work_.now.chunk->motion(i);
  if (!work_.errors.compensator && work_.axis_words.are_within_travel(q)) {
    Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
    if (q == work_.at.joints) return done;
    const BlockFeed feed =
        work_.planner.plan(blocks_.move_to(q, (to_P - from_P).norm(), pace), motion.feed.value);
    if (!feed.other_mode && !feed.runs_away()) {
      work_.at.holds_digits = false;
      work_.posting.report.duration_s += feed.seconds;
      work_.posting.report.feed_time_lost_s += feed.lost_s;
      work_.at.joints = q;
      return blocks_.write_plain(q, nc::MotionKind::feed, feed, motion.point.where);
    }
  }
  work_.at.point = point_of(run.stops[block - 1], run.motions[block - 1]);
  const path::Point to = point_of(run.stops[block], i);
  if (!work_.errors.compensator) return blocks_.cut_to(to, motion.feed, motion.point.where, 0);
  blocks_.begin_segment(i);
  // No further point is needed where the block starts as it was planned to.
  if (*run.stops[block - 1].q == work_.at.joints)
    return blocks_.cut_to_place(to, q,
                                {motion.feed.value, motion.feed, motion.point.where, BlockMaker::kMaxBends});
  return blocks_.cut_to(to, motion.feed, motion.point.where, 0);
}

}  // namespace trunnion::post
