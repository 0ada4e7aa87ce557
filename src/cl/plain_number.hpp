#pragma once
#include <bit>
#include <charconv>
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
    // The highest bit of each byte above 9; a carry reaches bytes behind the first of them only.
    const std::uint64_t others = ((digits + 0x7676767676767676) | digits) & 0x8080808080808080;
    count = others == 0 ? 8 : std::countr_zero(others) / 8;
  }
  /// Of the `count` digits, at least one.
  std::uint64_t value() const {
    std::uint64_t x = digits << (64 - 8 * count);  // zeros in front
    x = (x * 10 + (x >> 8)) & 0x00FF00FF00FF00FF;
    x = (x * 100 + (x >> 16)) & 0x0000FFFF0000FFFF;
    return (x * 10000 + (x >> 32)) & 0x00000000FFFFFFFF;
  }
  std::uint64_t digits = 0;
  int count = 0;
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

/// Reads `[+-]digits[.digits]` at `p` (the text ends in a character that is none of these, and eight more
/// bytes can be read); whether the number ends there, and not in an exponent, is for the caller to see.
/// Correctly rounded: up to 2^53 the mantissa is exact, and so is the power of ten up to 10^22, hence their
/// quotient is the nearest double; longer ones go to from_chars.
/// @return behind the number; null when there is none. `places`: digits after the point.
inline const char* plain_number(const char* p, double& value, unsigned& places) {
  static constexpr double kPower[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                      1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  constexpr std::ptrdiff_t kSafeDigits = 15;  // 10^15 - 1 is below 2^53
  const bool negative = *p == '-';
  p += negative || *p == '+' ? 1 : 0;
  const char* const begin = p;
  // Nearly every number has fewer than eight digits on either side of a point.
  if (const EightDigits whole(p); whole.count < 8 && whole.count > 0 && p[whole.count] == '.') {
    const char* const fraction = p + whole.count + 1;
    const EightDigits rest(fraction);
    if (rest.count < 8 && rest.count > 0) {
      const std::uint64_t digits = whole.value() * kPowerOfTen[rest.count] + rest.value();
      const double magnitude = static_cast<double>(static_cast<std::int64_t>(digits)) / kPower[rest.count];
      places = static_cast<unsigned>(rest.count);
      value = negative ? -magnitude : magnitude;
      return fraction + rest.count;
    }
  }
  std::uint64_t mantissa = 0;
  // Few digits stand before the point, and more behind it.
  unsigned digit = 0;
  while ((digit = static_cast<unsigned>(*p) - '0') < 10) {
    mantissa = mantissa * 10 + digit;
    ++p;
  }
  std::ptrdiff_t digits = p - begin;
  places = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    p = append_digits(p, mantissa);
    places = static_cast<unsigned>(p - fraction);
    digits += p - fraction;
  }
  if (digits == 0) return nullptr;
  double magnitude = 0.0;
  if (digits <= kSafeDigits) {
    magnitude = static_cast<double>(static_cast<std::int64_t>(mantissa)) / kPower[places];
  } else {
    const auto parsed = std::from_chars(begin, p, magnitude, std::chars_format::fixed);
    if (parsed.ec != std::errc{} || parsed.ptr != p) return nullptr;
    if (places > 200) return nullptr;
  }
  value = negative ? -magnitude : magnitude;
  return p;
}

}  // namespace trunnion::cl
