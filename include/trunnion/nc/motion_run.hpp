#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "trunnion/nc/blocks.hpp"

namespace trunnion::nc {

/// Feed moves that follow one another with nothing between them, nearly all of a program. A column for each
/// quantity, so that whoever evaluates them can look at several at a time. The same values as those of as
/// many blocks `Motion`, as they are read.
struct MotionRun {
  static constexpr std::size_t kMost = 256;
  template <class T>
  using Column = std::array<T, kMost>;

  FeedMode feed_mode = FeedMode::per_minute;
  std::uint16_t mask = 0;  // axes that are known at every end
  std::size_t count = 0;
  std::array<Column<std::int32_t>, kAxisLetters> quanta{};  // of the axes of `mask`
  Column<std::int64_t> feed{};
  Column<SourceRef> source{};

  Motion motion(std::size_t i) const {
    Motion out;
    out.kind = MotionKind::feed;
    out.feed_mode = feed_mode;
    out.feed = feed[i];
    for (const AxisLetter letter : kAllAxisLetters) {
      if ((mask & AxisWords::bit(letter)) != 0) out.words.set(letter, quanta[index(letter)][i]);
    }
    out.source = source[i];
    return out;
  }
};

}  // namespace trunnion::nc
