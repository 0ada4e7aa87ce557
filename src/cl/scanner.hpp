#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/cl/reader.hpp"

#include "cl/findings.hpp"
#include "cl/goto_layout.hpp"
#include "cl/statement.hpp"

namespace trunnion::cl {

/// Cuts CL text into statements: blanks and tabs anywhere, `$` continuation, `$$` comments, CR LF, no final
/// newline, quoted strings, words that keep the rest of their line as text. Memory is one buffer and the
/// statement at hand.
class Scanner {
 public:
  Scanner(std::unique_ptr<TextSource> source, Findings& findings);

  /// The next statement; false at the end. The views in it hold until the next call.
  bool next(Statement& statement);

  /// Reads a GOTO of 3 or 6 plain numbers (digits, point, sign; also continued by `$`); false, with nothing
  /// consumed, for anything else, however right or wrong: `next` is the judge of that.
  bool plain_goto(PlainGoto& out);
  /// Puts the last plain_goto back, so that `next` reads it again.
  void unread_goto();
  /// Reads GOTOs of six numbers, one behind the other, that are laid out as plain ones before them: their
  /// numbers and places into `cuts`, as they stand; how many there are.
  std::size_t plain_run(std::span<PlainCut> cuts);
  /// Puts the last `count` of them back.
  void unread_run(std::size_t count);

  /// The next physical line as it stands; false at the end.
  bool line(std::string_view& text) { return physical_line(text); }
  std::uint32_t line_number() const { return line_; }
  std::size_t line_count() const { return line_; }
  /// What went wrong below the text: the read itself.
  const std::optional<Error>& read_failure() const { return read_failure_; }
  /// The text has ended in a line of numbers, a GOTO or what continues one, without a newline, as where it
  /// was cut: the last of them. Else empty.
  std::string_view last_number() const;
  /// Nothing more is read.
  void stop() { stopped_ = true; }

 private:
  bool refill();
  bool physical_line(std::string_view& line);
  void unread_line(std::string_view line);
  bool check_text(std::string_view line);
  bool text_word(std::string_view line, std::size_t begin, Statement& statement);
  bool assemble(std::string_view line, std::size_t begin, Statement& statement);
  bool compact(std::string_view line, std::size_t begin);
  void split(Statement& statement);
  void append_field(std::size_t begin, std::size_t end, Statement& statement);
  void fatal(SourceRef where, const std::string& message);

  std::unique_ptr<TextSource> source_;
  Findings& findings_;
  std::unique_ptr<char[]> buffer_;  // only what is read into it is touched
  std::size_t cursor_ = 0;          // in buffer_
  std::size_t end_ = 0;             // in buffer_; buffer_[end_] is 0
  bool source_ended_ = false;
  std::optional<Error> read_failure_;
  bool stopped_ = false;
  std::uint32_t line_ = 0;  // number of the physical line read last
  std::size_t goto_cursor_ = 0;
  std::uint32_t goto_line_ = 0;
  GotoLayout layout_;
  std::size_t last_length_ = 0;  // of the last plain GOTO of six numbers on one line

  /// The statement at hand, upper case, no blanks.
  struct Compacted {
    std::string text;
    std::vector<SourceRef> places;  // of each character
    std::vector<char> after_blank;  // 1 where a blank stood before the character
    bool in_quotes = false;
  };
  Compacted compacted_;
};

}  // namespace trunnion::cl
