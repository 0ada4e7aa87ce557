#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "trunnion/base/lanes.hpp"
#include "trunnion/nc/motion_run.hpp"

namespace trunnion::nc {

/// The line of a run that was read last.
inline constexpr std::size_t kRunWords = kAxisLetters + 1;
struct RunLine {
  std::size_t count = 0;  // of its words; 0: no pattern for others
  std::array<char, kRunWords> letter{};
  std::array<AxisLetter, kRunWords> axis{};
  std::array<std::int32_t, kRunWords> value{};
  std::array<std::int8_t, kRunWords> decimals{};  // of its quanta
  std::size_t feed_at = kRunWords;                // of the words; behind all: none
  std::int64_t feed = 0;
  std::uint16_t mask = 0;
};

/// How the characters of a line of a run are placed behind its block number: in most programs many lines that
/// follow one another have their letters, signs, points and end where the others have them. These are checked
/// and read as a whole, 32 characters and all numbers at a time, where the processor has AVX2.
class RunLayout {
 public:
  /// So many characters from the beginning of a line on can be read, whatever is in them.
  static constexpr std::size_t kReads = 96;

  /// Places of the digits among the first characters of a line, a bit each.
  TRUNNION_FOUR static std::uint64_t digits_at(const char* line);
  /// Takes over the layout of the line at `line`, behind its block number, that was read as these words and
  /// ends before `behind`; kReads characters can be read. False, and none is known then, where it has none: a
  /// line that is too wide, or with more than six words, F in front, a word of more than eight digits (F:
  /// nine), with fewer decimals than its quanta or with a `+`.
  bool learn(const char* line, const char* behind, const RunLine& words);
  /// A line with digits at these places may have it.
  bool may_be(std::uint64_t digits) const { return length_ > 0 && (digits & within_) == digits_; }
  /// Axes that have words.
  std::uint16_t mask() const { return mask_; }
  bool has_feed() const { return feed_at_ < kWords; }
  /// Reads lines of this layout from `p` on as the next ones of `run`, as far as they end before `end` by
  /// kReads: the columns of the axes that have words, that of F where it has one, and those of the source,
  /// counted on from `line`. They may begin with a block number behind `prefix` (none: 0). The same values as
  /// read word by word; lines of any other layout, with F0 or with a number of more than eight digits are
  /// left alone. Gives where the line behind the last one begins.
  const char* read(const char* p, const char* end, char prefix, std::uint32_t& line, MotionRun& run) const;

 private:
  static constexpr std::size_t kWidest = 64;
  static constexpr std::size_t kWords = 6;
  // A number: its first digit, its point, and where it ends.
  struct Field {
    std::size_t first, point, end;
    std::size_t digits() const { return end - first - 1; }
  };

  bool take_fields(const char* line, std::size_t length, const RunLine& words,
                   std::array<Field, kWords>& fields) const;
  void take_digits(std::size_t word, const Field& field, bool negative);
  TRUNNION_FOUR const char* read_lines(const char* p, const char* end, char prefix, std::uint32_t line,
                                       MotionRun& run) const;

  std::size_t length_ = 0;  // with the newline; 0: none is known
  std::uint16_t mask_ = 0;
  std::size_t count_ = 0;
  std::size_t feed_at_ = kWords;
  std::array<AxisLetter, kWords> axis_{};
  alignas(32) std::array<std::uint8_t, kWidest> text_{};  // of which all but the digits stand as they are
  std::uint64_t within_ = 0;                              // places of the line, a bit each
  std::uint64_t digits_ = 0;                              // of its digits
  // The digits of a word, the last eight, stand in the sixteen characters from here on.
  std::array<std::size_t, kWords> from_{};
  // Words 0 and 1, 2 and 3, 4 and 5: where in those sixteen the digits are.
  alignas(32) std::array<std::array<std::uint64_t, 4>, 3> digit_at_{};
  std::size_t ninth_at_ = 0;  // digit of F, the first one; 0: has none
  // All bits of a negative number, in the order in which they are calculated.
  alignas(32) std::array<std::int32_t, 8> sign_{};
};

}  // namespace trunnion::nc
