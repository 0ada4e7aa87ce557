#include "post/judging/reached_feeds.hpp"

#include <algorithm>
#include <utility>

namespace trunnion::post {
namespace {

constexpr std::size_t kBehind = 1024;  // blocks that are known behind one that is settled
constexpr double kNotReached = 1.03;

}  // namespace

ReachedFeeds::ReachedFeeds(MotionPlan plan, RunTimes& times) : plan_(std::move(plan)), times_(times) {
  times_.estimated_s = 0.0;
}

void ReachedFeeds::add(const Block& block, const std::optional<ProgramJudge::Slow>& slow) {
  if (!(block.seconds > 0.0)) return;
  // One that is slow is as fast as it may be: whether it could be is what is asked.
  const double asked_s = slow ? slow->asked_s : block.seconds;
  plan_.add({block.from, block.to, asked_s, block.apart});
  noted_.push_back({block.seconds, asked_s, std::max<std::int64_t>(block.feed, 1), block.apart, block.nc_line,
                    slow.has_value()});
  if (slow) slow_.push_back(*slow);
  if (plan_.waiting() >= 2 * kBehind) settle(kBehind);
}

void ReachedFeeds::wait(double seconds) {
  plan_.stop();
  *times_.estimated_s += seconds;
}

void ReachedFeeds::finish() {
  plan_.stop();
  settle(plan_.waiting());
}

void ReachedFeeds::settle(std::size_t count) {
  runs_.clear();
  plan_.settle(count, runs_);
  for (std::size_t i = 0; i < count; ++i) {
    const Noted& block = noted_[i];
    *times_.estimated_s += runs_[i].seconds;
    if (!block.slow && runs_[i].pace == 1.0) continue;  // as asked
    const double reached_s = block.asked_s / runs_[i].pace;
    if (block.slow) {
      if (judge_ != nullptr) judge_->judge_slow(slow_.front(), reached_s, block.nc_line);
      slow_.pop_front();
    }
    if (block.apart) continue;
    const double excess = reached_s / block.seconds;
    if (excess > times_.max_feed_excess) {
      times_.max_feed_excess = excess;
      times_.max_feed_excess_nc_line = block.nc_line;
    }
    if (excess <= kNotReached) continue;
    const double digit = 1.0 + 1.0 / static_cast<double>(block.feed);  // by which one more or less changes it
    if (excess > kNotReached * digit) ++times_.feeds_not_reached;
  }
  noted_.erase(noted_.begin(), noted_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace trunnion::post
