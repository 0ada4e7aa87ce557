#include "post/judging/block_trail.hpp"

#include <algorithm>

namespace trunnion::post {

void BlockTrail::clear() {
  each_column([](auto& column) { column.clear(); });
  others_.clear();
  marks_.clear();
}

BlockEnd BlockTrail::end(std::size_t i) const {
  const auto other = std::lower_bound(others_.begin(), others_.end(), i,
                                      [](const Other& o, std::size_t block) { return o.block < block; });
  if (other != others_.end() && other->block == i) return other->end;
  BlockEnd out;
  for (AxisId id = 0; id < kMaxAxes; ++id) out.q[id] = q_[id][i];
  out.nc_line = nc_line_[i];
  out.feed_mode = feed_mode_[i];
  out.feed = feed_[i];
  return out;
}

void BlockTrail::add(const BlockEnd& end) {
  others_.push_back({size(), end});
  each_column([](auto& column) { column.emplace_back(); });
}

void BlockTrail::add(const nc::MotionRun& run, const path::StationRun& stations, std::size_t first_row,
                     std::size_t last_row) {
  if (last_row < first_row) return;
  const std::size_t behind = size();
  const std::size_t count = last_row + 1 - first_row;
  each_column([&](auto& column) { column.resize(behind + count); });
  const auto first = static_cast<std::ptrdiff_t>(first_row);
  const auto last = static_cast<std::ptrdiff_t>(last_row + 1);
  const auto to = static_cast<std::ptrdiff_t>(behind);
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const auto& q = stations.of_axis(id);
    std::copy(q.begin() + first, q.begin() + last, q_[id].begin() + to);
  }
  std::copy(run.feed.begin() + first - 1, run.feed.begin() + last - 1, feed_.begin() + to);
  std::fill(feed_mode_.begin() + to, feed_mode_.end(), run.feed_mode);
  for (std::size_t i = 0; i < count; ++i) nc_line_[behind + i] = run.source[first_row - 1 + i].line;
}

void BlockTrail::shorten() {
  if (size() < 2 * kKept) return;
  while (marks_.size() > 1 && marks_[1].block + kKept <= size()) marks_.pop_front();
  const std::size_t gone = marks_.front().block;
  each_column([&](auto& column) {
    column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(gone));
  });
  while (!others_.empty() && others_.front().block < gone) others_.pop_front();
  for (Other& other : others_) other.block -= gone;
  for (TrailMark& mark : marks_) mark.block -= gone;
}

}  // namespace trunnion::post
