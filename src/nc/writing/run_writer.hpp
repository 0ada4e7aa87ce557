#pragma once
#include <span>

#include "nc/writing/write_state.hpp"

namespace trunnion::nc {

/// Runs of feed motions: nearly all of a program.
class RunWriter {
 public:
  explicit RunWriter(WriteState& state) : s_(state) {}

  /// A motion is nothing but its words: all of them known, the same motion word and feed mode as before.
  bool takes(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const;
  /// As Writer::write_run.
  std::size_t write(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode,
                    std::span<const RunBlock> blocks);

 private:
  struct Run;
  Run begin(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const;
  std::size_t put_together(Run& run, std::span<const RunBlock> blocks);

  WriteState& s_;
};

}  // namespace trunnion::nc
