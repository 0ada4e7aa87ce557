#pragma once
#include <utility>
#include <vector>

#include "trunnion/cl/reader.hpp"

namespace trunnion::post {

/// Records that are made several at a time and handed out one by one.
class QueuedRecords : public cl::RecordSource {
 public:
  bool next(cl::Record& record) final {
    if (is_at_end()) return false;
    record = std::move(queue_[next_++]);
    return true;
  }

  std::size_t next_cuts(std::span<cl::PlainCut> cuts, cl::Feed& feed) final {
    if (is_at_end()) return 0;
    std::size_t count = 0;
    for (; count < cuts.size() && next_ < queue_.size(); ++next_, ++count) {
      const auto* motion = std::get_if<cl::Motion>(&queue_[next_].data);
      if (motion == nullptr || motion->rapid || motion->step != cl::Motion::Step::none ||
          motion->part.share < 1.0 || (count > 0 && motion->feed != feed))
        break;
      feed = motion->feed;
      cuts[count] = {motion->tip_P, motion->axis_P, queue_[next_].where};
    }
    return count;
  }

 protected:
  QueuedRecords() = default;
  /// The next records into the empty `queue`, one or more; none at the end.
  virtual void refill(std::vector<cl::Record>& queue) = 0;

 private:
  bool is_at_end() {
    if (next_ < queue_.size()) return false;
    queue_.clear();
    next_ = 0;
    refill(queue_);
    return queue_.empty();
  }

  std::vector<cl::Record> queue_;
  std::size_t next_ = 0;
};

}  // namespace trunnion::post
