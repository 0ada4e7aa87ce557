// The lines that make nearly all of a program: a motion, its words in capital letters.
#include <bit>
#include <cstring>

#include "nc/reader_state.hpp"

namespace trunnion::nc {
namespace {

// Digits at `p` up to the first character that is none.
inline const char* take_digits(const char* p, std::uint64_t& mantissa) {
  for (unsigned digit = 0; (digit = static_cast<unsigned>(*p) - '0') < 10; ++p)
    mantissa = 10 * mantissa + digit;
  return p;
}

// Four digits at once, where the next four characters are digits: most fractions are that long.
inline const char* take_four_digits(const char* p, const char* end, std::uint64_t& mantissa) {
  if constexpr (std::endian::native != std::endian::little) return p;
  if (end - p < 4) return p;
  std::uint32_t v = 0;
  std::memcpy(&v, p, sizeof(v));
  v ^= 0x30303030;  // of digits 0 to 9
  if ((((v + 0x76767676) | v) & 0x80808080) != 0) return p;
  v = (10 * v + (v >> 8)) & 0x00ff00ff;  // the first character is the lowest byte
  v = (100 * v + (v >> 16)) & 0xffff;
  mantissa = 10000 * mantissa + v;
  return p + 4;
}

// As scan_number, where a character behind the text ends it; null where there is none.
inline const char* take_number(const char* p, const char* end, Number& out) {
  const bool negative = *p == '-';
  p += negative || *p == '+' ? 1 : 0;
  std::uint64_t mantissa = 0;
  const char* const first = p;
  p = take_digits(p, mantissa);
  std::ptrdiff_t digits = p - first;
  out.decimals = 0;
  out.has_point = *p == '.';
  if (out.has_point) {
    const char* const fraction = ++p;
    p = take_digits(take_four_digits(p, end, mantissa), mantissa);
    out.decimals = static_cast<int>(p - fraction);
    digits += p - fraction;
  }
  if (digits == 0 || digits > kMaxDigits) return nullptr;
  const auto magnitude = static_cast<std::int64_t>(mantissa);
  out.mantissa = negative ? -magnitude : magnitude;
  return p;
}

}  // namespace

void Reader::State::note_plain_words() {
  using Kind = PlainWord::Kind;
  const auto note = [&](char letter, const PlainWord& word) {
    if (!scanner.begins_other(letter)) plain_words[static_cast<unsigned char>(letter)] = word;
  };
  for (const AxisLetter axis : kAllAxisLetters)
    note(letter_of(axis), {Kind::axis, axis, static_cast<std::int8_t>(format.decimals(axis))});
  note('F', {Kind::feed, {}, 0});
  note('G', {Kind::code, {}, 0});
  note('M', {Kind::code, {}, 0});
  // X[...] and the like are read word by word; an opening that looks like a number would hide behind one.
  if (!c.run_time.open.empty() && begins_number(c.run_time.open.front())) plain_words = {};
}

bool Reader::State::take_plain_motion(const char* begin, const char* p, const char* end, LineMotion& m) {
  using Kind = PlainWord::Kind;
  Number number;
  for (std::size_t count = 0; count <= kMaxWords; ++count) {
    while (p != end && *p == ' ') ++p;
    if (p == end) return true;
    const char letter = *p;
    const PlainWord word = plain_words[static_cast<unsigned char>(letter)];
    if (word.kind == Kind::other) return false;
    const char* const behind = take_number(p + 1, end, number);
    if (behind == nullptr || behind > end) return false;
    switch (word.kind) {
      case Kind::axis: {
        std::int64_t quanta = 0;
        if (m.words.has(word.axis) || !to_quanta(number, word.decimals, quanta)) return false;
        if (c.numbers.point_required && !number.has_point && quanta != 0) return false;
        m.words.set(word.axis, quanta);
        if (m.column == 0) m.column = static_cast<std::uint32_t>(p - begin) + 1;
        break;
      }
      case Kind::feed:
        if (m.has_feed) return false;
        m.has_feed = true;
        m.feed = number;
        break;
      default: {
        Word code;
        code.letter = letter;
        code.number = number;
        if (!take_simple(code, m)) return false;
      }
    }
    p = behind;
  }
  return false;
}

}  // namespace trunnion::nc
