#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "nc/reading/lexer.hpp"

// Numbers of the lines that make nearly all of a program.
namespace trunnion::nc {

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

}  // namespace trunnion::nc
