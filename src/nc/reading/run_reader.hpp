#pragma once
#include <array>
#include <string_view>

#include "nc/reading/read_state.hpp"
#include "nc/reading/run_layout.hpp"

namespace trunnion::nc {

/// Lines that are motions in the form that nearly every line has and change no mode, read many at once.
class RunReader {
 public:
  RunReader(ReadState& state, Reader::RunSink sink);

  /// Reads lines from the start of `text` as a run, as far as they are such motions: how many characters they
  /// have.
  std::size_t read(std::string_view text);

 private:
  bool may_begin() const;
  /// The line from `p` on as the next of the run: where the one behind it begins; null, with nothing changed,
  /// for any other line. A line ends before `end`.
  const char* take_run_line(const char* p, const char* end);
  /// The same for a line that has the letters of the one before it, every number with four decimals.
  const char* take_same_words(const char* p, const char* end);
  /// The same for lines that are laid out as others before them: as many as follow.
  const char* take_laid_out(const char* p, const char* end);
  const char* take_of_layout(const RunLayout& layout, const char* p, const char* end);
  void learn_layout(const char* p, const char* behind, const char* end);
  const char* skip_run_number(const char* p) const;
  std::int64_t feed_of_silent_line() const;
  bool put_run_line(std::uint32_t column);
  bool unwrap_run_line();

  ReadState& s_;
  Reader::RunSink sink_;
  MotionRun run_;
  RunLine line_;
  bool four_decimals_ = false;  // in every word of it
  // Layouts of lines, in the feed mode of the run: the one that was met last, and the one that was learned
  // last. None where an axis is wound on from line to line.
  std::array<RunLayout, 8> layouts_;
  std::size_t last_ = 0, next_ = 0;
  bool has_layouts_;
};

}  // namespace trunnion::nc
