// Plain motions: what nearly all of a program is, without what concerns other programs only.
#include <algorithm>

#include "trunnion/base/lanes.hpp"

#include "post/intake/joint_pair.hpp"
#include "post/making/plain_run.hpp"

namespace trunnion::post {

// Words are positions of the machine, all of them.
Result<void> Pipeline::write_plain(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                   SourceRef where) {
  return posting_.writer.write(axis_words_.motion(q, kind, feed, where));
}

// Words are positions of the axes, and nothing but the place has a say in where those go: on the nominal
// machine, or on one whose errors hang on the position alone.
bool Pipeline::is_plain() const {
  return (!errors_.compensator || errors_.by_place) && !thermal_.has_offsets() && !in_part() &&
         !at_.approaches && at_.known && !at_.turn_due && cutter_.is_idle();
}

// As emit_segment for the motions from `first` on, up to `end`: those that were prepared, cut at a feed per
// minute and leave nothing to be asked. The first other one ends it. Nothing is said between them, so that
// the tolerance of the first one holds for all.
Result<std::size_t> Pipeline::emit_plain(std::size_t first, std::size_t end) {
  if (errors_.compensator && !posting_.writer.takes_run(posting_.letters, planner_.run_mode())) return first;
  const auto& motions = now_.chunk->motions;
  PlainRun run;
  const FeedPlanner::Stop from =
      first == 0 ? FeedPlanner::Stop{&now_.chunk->before.q, &now_.chunk->before.tip_P}
                 : FeedPlanner::Stop{&now_.chunk->joints[first - 1], &motions[first - 1].point.pose.tip_P};
  run.begin(from, first);
  if (errors_.compensator) {
    run.begin(at_.joints, *from.tip_P, first);
    run.first = first;
    posting_.report.largest_error_mm =
        std::max(posting_.report.largest_error_mm, now_.chunk->corrections.largest_error_mm);
    posting_.report.largest_correction_mm =
        std::max(posting_.report.largest_correction_mm, now_.chunk->corrections.largest_correction_mm);
  }
  double feed_mm_s = motions[first].feed.value;
  std::size_t i = first;
  for (; i < end; ++i) {
    i = errors_.compensator ? add_known(run, i, end, feed_mm_s) : add_kept(run, i, end, feed_mm_s);
    if (i == end) break;
    const Pending& motion = motions[i];
    const PreparedSegment& segment = now_.chunk->segments[i];
    const path::ChosenPoint& chosen = now_.chunk->chosen[i];
    if (!segment.known() || chosen.reconfigure || motion.feed.mode != cl::FeedMode::per_minute ||
        !same_joints(chosen.q_leave, chosen.q))
      break;
    const std::size_t blocks = 1 + now_.chunk->inserted_in(segment).size();
    if (motion.feed.value != feed_mm_s || run.count + blocks > PlainRun::kMost) {
      if (auto done = emit_plain_run(run); !done) return tl::unexpected(done.error());
      feed_mm_s = motion.feed.value;
    }
    if (segment.report >= 0) note(now_.chunk->reports[static_cast<std::size_t>(segment.report)]);
    if (auto done = add_plain(run, i); !done) return tl::unexpected(done.error());
  }
  if (auto done = emit_plain_run(run); !done) return tl::unexpected(done.error());
  if (i > first) at_.point = now_.chunk->point(i - 1);
  if (errors_.compensator && i > first) begin_segment(i - 1);
  return i;
}

// Its segment keeps, and it is plain and has this feed.
inline bool Pipeline::goes_on(std::size_t i, double feed_mm_s) const {
  const path::ChosenPoint& chosen = now_.chunk->chosen[i];
  const cl::Feed& feed = now_.chunk->motions[i].feed;
  return now_.chunk->segments[i].report == PreparedSegment::kKept && !chosen.reconfigure &&
         feed.mode == cl::FeedMode::per_minute && feed.value == feed_mm_s &&
         same_joints(chosen.q_leave, chosen.q);
}

// The motions from `i` on that go on so, as far as they find room. Gives the next one.
std::size_t Pipeline::add_kept(PlainRun& run, std::size_t i, std::size_t end, double feed_mm_s) const {
  const Pending* const motions = now_.chunk->motions.data();
  const JointVector* const joints = now_.chunk->joints.data();
  std::size_t count = run.count;
  for (; i < end && count < PlainRun::kMost && goes_on(i, feed_mm_s); ++i) {
    ++count;
    run.stops[count] = {&joints[i], &motions[i].point.pose.tip_P};
    run.motions[count] = i;
  }
  run.count = count;
  return i;
}

bool Pipeline::turns_idly(std::size_t i, const JointVector& from, const JointVector& to) const {
  if (errors_.turner == nullptr || same_rotary(from, to)) return false;
  const Chunk& chunk = *now_.chunk;
  const path::Point before = i > 0 ? chunk.point(i - 1) : chunk.before;
  return chunk.motions[i].point.pose.axis_P == before.axis_P && same_rotary(chunk.joints[i], before.q);
}

// The same on a machine with errors, as far as their blocks were corrected and bounded beforehand, and leave
// nothing to be asked.
std::size_t Pipeline::add_known(PlainRun& run, std::size_t i, std::size_t end, double feed_mm_s) {
  const Chunk::Corrections& known = now_.chunk->corrections;
  if (known.keeps.empty()) return i;
  const JointVector* last = &at_.joints;
  std::size_t count = run.count;
  for (; i < end && count < PlainRun::kMost && goes_on(i, feed_mm_s); ++i) {
    const std::size_t k = now_.chunk->segments[i].end;
    if (known.keeps[k] == 0) break;
    const JointVector* const from = &known.joints[k - 1];
    const JointVector& q = known.joints[k];
    if ((from != last && !same_joints(*from, *last)) || same_joints(q, *from) ||
        !axis_words_.are_within_travel(q) || turns_idly(i, *from, q))
      break;
    last = &q;
    ++count;
    run.stops[count] = {&q, &now_.chunk->motions[i].point.pose.tip_P};
    run.motions[count] = i;
  }
  if (count == run.count) return i;
  run.count = count;
  at_.joints = *last;
  at_.holds_digits = false;
  return i;
}

// The blocks of motion `i`.
Result<void> Pipeline::add_plain(PlainRun& run, std::size_t i) {
  const ToolPose& end = now_.chunk->motions[i].point.pose;
  const auto inserted = now_.chunk->inserted_in(now_.chunk->segments[i]);
  Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
  if (errors_.compensator) {
    if (i > run.first) at_.point = now_.chunk->point(i - 1);
    begin_segment(i);
    std::size_t number = now_.chunk->segments[i].end - inserted.size();
    for (const path::Point& point : inserted) {
      done = add_corrected(run, point, point.tip_P, i, number++);
      if (!done) return done;
    }
    return add_corrected(run, now_.chunk->point(i), end.tip_P, i, number);
  }
  for (const path::Point& point : inserted) {
    if (run.count == PlainRun::kMost) done = emit_plain_run(run);
    if (!done) return done;
    run.add({&point.q, &point.tip_P}, i);
  }
  if (run.count == PlainRun::kMost) done = emit_plain_run(run);
  run.add({&now_.chunk->joints[i], &end.tip_P}, i);
  return done;
}

void Pipeline::begin_segment(std::size_t i) {
  const auto target = [](const ToolPose& pose, SourceRef where) {
    return Target{pose.tip_P, pose.axis_P, where.line, false};
  };
  const path::ChoicePoint& to = now_.chunk->motions[i].point;
  const path::Point& before = now_.chunk->before;
  const Target from =
      i == 0 ? target({before.tip_P, before.axis_P}, before.where)
             : target(now_.chunk->motions[i - 1].point.pose, now_.chunk->motions[i - 1].point.where);
  course_.begin_segment(from, target(to.pose, to.where), tool_.tool.flute_mm);
}

// Of Chunk::corrections, as far as it is known and within the travel.
const JointVector* Pipeline::known_correction(std::size_t number) const {
  const Chunk::Corrections& corrections = now_.chunk->corrections;
  if (corrections.known.empty() || corrections.known[number] == 0) return nullptr;
  // Where one of them is too large each is asked for by itself, which tells the place.
  if (corrections.largest_correction_mm > posting_.options.largest_correction_mm) return nullptr;
  const JointVector* const q = &corrections.joints[number];
  return axis_words_.are_within_travel(*q) ? q : nullptr;
}

// The block to `to`, whose tip is `tip_P` of the chunk, of motion `i` and this number among the corrections:
// as emit_feed, but that it waits where it needs no point before it.
Result<void> Pipeline::add_corrected(PlainRun& run, const path::Point& to, const Vec3& tip_P, std::size_t i,
                                     std::size_t number) {
  Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
  if (run.count == PlainRun::kMost) done = emit_plain_run(run);
  if (!done) return done;
  const JointVector* known = known_correction(number);
  if (known != nullptr && !same_rotary(*known, at_.joints) && axis_stands(to)) known = nullptr;
  const auto found = known != nullptr ? Result<JointVector>(*known) : corrected(to, 0.0);
  if (!found) return tl::unexpected(found.error());
  // As it was bounded beforehand.
  const Chunk::Corrections& corrections = now_.chunk->corrections;
  const bool bounded = known != nullptr && number > 0 && corrections.known[number - 1] != 0 &&
                       same_joints(corrections.joints[number - 1], at_.joints);
  const bool keeps = bounded && corrections.keeps[number] != 0;
  if (*found != at_.joints && axis_words_.are_within_travel(*found) &&
      (keeps || !bends(to, *found, bounded))) {
    if (known != nullptr) {
      run.add(FeedPlanner::Stop{known, &tip_P}, i);
    } else {
      run.add(*found, tip_P, i);
    }
    at_.joints = *found;
    at_.point = to;
    at_.holds_digits = false;
    return done;
  }
  done = emit_plain_run(run);
  if (!done) return done;
  const Pending& motion = now_.chunk->motions[i];
  if (*found != at_.joints)
    done = emit_corrected(to, *found, motion.feed.value, motion.feed, motion.point.where, 0);
  at_.point = to;
  run.begin(at_.joints, tip_P, i);
  return done;
}

// All of them; afterwards the run begins at the last one.
Result<void> Pipeline::emit_plain_run(PlainRun& run) {
  Result<void> one;  // default-initialised: `{}` would clear the room of an Error first
  if (run.count == 0) return one;
  if (errors_.compensator) at_.joints = *run.stops[0].q;
  bool asked = false;
  for (std::size_t done = 0; done < run.count;) {
    const std::size_t most = std::min(run.count - done, run.together);
    const std::size_t written = axis_words_.fill_runs() ? write_plain_run(run, done) : 0;
    done += written;
    run.together = written == most ? std::min(4 * run.together, PlainRun::kMost) : PlainRun::kFewest;
    if (written == most) continue;
    asked = true;
    ++done;
    one = emit_plain_block(run, done);
    if (!one) return one;
  }
  const FeedPlanner::Stop& end = run.stops[run.count];
  const std::size_t motion = run.motions[run.count];
  if (!errors_.compensator) {
    run.begin(FeedPlanner::Stop(end), motion);
    return one;
  }
  if (asked) {
    at_.point = point_of(end, motion);
    begin_segment(motion);
  }
  run.begin(at_.joints, *end.tip_P, motion);
  return one;
}

// The point of the chunk with this tip, of motion `i` or where it begins.
path::Point Pipeline::point_of(const FeedPlanner::Stop& stop, std::size_t i) const {
  const auto ends_there = [&](std::size_t k) {
    return stop.tip_P == &now_.chunk->motions[k].point.pose.tip_P;
  };
  if (ends_there(i)) return now_.chunk->point(i);
  if (i > 0 && ends_there(i - 1)) return now_.chunk->point(i - 1);
  for (const path::Point& inserted : now_.chunk->inserted_in(now_.chunk->segments[i])) {
    if (stop.tip_P == &inserted.tip_P) return inserted;
  }
  return now_.chunk->before;
}

// Writes blocks from number `done` on, and stops before the first that needs the general way. Gives how many.
std::size_t Pipeline::write_plain_run(const PlainRun& run, std::size_t done) {
  if (!(*run.stops[done].q == at_.joints) ||
      !posting_.writer.takes_run(posting_.letters, planner_.run_mode()))
    return 0;
  RunFeeds feeds;
  const std::size_t most = std::min(run.count - done, run.together);
  const std::span<const FeedPlanner::Stop> stops(run.stops.data() + done, most + 1);
  const std::size_t planned =
      planner_.plan_run(stops, now_.chunk->motions[run.motions[done + 1]].feed.value, feeds);
  std::array<nc::RunBlock, PlainRun::kMost> blocks;
  std::size_t count = 0;
  for (; count < planned && axis_words_.put(*stops[count + 1].q, blocks[count]); ++count)
    blocks[count].feed = feeds.quanta[count];
  count = posting_.writer.write_run(posting_.letters, planner_.run_mode(), {blocks.data(), count});
  if (count == 0) return 0;
  double duration_s = posting_.report.duration_s;
  double lost_s = posting_.report.feed_time_lost_s;
  for (std::size_t i = 0; i < count; ++i) {
    duration_s += feeds.seconds[i];
    lost_s += feeds.lost_s[i];
  }
  posting_.report.duration_s = duration_s;
  posting_.report.feed_time_lost_s = lost_s;
  at_.holds_digits = false;
  at_.joints = *stops[count].q;
  return count;
}

// One block in the general way.
Result<void> Pipeline::emit_plain_block(const PlainRun& run, std::size_t block) {
  const JointVector& q = *run.stops[block].q;
  const Vec3& from_P = *run.stops[block - 1].tip_P;
  const Vec3& to_P = *run.stops[block].tip_P;
  const std::size_t i = run.motions[block];
  const Pending& motion = now_.chunk->motions[i];
  if (!errors_.compensator && axis_words_.are_within_travel(q)) {
    Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
    if (q == at_.joints) return done;
    const BlockFeed feed = planner_.plan(move_to(q, (to_P - from_P).norm()), motion.feed.value);
    if (!feed.other_mode && !feed.runs_away()) {
      at_.holds_digits = false;
      posting_.report.duration_s += feed.seconds;
      posting_.report.feed_time_lost_s += feed.lost_s;
      at_.joints = q;
      return write_plain(q, nc::MotionKind::feed, feed, motion.point.where);
    }
  }
  at_.point = point_of(run.stops[block - 1], run.motions[block - 1]);
  const path::Point to = point_of(run.stops[block], i);
  if (!errors_.compensator) return emit_feed(to, motion.feed, motion.point.where, 0);
  begin_segment(i);
  // No further point is needed where the block starts as it was planned to.
  if (*run.stops[block - 1].q == at_.joints)
    return emit_corrected(to, q, motion.feed.value, motion.feed, motion.point.where, kMaxBends);
  return emit_feed(to, motion.feed, motion.point.where, 0);
}

}  // namespace trunnion::post
