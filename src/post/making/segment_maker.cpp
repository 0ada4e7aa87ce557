#include "post/making/segment_maker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/path/reconfiguration.hpp"

namespace trunnion::post {

SegmentMaker::SegmentMaker(ProgramInWork& work, const BlockBend& bend, BlockMaker& blocks, SafeWay& safe_way,
                           RotaryTurns& turns)
    : work_(work),
      bend_(bend),
      blocks_(blocks),
      safe_way_(safe_way),
      turns_(turns),
      refined_(work.posting, work.tool.tool.vector(), work.axis_words.rounding()) {}

void SegmentMaker::set_tool(const SpindleTool& tool) {
  refined_.set_tool(work_.posting, tool.vector(), work_.axis_words.rounding());
}

const PreparedSegment* SegmentMaker::prepared(std::size_t i) const {
  const PreparedSegment& segment = work_.now.chunk->segments[i];
  if (!segment.known()) return nullptr;
  const path::Tolerance& now = work_.modes.tolerances.cutting();
  const path::Tolerance& then = work_.now.chunk->tolerance_at(i);
  if (then.tip_mm != now.tip_mm || then.axis != now.axis || then.flute.length_mm != now.flute.length_mm ||
      then.flute.off_mm != now.flute.off_mm)
    return nullptr;
  const auto begins_at = [&](const JointVector& q, const Vec3& tip_P, const Vec3& axis_P) {
    return work_.at.point.q == q && work_.at.point.tip_P == tip_P && work_.at.point.axis_P == axis_P;
  };
  if (i == 0) {
    const path::Point& from = work_.now.chunk->before;
    return begins_at(from.q, from.tip_P, from.axis_P) ? &segment : nullptr;
  }
  const ToolPose& from = work_.now.chunk->points[i - 1].pose;
  return begins_at(work_.now.chunk->joints[i - 1], from.tip_P, from.axis_P) ? &segment : nullptr;
}

Result<void> SegmentMaker::make(const path::Point& to, const ChunkMotion& motion,
                                const PreparedSegment* prepared) {
  if (motion.point.rapid || work_.at.approaches || !work_.at.known) {
    if (work_.thermal.prepare_shift(to.q)) work_.at.approaches = true;
  } else if (work_.thermal.waits()) {
    work_.posting.warn_once(
        "shift in cut", motion.point.where,
        "operation '" + work_.thermal.operation() +
            "' begins inside a cut: its shift of the work offset is applied at the next rapid");
  }
  if (work_.at.approaches || !work_.at.known) {
    work_.at.approaches = false;
    work_.tool.check_own_length(work_.posting);
    auto done = safe_way_.approach(to, motion);
    work_.at.known = true;
    return done;
  }
  if (motion.feed.mode == cl::FeedMode::inverse && !motion.point.rapid) {
    // The time is that of the whole segment: its pieces share one rate.
    const auto rate =
        blocks_.rate_of(motion.feed, (to.tip_P - work_.at.point.tip_P).norm(), motion.point.where);
    if (!rate) return tl::unexpected(rate.error());
    const cl::Feed feed{cl::FeedMode::per_minute, *rate};
    const ChunkMotion at_rate{motion.point, feed};
    // Where the tip stands there is no rate of its: the rotary axes take the time.
    constexpr double kStands_mm = 1e-6;
    constexpr double kSameAxis = 1e-9;
    const bool in_place = (to.tip_P - work_.at.point.tip_P).norm() < kStands_mm;
    if (!in_place || (to.axis_P - work_.at.point.axis_P).norm() < kSameAxis)
      return make(to, at_rate, prepared);
    double turn_rad = 0.0;
    for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
      if (work_.posting.machine.axes[id].kind == AxisKind::rotary)
        turn_rad = std::max(turn_rad, std::abs(to.q[id] - work_.at.point.q[id]));
    }
    work_.planner.axes().limit_turn(turn_rad * motion.feed.value);
    auto done = make(to, at_rate, prepared);
    work_.planner.axes().limit_turn(std::numeric_limits<double>::infinity());
    return done;
  }
  blocks_.begin_segment(work_.at.point, to);
  if (prepared != nullptr) {
    if (prepared->report >= 0) note(work_.now.chunk->reports[static_cast<std::size_t>(prepared->report)]);
    for (const path::Point& point : work_.now.chunk->inserted_in(*prepared)) {
      if (auto done = go_to(point, motion); !done) return done;
    }
    return go_to(to, motion);
  }
  const bool rapid = motion.point.rapid;
  refined_.inserted.clear();
  if (rapid) {
    const bool stays =
        !turns_.rewinds(to, to.q) &&
        refined_.rapids.decide({work_.at.point, to}, work_.modes.tolerances.rapid(), 0.0, refined_.inserted)
            .converged;
    if (!stays) {
      auto done = turns_.rapid_above(to);
      work_.at.point = to;
      return done;
    }
  } else {
    note(
        refined_.cuts.decide({work_.at.point, to}, work_.modes.tolerances.cutting(), 0.0, refined_.inserted));
  }
  for (path::Point& point : refined_.inserted) {
    point.pace = to.pace;
    if (auto done = go_to(point, motion); !done) return done;
  }
  return go_to(to, motion);
}

Result<void> SegmentMaker::go_to(const path::Point& point, const ChunkMotion& motion) {
  auto done = motion.point.rapid ? blocks_.rapid_to(point)
                                 : blocks_.cut_to(point, motion.feed, motion.point.where, 0);
  work_.at.point = point;
  return done;
}

void SegmentMaker::note(const path::SegmentReport& r) {
  work_.posting.report.points_inserted += r.inserted;
  if (r.inserted > 0) ++work_.posting.report.segments_with_points;
  if (!r.converged) ++work_.posting.report.segments_not_converged;
  work_.posting.report.worst_predicted_mm = std::max(work_.posting.report.worst_predicted_mm, r.predicted_mm);
  work_.posting.report.worst_programmed_mm =
      std::max(work_.posting.report.worst_programmed_mm, r.midpoint_mm);
}

std::size_t SegmentMaker::cutting_run_end(std::size_t first, std::size_t event) const {
  const Chunk& chunk = *work_.now.chunk;
  const auto& events = work_.now.chunk->events;
  const auto& chosen = work_.now.chunk->chosen;
  if (!work_.posting.options.nonlinear.thin && !work_.posting.options.nonlinear.move_programmed_points)
    return first;
  const auto cuts = [&](std::size_t i) {
    // An inverse time is that of one motion: what passes several has none.
    return !chunk.points[i].rapid && chosen[i].q_leave == chosen[i].q &&
           chunk.words_at(i).feed.mode != cl::FeedMode::inverse;
  };
  // The motion in which the control goes to the compensated path, or leaves it, ends where the CL file's
  // does.
  for (std::size_t e = event; e > 0 && events[e - 1].before == first; --e)
    if (std::holds_alternative<cl::CutterCompensation>(events[e - 1].record.data)) return first;
  if (work_.at.approaches || !work_.at.known || !cuts(first)) return first;
  std::size_t last = first;
  while (last + 1 < chunk.size() && cuts(last + 1) && !chosen[last + 1].reconfigure &&
         chunk.words_at(last + 1).feed == chunk.words_at(first).feed &&
         (event >= events.size() || events[event].before > last + 1)) {
    ++last;
  }
  return last;
}

Result<void> SegmentMaker::make_cutting_run(std::size_t first, std::size_t last) {
  refined_.run.assign(1, work_.at.point);
  for (std::size_t i = first; i <= last; ++i) refined_.run.push_back(work_.now.chunk->point(i));
  refined_.inserted.clear();
  refined_.reports.clear();
  const bool leaves_room = work_.course.has_meter();
  refined_.cuts.refine_run(refined_.run,
                           leaves_room ? bend_.span_tolerance() : work_.modes.tolerances.cutting(),
                           refined_.inserted, refined_.reports);
  for (const path::SegmentReport& report : refined_.reports) note(report);
  // Pieces that pass programmed points are on more than one segment.
  work_.course.leave_segment();
  for (std::size_t i = 1; i < refined_.inserted.size(); ++i) {
    if (!work_.posting.options.nonlinear.thin && !refined_.inserted[i - 1].inserted) {
      const auto end =
          std::find_if(refined_.inserted.begin() + static_cast<std::ptrdiff_t>(i), refined_.inserted.end(),
                       [](const path::Point& p) { return !p.inserted; });
      blocks_.begin_segment(refined_.inserted[i - 1], *end);
    }
    if (auto done = blocks_.cut_to(refined_.inserted[i], work_.now.chunk->words_at(first).feed,
                                   refined_.inserted[i].where, 0);
        !done)
      return done;
    work_.at.point = refined_.inserted[i];
  }
  return {};
}

Result<bool> SegmentMaker::reconfigure(const path::ChosenPoint& next, const ChunkMotion& motion) {
  path::ChoiceOptions options;
  options.inverse = work_.now.chunk->inverse;
  options.tool_mm = work_.tool.tool.vector();
  options.axis_tolerance = work_.modes.tolerances.cutting().axis_room();
  const path::Point to = path::point_at(motion.point, next.q);
  const auto turns = path::plan_turns(work_.posting.machine, work_.at.point, to, options);
  if (!turns) {
    return fail(
        ErrorCode::check_failed,
        "from line " + std::to_string(work_.at.point.where.line) + " to here: at " + turns.error().message,
        work_.posting.job.cl_file, motion.point.where);
  }
  for (const path::TurnAway& turn : *turns) {
    if (turn.share > 0.0) {
      path::ChoicePoint there = motion.point;
      there.pose = turn.pose;
      if (auto done = make(work_.rounded(there, turn.before), motion, nullptr); !done)
        return tl::unexpected(done.error());
      if (turn.share >= 1.0) {
        // If a rapid follows, or nothing, there is no need for it.
        work_.at.turn_due = next.q_leave;
        return true;
      }
      ++work_.posting.report.points_inserted;
    }
    if (auto done = turns_.turn_away(turn.after, motion); !done) return tl::unexpected(done.error());
  }
  return false;
}

}  // namespace trunnion::post
