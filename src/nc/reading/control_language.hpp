#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "trunnion/nc/reader.hpp"

#include "nc/control/patterns.hpp"
#include "nc/reading/other_words.hpp"
#include "nc/reading/reader_line.hpp"

namespace trunnion::nc {

/// Codes and letters of the lines that nearly every program consists of.
struct SimpleWords {
  // G0 to G999.9 in tenths.
  static constexpr std::size_t kCodes = 10000;
  enum class Code : std::uint8_t { no, silent, absolute, rapid, linear, per_minute, inverse_time };
  /// What a letter begins in the lines that take_plain_motion reads.
  struct Letter {
    enum class Kind : std::uint8_t { other, axis, feed, code };
    Kind kind = Kind::other;
    AxisLetter axis = AxisLetter::X;
    std::int8_t decimals = 0;  // of the axis' quanta
  };

  /// What a G or M code means by itself; `no` for all other words.
  Code code(char letter, const Number& number) const {
    if (letter != 'G' && letter != 'M') return Code::no;
    const std::size_t at = place_of(number);
    return at == kCodes ? Code::no : (letter == 'G' ? g : m)[at];
  }
  static std::size_t place_of(const Number& number) {
    if (number.mantissa < 0 || number.decimals > 1) return kCodes;
    const auto tenths =
        static_cast<std::size_t>(number.decimals == 1 ? number.mantissa : 10 * number.mantissa);
    return std::min(tenths, kCodes);
  }

  std::array<Code, kCodes> g{};
  std::array<Code, kCodes> m{};
  std::array<std::uint8_t, 32> kept{};  // letter -> placeholder + 1 that later lines use
  std::array<Letter, 256> letters{};    // of each character
};

/// The words that a control understands, and how its numbers are read.
struct ControlLanguage {
  ControlLanguage(const Controller& c, const ReaderOptions& options, Diagnostics& diagnostics);
  ControlLanguage(const ControlLanguage&) = delete;  // the scanner refers to the patterns
  ControlLanguage& operator=(const ControlLanguage&) = delete;
  ~ControlLanguage() = default;

  AxisFormat format;
  std::int64_t turn;  // quanta of a rotary axis
  PatternSet patterns;
  LineScanner scanner;
  SimpleWords simple;
  std::optional<OtherWords> others;  // of programs that somebody else wrote

 private:
  void note_simple(const Pattern& p, bool whole_program);
  void note_plain_words(const Controller& c);
};

}  // namespace trunnion::nc
