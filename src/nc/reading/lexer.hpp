#pragma once
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "nc/digits.hpp"

namespace trunnion::nc {

/// A decimal number as it stands in the text: mantissa * 10^-decimals.
struct Number {
  std::int64_t mantissa = 0;
  int decimals = 0;
  bool has_point = false;
};

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}
/// The first character from `p` on that is no blank, or `end`.
constexpr const char* skip_blanks(const char* p, const char* end) {
  while (p != end && is_blank(*p)) ++p;
  return p;
}
/// The text without the blanks at its two ends.
constexpr std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}
constexpr bool is_letter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_';
}
constexpr char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}
constexpr bool is_of_name(char c) {
  return is_letter(c) || is_digit(c);
}
/// In capital or small letters, as those of `begin` are.
constexpr bool begins_as(std::string_view text, std::string_view begin) {
  return text.size() >= begin.size() && std::equal(begin.begin(), begin.end(), text.begin(),
                                                   [](char a, char b) { return upper(a) == upper(b); });
}
/// Takes `text`, in capitals, which may stand in small letters.
constexpr bool takes(const char*& p, const char* end, std::string_view text) {
  if (static_cast<std::size_t>(end - p) < text.size() ||
      !std::equal(text.begin(), text.end(), p, [](char a, char b) { return a == upper(b); }))
    return false;
  p += text.size();
  return true;
}
constexpr bool begins_number(char c) {
  return is_digit(c) || c == '+' || c == '-' || c == '.';
}

/// Most digits that are taken: more would not fit 64 bits.
inline constexpr int kMaxDigits = 18;

/// Reads `[+-] digits [. digits]` at `p`; on success `p` stands behind it. Fails without a digit and beyond
/// kMaxDigits.
inline bool scan_number(const char*& p, const char* end, Number& out) {
  const char* s = p;
  const bool negative = s != end && *s == '-';
  if (s != end && (*s == '-' || *s == '+')) ++s;
  std::uint64_t mantissa = 0;
  const char* const first = s;
  while (s != end && is_digit(*s)) mantissa = mantissa * 10 + static_cast<std::uint64_t>(*s++ - '0');
  auto digits = s - first;
  out.decimals = 0;
  out.has_point = s != end && *s == '.';
  if (out.has_point) {
    const char* const fraction = ++s;
    while (s != end && is_digit(*s)) mantissa = mantissa * 10 + static_cast<std::uint64_t>(*s++ - '0');
    out.decimals = static_cast<int>(s - fraction);
    digits += s - fraction;
  }
  if (digits == 0 || digits > kMaxDigits) return false;
  out.mantissa = negative ? -static_cast<std::int64_t>(mantissa) : static_cast<std::int64_t>(mantissa);
  p = s;
  return true;
}

/// Same value, however it is written (1, 01, 1.0).
bool equal(Number a, Number b);

/// The number in quanta of 10^-decimals when its last digits beyond them are zeros; false otherwise, or when
/// it is too large.
bool to_quanta_trimmed(Number number, int decimals, std::int64_t& out);

/// The same; what almost every word needs stands here.
inline bool to_quanta(const Number& number, int decimals, std::int64_t& out) {
  if (number.decimals > decimals) return to_quanta_trimmed(number, decimals, out);
  const auto scale = kPowersOfTen[static_cast<std::size_t>(decimals - number.decimals)];
  return !__builtin_mul_overflow(number.mantissa, scale, &out);
}

/// The same, rounded to the nearest quantum (halves away from zero).
bool to_rounded_quanta(Number number, int decimals, std::int64_t& out);

}  // namespace trunnion::nc
