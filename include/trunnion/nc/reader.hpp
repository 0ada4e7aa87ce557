#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/nc/motion_run.hpp"

namespace trunnion::nc {

struct ReaderOptions {
  /// Lines (without block number) that come out as Raw instead of being understood.
  std::vector<std::string> raw_lines;
  /// The text is a whole program, as a control runs it from its first line: what no word has said is not
  /// known, all words of [program] setup must stand before the first motion, all lines of a template
  /// together, and nothing of what ends a program, or begins one, in the middle of it.
  bool whole_program = false;
  /// A program that somebody else wrote: the words of [input] are read, too, `%` may stand at both ends, and
  /// nothing behind its end counts. Not with `whole_program`.
  bool others = false;
  /// Unit of a program that says none, with `others`; nothing: mm, with a warning.
  std::optional<bool> inches;
};

/// NC text -> the blocks that the control will run, with the modal state resolved.
///
/// Takes what the Writer writes with the same controller, and what people make of it: blanks, lower case,
/// missing block numbers, comments, words in any order, no blanks at all. A word that is not understood is an
/// error with file:line:column: a verification must not guess. Blocks that repeat what is already so (M9
/// while no coolant runs) do not come out.
class Reader {
 public:
  using Sink = std::function<void(const Block&)>;
  using RunSink = std::function<void(const MotionRun&)>;
  /// `controller` and `diagnostics` must outlive the reader; `file` is for messages.
  Reader(const Controller& controller, std::string file, Diagnostics& diagnostics, Sink sink,
         ReaderOptions options = {});
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader();

  /// Before the text: `runs` takes motions that need not come one by one, in their place among the blocks.
  /// Otherwise all come as blocks.
  void give_runs_to(RunSink runs);
  /// Any piece of the text, in order; pieces may end anywhere.
  void feed(std::string_view text);
  /// The line that is read or was read last, from 1 on.
  std::uint32_t line() const;
  /// Reads the last line. Fails with the first error when there was one.
  Result<void> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// All blocks of a text.
Result<std::vector<Block>> read_program(const Controller& controller, std::string_view text,
                                        const std::string& file, Diagnostics& diagnostics,
                                        const ReaderOptions& options = {});

}  // namespace trunnion::nc
