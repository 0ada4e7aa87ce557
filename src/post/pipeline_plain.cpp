// Plain motions: what nearly all of a program is, without what concerns other programs only.
#include <algorithm>

#include "trunnion/base/lanes.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {

bool Pipeline::within_travel(const JointVector& q) const {
  static_assert(kMaxAxes == 5, "two pairs and one");
  // Positions that the machine has no axis for are zero, as their travel.
  const auto pair = [&](AxisId id) {
    const Lanes at{q[id], q[id + 1]};
    return (at >= Lanes{least_[id], least_[id + 1]}) & (at <= Lanes{most_[id], most_[id + 1]});
  };
  const LaneMask both = pair(0) & pair(2);
  return (both[0] & both[1]) != 0 && q[4] >= least_[4] && q[4] <= most_[4];
}

// Words are positions of the machine, all of them.
Result<void> Pipeline::write_plain(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                   SourceRef where) {
  plain_.kind = kind;
  plain_.feed_mode = feed.mode;
  plain_.feed = feed.quanta;
  plain_.source = where;
  for (AxisId id = 0; id < axis_count_; ++id) {
    plain_.words.quanta[nc::index(letters_[id])] =
        controller_.numbers.axes.quanta(letters_[id], q[id] + word_offsets_[id]);
  }
  return writer_.write(plain_);
}

// Nothing but the nominal machine has a say in where the axes go, and words are theirs.
bool Pipeline::is_plain() const {
  return !compensator_ && !offsets_ && !in_part() && !approach_ && placed_ && !turn_waits_ &&
         cutter_ == nc::CutterSide::off && !cutter_changes_;
}

// As emit_segment for the motions from `first` on, up to `end`: those that were prepared, cut at a feed per
// minute and leave nothing to be asked. The first other one ends it.
Result<std::size_t> Pipeline::emit_plain(std::size_t first, std::size_t end) {
  const path::Tolerance& now = tolerances_.cutting();
  const path::Point* last = &last_;
  std::size_t i = first;
  for (; i < end; ++i) {
    const Pending& motion = chunk_->motions[i];
    const PreparedSegment& segment = chunk_->segments[i];
    const path::ChosenPoint& chosen = chunk_->chosen[i];
    if (!segment.known || chosen.reconfigure || motion.feed.mode != cl::FeedMode::per_minute ||
        segment.tolerance.tip_mm != now.tip_mm || segment.tolerance.axis != now.axis ||
        chosen.q_leave != chosen.q)
      break;
    note(segment.report);
    for (std::size_t k = 0; k <= segment.report.inserted; ++k) {
      const path::Point& to =
          k < segment.report.inserted ? chunk_->inserted[segment.first + k] : chunk_->points[i];
      auto done = emit_plain_block(*last, to, motion);
      if (!done) return tl::unexpected(done.error());
      last = &to;
    }
  }
  if (last != &last_) last_ = *last;
  return i;
}

Result<void> Pipeline::emit_plain_block(const path::Point& from, const path::Point& to,
                                        const Pending& motion) {
  if (within_travel(to.q)) {
    if (to.q == last_emitted_) {
      Result<void> done;  // default-initialised: `{}` would clear the room of an Error first
      return done;
    }
    const double tip_mm = (to.tip_P - from.tip_P).norm();
    const BlockFeed block = planner_.plan(move_to(to.q, tip_mm), motion.feed.value);
    if (!block.other_mode && !block.runs_away()) {
      holds_digits_ = false;
      report_.duration_s += block.seconds;
      report_.feed_time_lost_s += block.lost_s;
      last_emitted_ = to.q;
      return write_plain(to.q, nc::MotionKind::feed, block, motion.point.where);
    }
  }
  if (&from != &last_) last_ = from;
  return emit_feed(to, motion.feed, motion.point.where, 0);
}

}  // namespace trunnion::post
