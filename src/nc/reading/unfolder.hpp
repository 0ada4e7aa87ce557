#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/nc/controller.hpp"

#include "nc/reading/value_words.hpp"

namespace trunnion::nc {

/// The lines of a program that somebody else wrote in the order in which the control runs them, variables as
/// their values: subprograms within the text (M98, LBL, O words of LinuxCNC) and loops are unfolded. Lines
/// come out at once until one of these words is met; from there on the text is kept until its end.
class Unfolder {
 public:
  using Sink = std::function<bool(std::string_view text, std::uint32_t line)>;  // false: the program ended
  using Fault = std::function<void(std::uint32_t line, const std::string& message)>;
  /// `controller` must outlive the object. The first fault ends the program.
  Unfolder(const Controller& controller, Sink sink, Fault fault);

  /// Any piece of the text, in order.
  void feed(std::string_view text);
  /// The text is complete.
  void finish();
  /// Behind `finish`: runs the next line that was kept. False at the end.
  bool step();

 private:
  struct Frame {
    std::size_t back = 0;   // line behind the call
    std::size_t begin = 0;  // of the subprogram
    std::int64_t more = 0;  // times that it runs again
    bool has_variables = false;
    std::size_t loops = 0;  // that were open at the call
  };
  struct Loop {
    std::size_t begin = 0;
    std::string label;
    std::int64_t more = 0;
  };
  struct OWord {
    std::string label, keyword;
    const char* rest = nullptr;
  };

  void take_line(std::string_view text);
  bool folds(std::string_view text) const;
  bool is_behind_all(std::string_view text) const;
  void put(std::string_view text, std::uint32_t line);
  void run(std::string_view text, std::uint32_t line);
  bool run_flow(const std::string& text);
  bool run_o_word(const std::string& text);
  /// A loop or a part of this label is what began last.
  bool is_open(const std::string& label) const;
  bool run_if(const OWord& word, const std::string& name);
  bool run_labels(const std::string& text);
  bool run_call(const std::string& text);
  bool parse_o_word(const std::string& text, OWord& out) const;
  bool call(std::size_t to, std::int64_t times, bool has_variables);
  void leave();
  /// The line behind the matching word of the same label, from `from` on; none: the end.
  std::size_t behind(const std::string& label, const std::vector<std::string>& keywords,
                     std::size_t from) const;
  std::size_t find_program(std::int64_t number, char letter) const;
  std::size_t find_label(const std::string& name) const;
  /// True: the line was taken.
  bool fail(const std::string& message);
  void note_number(std::string_view text);

  const Controller& c_;
  Sink sink_;
  Fault fault_;
  ValueWords values_;
  std::string carry_;
  std::vector<std::string> kept_;
  std::vector<bool> numbers_;                // N of lines that are not kept, where lines are called by them
  std::uint32_t first_kept_ = 0, line_ = 0;  // lines of the text
  std::size_t next_ = 0;                     // of kept_
  std::vector<Frame> frames_;
  std::vector<Loop> loops_;
  std::uint64_t ran_ = 0;
  bool over_ = false;  // ended, or at fault
};

}  // namespace trunnion::nc
