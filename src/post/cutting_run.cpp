#include "post/pipeline.hpp"

namespace trunnion::post {

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
