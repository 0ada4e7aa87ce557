#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "trunnion/base/result.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::nc {

/// A feed motion as it stands in a run of them: the words of five axes, and F.
struct RunBlock {
  static constexpr std::size_t kAxes = 5;
  std::array<std::int32_t, kAxes> words;  // quanta, in the order of their letters
  std::int32_t feed;                      // quanta
};

/// Blocks -> NC text in the words of one control.
///
/// Streaming: text is appended to `out`, which the caller may write away and clear between two calls. Modal
/// words are written when they change; no block is written that says nothing new; a number is a whole number
/// of quanta, so that there is no `-0.0000`. Failures (code wrong_input unless said otherwise): the control
/// has no words for the block, a feed move without feed, a value or a line beyond what the control takes.
class Writer {
 public:
  /// `controller` and `out` must outlive the writer.
  Writer(const Controller& controller, std::string& out);
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) = delete;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer();

  Result<void> write(const Motion& motion);
  Result<void> write(const Block& block);

  /// One axis moves by `distance` from where it stands, wherever that is, at a feed per minute: quanta of the
  /// axis' words and of F, F > 0. For programs that a person watches; the reader does not take its words.
  Result<void> step(AxisLetter axis, std::int64_t distance, std::int64_t feed);

  /// Writes the first of these motions of the axes with these letters, as many of them as leave nothing to be
  /// asked, and gives their number: the text is that of `write` for each. What is not written, `write` takes,
  /// or refuses. Letters in their order.
  std::size_t write_run(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode,
                        std::span<const RunBlock> blocks);
  /// As things are it would write any.
  bool takes_run(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const;

  /// Lines written so far, all kinds.
  std::size_t lines() const;
  /// Motion blocks written so far.
  std::size_t motions() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trunnion::nc
