#pragma once
#include <bit>
#include <cstdint>
#include <cstring>

namespace trunnion::cl {

inline constexpr std::uint64_t kPowerOfTen[] = {1,       10,        100,        1'000,      10'000,
                                                100'000, 1'000'000, 10'000'000, 100'000'000};

/// The eight characters at `p`, digits as 0 to 9, and how many of them are digits before the first other one.
struct EightDigits {
  explicit EightDigits(const char* p) {
    static_assert(std::endian::native == std::endian::little, "the first character is the lowest byte");
    std::memcpy(&digits, p, sizeof(digits));
    digits ^= 0x3030303030303030;
    // The highest bit of each byte above 9; a carry reaches bytes behind one above 0x89 only, and there is
    // none in ASCII.
    others = ((digits + 0x7676767676767676) | digits) & 0x8080808080808080;
    count = first_of(others);
  }
  /// Of the `count` digits, at least one.
  std::uint64_t value() const { return value_of(digits << (64 - 8 * count)); }

  /// Where the first character that is no digit is a point: how many characters there are before the next
  /// one that is none; 8: as many as were looked at.
  unsigned end_behind_point() const { return first_of(others & (others - 1)); }
  /// The value of the digits of the first `end` characters, of which number `count` is a point.
  std::uint64_t value_without_point(unsigned end) const {
    const std::uint64_t before = (std::uint64_t{1} << (8 * count)) - 1;
    const std::uint64_t closed = (digits & before) | ((digits >> 8) & ~before);
    return value_of(closed << (64 - 8 * (end - 1)));
  }

  // Number of the lowest byte whose highest bit is set; 8: none.
  static unsigned first_of(std::uint64_t bits) {
    return bits == 0 ? 8 : static_cast<unsigned>(std::countr_zero(bits)) / 8;
  }
  // Eight digits, zeros in front.
  static std::uint64_t value_of(std::uint64_t x) {
    x = (x * 10 + (x >> 8)) & 0x00FF00FF00FF00FF;
    x = (x * 100 + (x >> 16)) & 0x0000FFFF0000FFFF;
    return (x * 10000 + (x >> 32)) & 0x00000000FFFFFFFF;
  }
  std::uint64_t digits = 0;
  std::uint64_t others = 0;
  unsigned count = 0;
};

/// Appends the digits at `p` to `mantissa`, eight at a time; at least eight bytes behind `p` can be read.
/// Returns behind them. The mantissa of more than 19 digits means nothing.
inline const char* append_digits(const char* p, std::uint64_t& mantissa) {
  for (;;) {
    const EightDigits eight(p);
    if (eight.count == 0) return p;
    mantissa = mantissa * kPowerOfTen[eight.count] + eight.value();
    p += eight.count;
    if (eight.count < 8) return p;
  }
}

inline constexpr double kPowerOfTenExact[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                              1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

/// As plain_number, behind the sign, of a number of any length.
const char* long_number(const char* p, bool negative, double& value, unsigned& places);

/// Reads `[+-]digits[.digits]` at `p` (the text ends in a character that is none of these, and eight more
/// bytes can be read); whether the number ends there, and not in an exponent, is for the caller to see.
/// Correctly rounded: up to 2^53 the mantissa is exact, and so is the power of ten up to 10^22, hence their
/// quotient is the nearest double; longer ones go to from_chars.
/// @return behind the number; null when there is none. `places`: digits after the point.
inline const char* plain_number(const char* p, double& value, unsigned& places) {
  const bool negative = *p == '-';
  p += negative || *p == '+' ? 1 : 0;
  // Nearly every number has eight characters at most: the digits behind the point close up to those before
  // it.
  const EightDigits whole(p);
  if (whole.count - 1U < 7U && p[whole.count] == '.') {
    const unsigned end = whole.end_behind_point();
    const unsigned decimals = end - 1 - whole.count;
    if (decimals > 0 && (end < 8 || static_cast<unsigned>(p[8]) - '0' >= 10)) {
      const auto digits = static_cast<std::int64_t>(whole.value_without_point(end));
      const double magnitude = static_cast<double>(digits) / kPowerOfTenExact[decimals];
      places = decimals;
      value = negative ? -magnitude : magnitude;
      return p + end;
    }
  }
  return long_number(p, negative, value, places);
}

}  // namespace trunnion::cl
