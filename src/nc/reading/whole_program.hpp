#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "trunnion/nc/controller.hpp"

#include "nc/control/patterns.hpp"

namespace trunnion::nc {

/// What must stand in a program for its lines to mean what their templates say: before the first motion all
/// words of [program] setup and those that end what an abort left on, and of each template of several lines
/// all of them, in its order. Messages are empty where nothing is wrong.
class WholeProgram {
 public:
  WholeProgram(const Controller& controller, const PatternSet& patterns);

  /// Before the first motion: a word, or a line that is none.
  void head(const std::string& key) {
    if (const auto it = setup_.find(key); it != setup_.end()) it->second.said = true;
  }
  bool is_head() const { return is_head_; }
  /// A line, or a word of one, that was understood.
  std::string take(const Pattern& pattern, std::uint32_t line);
  /// The line at hand moves the machine.
  std::string moves();
  /// The text has ended: the words that end tool-centre-point control, in a program that never asks for it,
  /// stop a control which knows no other kinematics.
  std::string ends() const;
  /// Where `ends` says something.
  std::uint32_t first_off_line() const { return first_off_line_; }
  /// Lines of a template are missing so far.
  bool is_open() const { return !open_.empty() || !expected_.empty(); }

 private:
  struct SetupWord {
    std::string text;
    bool said = false;
  };
  struct SaidLine {
    std::string key;
    std::uint32_t line;
  };
  static bool in_order(const std::vector<std::string>& keys, std::vector<SaidLine> said);
  std::string missing();

  const Controller& controller_;
  std::map<std::string, SetupWord> setup_;         // by key
  std::map<EventKind, std::string> ends_earlier_;  // not said so far: the word of each
  std::set<std::string> lines_;                    // keys of all lines beside the one that means an event
  std::vector<SaidLine> said_;                     // of those, since the last such one
  struct OpenLine {
    std::string key, place;
  };
  std::vector<OpenLine> open_;  // lines of templates whose last one has not come
  // Behind the last event: all lines of its template there, those that have not come, and those that have.
  std::vector<std::string> template_after_, expected_;
  std::vector<SaidLine> followed_;
  std::string expected_by_;
  std::uint32_t first_off_line_ = 0;  // of the words that end tool-centre-point control
  bool asks_for_tcp_ = false, is_head_ = true;
};

}  // namespace trunnion::nc
