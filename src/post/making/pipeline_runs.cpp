#include <algorithm>
#include <limits>
#include <variant>

#include "post/making/pipeline.hpp"

namespace trunnion::post {

Result<void> Pipeline::emit_run() {
  const auto& motions = now_.chunk->motions;
  const auto& events = now_.chunk->events;
  const auto& chosen = now_.chunk->chosen;
  std::size_t event = 0;
  for (std::size_t i = 0; i <= motions.size(); ++i) {
    now_.motion = i;
    for (; event < events.size() && events[event].before == i; ++event) {
      if (const auto* begin = std::get_if<cl::ShapeBegin>(&events[event].record.data)) {
        const auto taken = emit_shape(*begin->shape, i);
        if (!taken) return tl::unexpected(taken.error());
        if (!*taken) continue;
        // Nothing but the dwell of a hole stands between its motions.
        i += begin->shape->motions;
        while (event + 1 < events.size() && events[event + 1].before < i) ++event;
        continue;
      }
      if (auto done = emit_event(events[event].record); !done) return done;
    }
    if (i == motions.size()) break;
    const Pending& motion = motions[i];
    if (auto done = spindle_.resume(); !done) return done;
    if (!motion.point.rapid) spindle_.warn_before_cut(motion.point.where);
    if (at_.returns) {
      if (auto done = emit_return(motion); !done) return done;
    }
    if (auto done = emit_waiting_turn(motion); !done) return done;
    if (!cutter_.is_idle()) {
      if (auto done = check_compensated(i); !done) return done;
    }
    if (chosen[i].reconfigure && !at_.approaches) {
      const auto there = emit_reconfiguration(chosen[i], motion);
      if (!there) return tl::unexpected(there.error());
      if (*there) continue;
    }
    if (const std::size_t last = cutting_run_end(i, event); last > i) {
      if (auto done = emit_cutting_run(i, last); !done) return done;
      i = last;
      continue;
    }
    const PreparedSegment* const segment = prepared(i);
    if (segment != nullptr && is_plain()) {
      const std::size_t end = event < events.size() ? events[event].before : motions.size();
      const auto next = emit_plain(i, end);
      if (!next) return tl::unexpected(next.error());
      if (*next > i) {
        i = *next - 1;
        continue;
      }
    }
    if (auto done = emit_segment(now_.chunk->point(i), motion, segment); !done) return done;
    if (chosen[i].q_leave == chosen[i].q) continue;
    if (auto done = emit_segment(rounded(motion.point, chosen[i].q_leave), motion, nullptr); !done)
      return done;
  }
  return {};
}

const PreparedSegment* Pipeline::prepared(std::size_t i) const {
  const PreparedSegment& segment = now_.chunk->segments[i];
  if (!segment.known()) return nullptr;
  const path::Tolerance& now = modes_.tolerances.cutting();
  const path::Tolerance& then = now_.chunk->tolerance_at(i);
  if (then.tip_mm != now.tip_mm || then.axis != now.axis || then.flute.length_mm != now.flute.length_mm ||
      then.flute.off_mm != now.flute.off_mm)
    return nullptr;
  const auto begins_at = [&](const JointVector& q, const Vec3& tip_P, const Vec3& axis_P) {
    return at_.point.q == q && at_.point.tip_P == tip_P && at_.point.axis_P == axis_P;
  };
  if (i == 0) {
    const path::Point& from = now_.chunk->before;
    return begins_at(from.q, from.tip_P, from.axis_P) ? &segment : nullptr;
  }
  const ToolPose& from = now_.chunk->motions[i - 1].point.pose;
  return begins_at(now_.chunk->joints[i - 1], from.tip_P, from.axis_P) ? &segment : nullptr;
}

Result<void> Pipeline::emit_segment(const path::Point& to, const Pending& motion,
                                    const PreparedSegment* prepared) {
  if (motion.point.rapid || at_.approaches || !at_.known) {
    if (thermal_.prepare_shift(to.q)) at_.approaches = true;
  } else if (thermal_.waits()) {
    posting_.diagnostics.warning_once(
        "shift in cut", posting_.job.cl_file, motion.point.where,
        "operation '" + thermal_.operation() +
            "' begins in the cut: its shift of the work offset waits for the next rapid");
  }
  if (at_.approaches || !at_.known) {
    at_.approaches = false;
    tool_.check_own_length(posting_);
    auto done = emit_approach(to, motion);
    at_.known = true;
    return done;
  }
  if (motion.feed.mode == cl::FeedMode::inverse && !motion.point.rapid) {
    // The time is that of the whole segment: its pieces share one rate.
    Pending at_rate = motion;
    const auto rate = feed_rate(motion.feed, (to.tip_P - at_.point.tip_P).norm(), motion.point.where);
    if (!rate) return tl::unexpected(rate.error());
    at_rate.feed = {cl::FeedMode::per_minute, *rate};
    // Where the tip stands there is no rate of its: the rotary axes take the time.
    constexpr double kStands_mm = 1e-6;
    constexpr double kSameAxis = 1e-9;
    const bool in_place = (to.tip_P - at_.point.tip_P).norm() < kStands_mm;
    if (!in_place || (to.axis_P - at_.point.axis_P).norm() < kSameAxis)
      return emit_segment(to, at_rate, prepared);
    double turn_rad = 0.0;
    for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
      if (posting_.machine.axes[id].kind == AxisKind::rotary)
        turn_rad = std::max(turn_rad, std::abs(to.q[id] - at_.point.q[id]));
    }
    planner_.limit_turn(turn_rad * motion.feed.value);
    auto done = emit_segment(to, at_rate, prepared);
    planner_.limit_turn(std::numeric_limits<double>::infinity());
    return done;
  }
  begin_segment(at_.point, to);
  if (prepared != nullptr) {
    if (prepared->report >= 0) note(now_.chunk->reports[static_cast<std::size_t>(prepared->report)]);
    for (const path::Point& point : now_.chunk->inserted_in(*prepared)) {
      if (auto done = emit_to(point, motion); !done) return done;
    }
    return emit_to(to, motion);
  }
  const bool rapid = motion.point.rapid;
  refined_.inserted.clear();
  if (rapid) {
    const bool stays =
        !rewinds(to, to.q) &&
        refined_.rapids.decide(at_.point, to, modes_.tolerances.rapid(), 0.0, refined_.inserted).converged;
    if (!stays) {
      auto done = emit_rapid_above(to);
      at_.point = to;
      return done;
    }
  } else {
    note(refined_.cuts.decide(at_.point, to, modes_.tolerances.cutting(), 0.0, refined_.inserted));
  }
  for (const path::Point& point : refined_.inserted) {
    if (auto done = emit_to(point, motion); !done) return done;
  }
  return emit_to(to, motion);
}

void Pipeline::begin_segment(const path::Point& from, const path::Point& to) {
  const auto target = [](const path::Point& p) { return Target{p.tip_P, p.axis_P, p.where.line, false}; };
  course_.begin_segment(target(from), target(to), tool_.tool.flute_mm);
}

Result<void> Pipeline::emit_to(const path::Point& point, const Pending& motion) {
  auto done = motion.point.rapid ? emit_rapid(point) : emit_feed(point, motion.feed, motion.point.where, 0);
  at_.point = point;
  return done;
}

void Pipeline::note(const path::SegmentReport& r) {
  posting_.report.points_inserted += r.inserted;
  if (r.inserted > 0) ++posting_.report.segments_with_points;
  if (!r.converged) ++posting_.report.segments_not_converged;
  posting_.report.worst_predicted_mm = std::max(posting_.report.worst_predicted_mm, r.predicted_mm);
  posting_.report.worst_programmed_mm = std::max(posting_.report.worst_programmed_mm, r.midpoint_mm);
}

std::size_t Pipeline::cutting_run_end(std::size_t first, std::size_t event) const {
  const auto& motions = now_.chunk->motions;
  const auto& events = now_.chunk->events;
  const auto& chosen = now_.chunk->chosen;
  if (!posting_.options.nonlinear.thin && !posting_.options.nonlinear.move_programmed_points) return first;
  const auto cuts = [&](std::size_t i) {
    // An inverse time is that of one motion: what passes several has none.
    return !motions[i].point.rapid && chosen[i].q_leave == chosen[i].q &&
           motions[i].feed.mode != cl::FeedMode::inverse;
  };
  if (at_.approaches || !at_.known || !cuts(first)) return first;
  std::size_t last = first;
  while (last + 1 < motions.size() && cuts(last + 1) && !chosen[last + 1].reconfigure &&
         motions[last + 1].feed == motions[first].feed &&
         (event >= events.size() || events[event].before > last + 1)) {
    ++last;
  }
  return last;
}

Result<void> Pipeline::emit_cutting_run(std::size_t first, std::size_t last) {
  refined_.run.assign(1, at_.point);
  for (std::size_t i = first; i <= last; ++i) refined_.run.push_back(now_.chunk->point(i));
  refined_.inserted.clear();
  refined_.reports.clear();
  const bool leaves_room = course_.has_meter();
  refined_.cuts.refine_run(refined_.run, leaves_room ? span_tolerance() : modes_.tolerances.cutting(),
                           refined_.inserted, refined_.reports);
  for (const path::SegmentReport& report : refined_.reports) note(report);
  // Pieces that pass programmed points are on more than one segment.
  course_.leave_segment();
  for (std::size_t i = 1; i < refined_.inserted.size(); ++i) {
    if (!posting_.options.nonlinear.thin && !refined_.inserted[i - 1].inserted) {
      const auto end =
          std::find_if(refined_.inserted.begin() + static_cast<std::ptrdiff_t>(i), refined_.inserted.end(),
                       [](const path::Point& p) { return !p.inserted; });
      begin_segment(refined_.inserted[i - 1], *end);
    }
    if (auto done =
            emit_feed(refined_.inserted[i], now_.chunk->motions[first].feed, refined_.inserted[i].where, 0);
        !done)
      return done;
    at_.point = refined_.inserted[i];
  }
  return {};
}

}  // namespace trunnion::post
