#pragma once
#include <charconv>
#include <cstdint>

namespace trunnion::cl {

/// Reads `[+-]digits[.digits]` at `p` (the text ends in a character that is none of these). Correctly
/// rounded: up to 2^53 the mantissa is exact, and so is the power of ten up to 10^22, hence their quotient is
/// the nearest double; longer ones go to from_chars.
/// @return behind the number; null when there is none, or one with an exponent. `places`: digits after the
/// point.
inline const char* plain_number(const char* p, double& value, unsigned& places) {
  static constexpr double kPower[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                                      1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};
  constexpr int kSafeDigits = 18;  // 10^18 - 1 fits an int64
  constexpr std::int64_t kExact = std::int64_t{1} << 53;
  const bool negative = *p == '-';
  if (negative || *p == '+') ++p;
  const char* const begin = p;
  std::uint64_t mantissa = 0;
  unsigned digit = 0;
  while ((digit = static_cast<unsigned>(*p) - '0') < 10) {
    mantissa = mantissa * 10 + digit;
    ++p;
  }
  auto digits = p - begin;
  places = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    while ((digit = static_cast<unsigned>(*p) - '0') < 10) {
      mantissa = mantissa * 10 + digit;
      ++p;
    }
    places = static_cast<unsigned>(p - fraction);
    digits += p - fraction;
  }
  if (digits == 0) return nullptr;
  const char next = static_cast<char>(*p | 0x20);
  if (next == 'e' || next == 'd') return nullptr;
  double magnitude = 0.0;
  if (digits <= kSafeDigits && static_cast<std::int64_t>(mantissa) <= kExact) {
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
