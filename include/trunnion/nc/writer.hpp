#pragma once
#include <cstddef>
#include <memory>
#include <string>

#include "trunnion/base/result.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::nc {

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

  /// Lines written so far, all kinds.
  std::size_t lines() const;
  /// Motion blocks written so far.
  std::size_t motions() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trunnion::nc
