#include "post/making/block_maker.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

// What a block lasts that takes up lost motion.
constexpr double kTakeUp_s = 0.01;

// Half a digit of three angles, and as much again where a slow axis has a small share of the way.
constexpr double kPlaneDigits = 3.0;

}  // namespace

Result<void> BlockMaker::rapid_to(const path::Point& to) {
  const auto q = places_.of(to, 0.0);
  if (!q) return tl::unexpected(q.error());
  const double seconds = work_.planner.axes().rapid_seconds(work_.at.joints, *q);
  // Nothing is being cut: a good moment to follow the drift.
  work_.thermal.renew();
  if (auto r = work_.thermal.write_shift(); !r) return r;
  work_.moved(*q, seconds);
  work_.at.joints = *q;
  return write(*q, nc::MotionKind::rapid, {}, to.where);
}

Result<void> BlockMaker::cut_to(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth) {
  const double tip_mm = (to.tip_P - work_.at.point.tip_P).norm();
  const auto rate = rate_of(feed, tip_mm, where);
  if (!rate) return tl::unexpected(rate.error());
  auto found = places_.of(to, tip_mm / *rate);
  if (!found) return tl::unexpected(found.error());
  if (work_.errors.lose_motion) {
    const auto taken_up = take_up(*found, where);
    if (!taken_up) return tl::unexpected(taken_up.error());
    if (*taken_up) found = places_.of(to, tip_mm / *rate);
    if (!found) return tl::unexpected(found.error());
  }
  if (*found == work_.at.joints) return {};
  return cut_to_place(to, *found, {*rate, feed, where, depth});
}

Result<void> BlockMaker::cut_to_place(const path::Point& to, JointVector q, const Cut& cut) {
  const double tip_mm = (to.tip_P - work_.at.point.tip_P).norm();
  // A point between the two, compensated itself.
  const auto in_halves = [&]() -> Result<void> {
    path::Point middle = bend_.middle_before(to);
    middle.pace = to.pace;
    ++work_.posting.report.points_inserted;
    if (auto r = cut_to(middle, cut.feed, cut.where, cut.depth + 1); !r) return r;
    work_.at.point = middle;
    return cut_to(to, cut.feed, cut.where, cut.depth + 1);
  };
  // The errors bend the path between the two.
  const bool bent = (work_.errors.compensator || work_.thermal.follows()) && cut.depth < kMaxBends &&
                    bend_.leaves_path(to, q);
  if (bent || (cut.depth < kMaxBends && lasts_long(move_to(q, tip_mm, to.pace), cut.rate_mm_s)))
    return in_halves();
  const FeedPlanner::Move move = move_to(q, tip_mm, to.pace);
  BlockFeed block = work_.planner.plan(move, cut.rate_mm_s);
  work_.at.holds_digits = false;
  // Of a way of one digit even the smallest F may be too fast for axes that turn far.
  if (block.other_mode || block.runs_away() || block.seconds < move.axes_s) {
    if (const auto held = bend_.without_idle_digits(to, q)) {
      q = *held;
      work_.at.holds_digits = true;
      ++work_.posting.report.blocks_held;
      block = work_.planner.plan(move_to(q, tip_mm, to.pace), cut.rate_mm_s);
    } else if (block.seconds < move.axes_s && cut.depth < kMaxBends) {
      return in_halves();
    }
  }
  const JointVector from = work_.at.joints;
  work_.moved(q, block.seconds);
  work_.posting.report.feed_time_lost_s += block.lost_s;
  work_.at.joints = q;
  if (leads() && block.seconds > 0.0) {
    work_.lead.add({from, q, block.seconds, cut.where});
    return {};
  }
  return write(q, nc::MotionKind::feed, block, cut.where);
}

Result<void> BlockMaker::feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where) {
  const nc::FeedFormat& format = work_.posting.controller.numbers.feed;
  const double rate = std::min(rate_mm_s, work_.planner.axes().linear_rate_mm_s());
  BlockFeed feed;
  feed.quanta = format.quanta(nc::FeedMode::per_minute, rate);
  if (format.internal(nc::FeedMode::per_minute, feed.quanta) > rate && feed.quanta > 1) --feed.quanta;
  return write(q, nc::MotionKind::feed, feed, where);
}

Result<bool> BlockMaker::take_up(const JointVector& next, SourceRef where) {
  const auto q = lost_motion_.taken_up(next);
  if (!q) return false;
  // Micrometres, in a time that no axis has to jump for.
  const double rate_mm_s = work_.posting.options.default_feed_mm_s;
  const BlockFeed block = work_.planner.plan(move_to(*q, kTakeUp_s * rate_mm_s), rate_mm_s);
  work_.moved(*q, block.seconds);
  work_.at.joints = *q;
  if (auto r = write(*q, nc::MotionKind::feed, block, where); !r) return tl::unexpected(r.error());
  return true;
}

bool BlockMaker::leads() const {
  if (!work_.lead.is_on()) return false;
  if (!work_.thermal.is_at_run_time()) return true;
  work_.posting.warn_once(
      "servo lag", {},
      "servo_lag is not compensated in coordinates that the control calculates: the axes still lag");
  return false;
}

// What leading adds to the words, as a way of the tip.
void BlockMaker::note_lead(const ServoLead::Led& led) {
  JointVector meant = led.to;
  for (AxisId id = 0; id < kMaxAxes; ++id) meant[id] -= led.by[id];
  const auto tip_P = [&](const JointVector& q) {
    return work_.tool.kinematics.tip_P(q, work_.tool.kinematics.sines(q));
  };
  double& largest_mm = work_.posting.report.largest_correction_mm;
  largest_mm = std::max(largest_mm, (tip_P(led.to) - tip_P(meant)).norm());
}

Result<void> BlockMaker::write_led() {
  if (work_.lead.is_idle()) return {};
  // The way of the axes by itself, so that the planner takes the time as it is.
  constexpr double kAnyRate_mm_s = 1000.0;
  JointVector from = work_.lead.begins_at();
  const double meant_s = work_.lead.seconds();
  double seconds = 0.0;
  std::size_t count = 0;
  const std::size_t blocks = work_.lead.size();
  for (const ServoLead::Led& led : work_.lead.take()) {
    JointVector q = led.to;
    words_.round(q);
    if (q == from) continue;
    note_lead(led);
    work_.axis_words.check_travel(q, work_.tool.tool, led.where);
    const BlockFeed feed = work_.planner.plan(
        {from, q, led.seconds * kAnyRate_mm_s, std::nullopt, work_.planner.axes().slowest_axis_s(from, q)},
        kAnyRate_mm_s);
    if (auto r = write_plain(q, nc::MotionKind::feed, feed, led.where); !r) return r;
    seconds += feed.seconds;
    ++count;
    from = q;
  }
  work_.elapse(seconds - meant_s);
  work_.posting.report.points_inserted += count - std::min(count, blocks);
  return {};
}

Result<void> BlockMaker::write(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                               SourceRef where, std::uint16_t only) {
  if (auto r = write_led(); !r) return r;
  if (only == kAllWords && !work_.in_part() && !work_.thermal.is_at_run_time())
    return write_plain(q, kind, feed, where);
  const JointVector words = words_.of(q);
  nc::Motion motion;
  motion.kind = kind;
  motion.feed_mode = feed.mode;
  motion.feed = feed.quanta;
  motion.source = where;
  const std::size_t axes = work_.posting.machine.axes.size();
  for (AxisId id = 0; id < axes; ++id) {
    if ((only & nc::AxisWords::bit(work_.posting.letters[id])) == 0) continue;
    if (work_.planes.in_force() && work_.posting.machine.axes[id].kind == AxisKind::rotary)
      continue;  // the control keeps them
    motion.words.set(work_.posting.letters[id],
                     work_.posting.controller.numbers.axes.quanta(work_.posting.letters[id], words[id]));
  }
  if (motion.words.mask == 0) return {};
  return work_.thermal.is_at_run_time() ? work_.thermal.write_motion(motion, q)
                                        : work_.posting.writer.write(motion);
}

Result<void> BlockMaker::write_plain(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                     SourceRef where) {
  return work_.posting.writer.write(work_.axis_words.motion(q, kind, feed, where));
}

FeedPlanner::Move BlockMaker::move_to(const JointVector& q, double tip_mm, double pace) const {
  FeedPlanner::Move move{work_.at.joints, q, tip_mm, std::nullopt, 0.0, pace};
  if (!work_.posting.options.rtcp) {
    move.axes_s = work_.planner.axes().slowest_axis_s(work_.at.joints, q);
    // The angles of a plane are words, too: its axes, and with them the ways of the machine's, are off by
    // half a digit of each.
    if (work_.planes.in_force())
      move.axes_s *= 1.0 + kPlaneDigits * work_.posting.controller.numbers.axes.quantum(nc::AxisLetter::A);
    return move;
  }
  const Vec3 from_P = words_.tip_P(work_.at.joints);
  const Vec3 to_P = words_.tip_P(q);
  move.tcp_way_mm = (to_P - from_P).norm();
  move.axes_s = work_.planner.axes().slowest_along_s([&](double t) {
    JointVector at = JointVector::interpolate(work_.at.joints, q, t);
    work_.tool.kinematics.solve_linear(from_P + t * (to_P - from_P), work_.tool.kinematics.sines(at), at);
    return at;
  });
  return move;
}

Result<double> BlockMaker::rate_of(const cl::Feed& feed, double segment_mm, SourceRef where) {
  switch (feed.mode) {
    case cl::FeedMode::per_minute:
      return feed.value;
    case cl::FeedMode::per_revolution:
      if (work_.spindle.rpm() > 0.0) return feed.value * work_.spindle.rpm() / kSecondsPerMinute;
      return fail(ErrorCode::wrong_input, "the feed is given per revolution and the spindle has no speed",
                  work_.posting.job.cl_file, where);
    case cl::FeedMode::inverse:
      return std::max(feed.value * segment_mm, 1e-6);
    case cl::FeedMode::none:
      break;
  }
  work_.posting.warn_once("no feed", where,
                          "no FEDRAT before this motion: the default feed of " +
                              fixed_text(work_.posting.options.default_feed_mm_s * kSecondsPerMinute, 1) +
                              " mm/min is used");
  return work_.posting.options.default_feed_mm_s;
}

// What is lagged counts as it was when the block began.
bool BlockMaker::lasts_long(const FeedPlanner::Move& move, double rate_mm_s) const {
  constexpr double kLongest_s = 10.0;  // a thirtieth of the shortest time constant that effects have
  return !work_.errors.state.lagged().empty() && work_.planner.plan(move, rate_mm_s).seconds > kLongest_s;
}

void BlockMaker::begin_segment(std::size_t i) {
  const auto target = [](const ToolPose& pose, SourceRef where) {
    return Target{pose.tip_P, pose.axis_P, where.line, false};
  };
  const path::ChoicePoint& to = work_.now.chunk->points[i];
  const path::Point& before = work_.now.chunk->before;
  const Target from = i == 0
                          ? target({before.tip_P, before.axis_P}, before.where)
                          : target(work_.now.chunk->points[i - 1].pose, work_.now.chunk->points[i - 1].where);
  work_.course.begin_segment(from, target(to.pose, to.where), work_.tool.tool.flute_mm);
}

void BlockMaker::begin_segment(const path::Point& from, const path::Point& to) {
  const auto target = [](const path::Point& p) { return Target{p.tip_P, p.axis_P, p.where.line, false}; };
  work_.course.begin_segment(target(from), target(to), work_.tool.tool.flute_mm);
}

}  // namespace trunnion::post
