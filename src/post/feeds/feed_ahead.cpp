#include "post/feeds/feed_ahead.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "trunnion/post/plan_of_control.hpp"

namespace trunnion::post {
namespace {

bool stands_still_at(const cl::Record& record) {
  return std::holds_alternative<cl::Dwell>(record.data) || std::holds_alternative<cl::Stop>(record.data) ||
         std::holds_alternative<cl::ToolChange>(record.data);
}

// Under tool-centre-point control axes turn at no even rate on the way of a block. Where programmed points
// are dropped or moved, words led, or errors and offsets compensated, the blocks are known when they are
// made.
bool may_plan(const PostJob& job, const PostOptions& options) {
  return options.feeds_within_reach && job.model == nullptr && job.lag_s == JointVector() &&
         job.offsets == nullptr && !options.rtcp && !options.nonlinear.thin &&
         !options.nonlinear.move_programmed_points;
}

}  // namespace

FeedAhead::FeedAhead(const PostJob& job, const PostOptions& options)
    : options_(options),
      plan_(may_plan(job, options)
                ? plan_of_control(*job.machine, *job.controller, options.smoothing_mm, PlanOf::paces)
                : std::nullopt),
      rates_(*job.machine) {}

void FeedAhead::change(Chunk& chunk) {
  paces_.clear();
  if (!chunk.failure) add(chunk);
  settle();
  std::rotate(held_.begin(), held_.begin() + 1, held_.end());
  std::swap(held_.back().chunk, chunk);
  std::swap(held_.back().paces, paces_);
}

Chunk FeedAhead::take_left() {
  settle();
  std::rotate(held_.begin(), held_.begin() + 1, held_.end());
  held_.back().paces.clear();
  return std::exchange(held_.back().chunk, {});
}

void FeedAhead::settle() {
  const std::vector<double*>& paces = held_.front().paces;
  runs_.clear();
  plan_->settle(paces.size(), runs_);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (paces[i] != nullptr) *paces[i] = runs_[i].pace;
  }
}

void FeedAhead::add(Chunk& chunk) {
  chunk.paces.assign(chunk.size(), 1.0);
  std::size_t event = 0;
  for (std::size_t i = 0; i <= chunk.size(); ++i) {
    for (; event < chunk.events.size() && chunk.events[event].before == i; ++event) {
      const nc::Spindle turned = asked_.now().spindle;
      asked_.take(chunk.events[event].record);
      const double rotary_rad_s = asked_.now().rotary_rad_s;
      rates_.limit_rotary(rotary_rad_s > 0.0 ? rotary_rad_s : std::numeric_limits<double>::infinity());
      // The speed that the spindle has already is not said again.
      if (stands_still_at(chunk.events[event].record) || !(asked_.now().spindle == turned)) plan_->stop();
    }
    if (i == chunk.size()) break;
    const ChunkMotion motion = chunk.motion(i);
    // Where the tool leaves the part to turn is found when the motion is made.
    const bool turns_away = chunk.chosen[i].reconfigure || turns_behind_;
    if (motion.point.rapid)
      plan_->rest();
    else if (turns_away)
      plan_->lose();
    else if (i > 0 || chunk.has_before)
      add_motion(chunk, i);
    turns_behind_ = !(chunk.chosen[i].q_leave == chunk.chosen[i].q);
  }
}

void FeedAhead::add_motion(Chunk& chunk, std::size_t i) {
  const auto end_of = [&](std::size_t k) { return Stop{&chunk.joints[k], &chunk.points[k].pose.tip_P}; };
  Stop from = i > 0 ? end_of(i - 1) : Stop{&chunk.before.q, &chunk.before.tip_P};
  const Stop to = end_of(i);
  const cl::Feed& feed = chunk.words_at(i).feed;
  // FEDRAT/INVERS says how long a motion takes: that stays.
  const bool is_timed = feed.mode == cl::FeedMode::inverse;
  const double rate = is_timed ? feed.value * (*to.tip_P - *from.tip_P).norm() : rate_mm_s(feed);
  const auto go_on = [&](const Stop& stop, double& pace) {
    add_block(from, stop, rate, is_timed ? nullptr : &pace);
    from = stop;
  };
  const PreparedSegment& segment = chunk.segments[i];
  for (std::size_t k = 0; k < chunk.inserted_in(segment).size(); ++k) {
    path::Point& point = chunk.inserted[segment.first + k];
    go_on({&point.q, &point.tip_P}, point.pace);
  }
  go_on(to, chunk.paces[i]);
}

void FeedAhead::add_block(const Stop& from, const Stop& to, double feed_mm_s, double* pace) {
  const double tip_mm = (*to.tip_P - *from.tip_P).norm();
  const double seconds = std::max(tip_mm > 0.0 && feed_mm_s > 0.0 ? tip_mm / feed_mm_s : 0.0,
                                  rates_.slowest_axis_s(*from.q, *to.q));
  if (!(seconds > 0.0)) return;
  plan_->add({*from.q, *to.q, seconds});
  paces_.push_back(pace);
}

double FeedAhead::rate_mm_s(const cl::Feed& feed) const {
  switch (feed.mode) {
    case cl::FeedMode::per_revolution:
      return feed.value * asked_.now().rpm / kSecondsPerMinute;
    case cl::FeedMode::none:
      return options_.default_feed_mm_s;
    default:
      return feed.value;
  }
}

}  // namespace trunnion::post
