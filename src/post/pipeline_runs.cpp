#include <algorithm>

#include "post/pipeline.hpp"

namespace trunnion::post {

Result<void> Pipeline::emit_run(const std::vector<path::ChosenPoint>& chosen) {
  std::size_t event = 0;
  for (std::size_t i = 0; i <= pending_.size(); ++i) {
    for (; event < events_.size() && events_[event].before == i; ++event) {
      if (auto done = emit_event(events_[event].record); !done) return done;
    }
    if (i == pending_.size()) break;
    const Pending& motion = pending_[i];
    if (chosen[i].reconfigure && !approach_) {
      if (auto done = emit_reconfiguration(chosen[i].q, motion); !done) return done;
    }
    if (const std::size_t last = cutting_run_end(i, event, chosen); last > i) {
      if (auto done = emit_cutting_run(i, last, chosen); !done) return done;
      i = last;
      continue;
    }
    if (auto done = emit_segment(rounded_point(motion.point, chosen[i].q), motion); !done) return done;
    if (chosen[i].q_leave == chosen[i].q) continue;
    if (auto done = emit_segment(rounded_point(motion.point, chosen[i].q_leave), motion); !done) return done;
  }
  return {};
}

path::Point Pipeline::rounded_point(const path::ChoicePoint& point, const JointVector& q) const {
  path::Point out;
  out.q = q;
  out.tip_P = point.pose.tip_P;
  out.axis_P = point.pose.axis_P;
  out.where = point.where;
  path::round_to_words(machine_, kinematics_, rounding_, out.tip_P, out.q);
  return out;
}

Result<void> Pipeline::emit_segment(const path::Point& to, const Pending& motion) {
  if (approach_ || !placed_) {
    approach_ = false;
    auto done = emit_approach(to, motion);
    placed_ = true;
    return done;
  }
  const bool rapid = motion.point.rapid;
  inserted_.clear();
  if (!rapid || rapid_tolerance_) {
    const path::SegmentReport r =
        refiner_.refine(last_, to, rapid ? *rapid_tolerance_ : tolerance_, inserted_);
    if (!rapid) note(r);
  }
  inserted_.push_back(to);
  for (const path::Point& point : inserted_) {
    if (auto done = rapid ? emit_rapid(point) : emit_feed(point, motion.feed, motion.point.where, 0); !done)
      return done;
    last_ = point;
  }
  return {};
}

void Pipeline::note(const path::SegmentReport& r) {
  report_.points_inserted += r.inserted;
  if (r.inserted > 0) ++report_.segments_with_points;
  if (!r.converged) ++report_.segments_not_converged;
  report_.worst_predicted_mm = std::max(report_.worst_predicted_mm, r.predicted_mm);
  report_.worst_programmed_mm = std::max(report_.worst_programmed_mm, r.midpoint_mm);
}

std::size_t Pipeline::cutting_run_end(std::size_t first, std::size_t event,
                                      const std::vector<path::ChosenPoint>& chosen) const {
  if (!options_.nonlinear.thin && !options_.nonlinear.move_programmed_points) return first;
  const auto cuts = [&](std::size_t i) {
    return !pending_[i].point.rapid && chosen[i].q_leave == chosen[i].q;
  };
  if (approach_ || !placed_ || !cuts(first)) return first;
  std::size_t last = first;
  while (last + 1 < pending_.size() && cuts(last + 1) && !chosen[last + 1].reconfigure &&
         pending_[last + 1].feed == pending_[first].feed &&
         (event >= events_.size() || events_[event].before > last + 1)) {
    ++last;
  }
  return last;
}

Result<void> Pipeline::emit_cutting_run(std::size_t first, std::size_t last,
                                        const std::vector<path::ChosenPoint>& chosen) {
  run_.assign(1, last_);
  for (std::size_t i = first; i <= last; ++i) run_.push_back(rounded_point(pending_[i].point, chosen[i].q));
  inserted_.clear();
  reports_.clear();
  refiner_.refine_run(run_, tolerance_, inserted_, reports_);
  for (const path::SegmentReport& report : reports_) note(report);
  for (std::size_t i = 1; i < inserted_.size(); ++i) {
    if (auto done = emit_feed(inserted_[i], pending_[first].feed, inserted_[i].where, 0); !done) return done;
    last_ = inserted_[i];
  }
  return {};
}

}  // namespace trunnion::post
