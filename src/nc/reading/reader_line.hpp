#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "nc/control/patterns.hpp"
#include "nc/reading/lexer.hpp"

// One line of NC text taken apart: address words, events of phrases, comments. Knows words, not their effect.
namespace trunnion::nc {

/// A letter with a number.
struct Word {
  /// What the number is, whatever is in force.
  enum class Means : std::uint8_t { as_in_force, place, way };
  char letter = ' ';
  bool used = false;
  bool modulo = false;   // written as [rotary] modulo_word
  bool by_name = false;  // R, written as [input] radius_name
  Means means = Means::as_in_force;
  std::uint32_t column = 0;
  std::uint32_t length = 0;  // of its text
  Number number;
};

/// Letters of words that have a name: turns of a helix, polar coordinates.
inline constexpr char kTurns = 't';

/// Values that the placeholders of a pattern stood for.
struct Captures {
  std::array<Number, kPlaceholders> number{};
  std::uint64_t mask = 0;
  std::string name;

  bool has(Placeholder p) const { return (mask & (std::uint64_t{1} << static_cast<unsigned>(p))) != 0; }
  const Number& operator[](Placeholder p) const { return number[static_cast<std::size_t>(p)]; }
  void set(Placeholder p, const Number& value) {
    number[static_cast<std::size_t>(p)] = value;
    mask |= std::uint64_t{1} << static_cast<unsigned>(p);
  }
};

struct FoundEvent {
  Event event;
  Captures captures;
  std::uint32_t column = 0;
  const Pattern* pattern = nullptr;
};

/// No line that a person or a post-processor writes has more address words.
inline constexpr std::size_t kMaxWords = 48;

struct ParsedLine {
  const char* begin = nullptr;  // the line, for messages
  std::array<Word, kMaxWords> words;
  std::size_t word_count = 0;
  std::vector<FoundEvent> phrases;
  /// Of words that are expressions: coefficients of the run-time values for X, Y and Z.
  std::array<std::array<std::int64_t, 3>, 3> coefficient{};
  bool has_values = false;
  bool past_offsets = false;  // its places are those of the machine, as a name in the line has it
  std::vector<std::string> comments;
  std::uint32_t error_column = 0;
  std::string error;  // empty: understood so far

  void clear() {
    word_count = 0;
    if (has_values) coefficient = {};
    has_values = false;
    past_offsets = false;
    phrases.clear();
    comments.clear();
    error.clear();
  }
};

/// Takes lines apart by the rules of one controller.
class LineScanner {
 public:
  /// Both must outlive the scanner. `others`: the spellings of [input] are read.
  LineScanner(const Controller& controller, const PatternSet& patterns, bool others);

  /// Position behind the block number (and the blanks around it).
  const char* skip_block_number(const char* p, const char* end) const;
  /// Something else than an address word may begin with this capital letter.
  bool begins_other(char letter) const {
    return letter_begins_phrase_[static_cast<std::size_t>(letter - '@') & 31U];
  }
  /// `begin` is the start of the line (for columns), [p, end) what is to be read.
  void scan(const char* begin, const char* p, const char* end, ParsedLine& out) const;

 private:
  bool scan_word(const char* begin, const char*& p, const char* end, ParsedLine& out) const;
  bool scan_modulo_word(const char* begin, const char*& p, const char* end, ParsedLine& out) const;
  bool scan_word_of_others(const char* begin, const char*& p, const char* end, ParsedLine& out) const;
  bool scan_assigned(const char*& p, const char* end, Word& word) const;
  bool scan_expression(const char* begin, const char*& p, const char* end, ParsedLine& out) const;
  bool scan_term(const char*& p, const char* end, std::array<std::int64_t, 3>& coefficient) const;
  bool scan_comment(const char*& p, const char* end, ParsedLine& out) const;
  bool scan_phrase(const char*& p, const char* end, FoundEvent& out) const;
  const Controller& c_;
  const PatternSet& patterns_;
  bool has_expressions_;  // X[12.3-#511*0.5]
  bool others_;
  bool active_comments_ = false;                 // some phrase begins as a comment does: (PROBEOPEN name)
  std::array<bool, 32> letter_begins_phrase_{};  // Q of `Q339=`: by letter
};

}  // namespace trunnion::nc
