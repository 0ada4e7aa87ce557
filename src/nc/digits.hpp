#pragma once
#include <array>
#include <cstdint>
#include <cstring>

namespace trunnion::nc {

inline constexpr int kMaxDecimals = 9;

constexpr std::int64_t power_of_ten(int exponent) {
  std::int64_t p = 1;
  for (int i = 0; i < exponent; ++i) p *= 10;
  return p;
}

inline constexpr auto kPowersOfTen = [] {
  std::array<std::int64_t, 19> out{};
  for (int i = 0; i < 19; ++i) out[static_cast<std::size_t>(i)] = power_of_ten(i);
  return out;
}();

/// "00" to "99": numbers are written two digits at a time (std::to_chars of a double takes ten times as
/// long).
inline constexpr auto kDigitPairs = [] {
  std::array<char, 200> out{};
  for (std::size_t i = 0; i < 100; ++i) {
    out[2 * i] = static_cast<char>('0' + i / 10);
    out[2 * i + 1] = static_cast<char>('0' + i % 10);
  }
  return out;
}();

/// Writes `value` in decimal at `p`; returns the end.
inline char* put_unsigned(char* p, std::uint64_t value) {
  std::array<char, 20> digits;
  char* const end = digits.data() + digits.size();
  char* d = end;
  while (value >= 100) {
    d -= 2;
    std::memcpy(d, &kDigitPairs[2 * (value % 100)], 2);
    value /= 100;
  }
  if (value >= 10) {
    d -= 2;
    std::memcpy(d, &kDigitPairs[2 * value], 2);
  } else {
    *--d = static_cast<char>('0' + value);
  }
  const auto n = static_cast<std::size_t>(end - d);
  std::memcpy(p, d, n);
  return p + n;
}

/// How a number of quanta is written.
struct NumberStyle {
  int decimals = 4;
  bool trailing_zeros = true;
  bool point_required = false;
  bool plus_sign = false;
};

/// `Decimals` digits of `fraction` < 10^Decimals, with leading zeros.
template <int Decimals>
inline char* put_fraction(char* p, std::uint32_t fraction) {
  for (int i = Decimals - 2; i >= 0; i -= 2) {
    std::memcpy(p + i, &kDigitPairs[2 * (fraction % 100)], 2);
    fraction /= 100;
  }
  if constexpr (Decimals % 2 == 1) *p = static_cast<char>('0' + fraction);
  return p + Decimals;
}

template <int Decimals>
inline char* put_point_number(char* p, std::uint64_t magnitude) {
  constexpr auto kScale = static_cast<std::uint64_t>(power_of_ten(Decimals));
  // 32-bit division is what almost every coordinate needs, and the faster one.
  if (magnitude < (std::uint64_t{1} << 32)) {
    const auto small = static_cast<std::uint32_t>(magnitude);
    constexpr auto kSmallScale = static_cast<std::uint32_t>(kScale);
    p = put_unsigned(p, small / kSmallScale);
    *p++ = '.';
    return put_fraction<Decimals>(p, small % kSmallScale);
  }
  p = put_unsigned(p, magnitude / kScale);
  *p++ = '.';
  return put_fraction<Decimals>(p, static_cast<std::uint32_t>(magnitude % kScale));
}

/// Writes `quanta` * 10^-decimals at `p` (at most 24 characters); returns the end. Zero has no sign.
char* put_number(char* p, std::int64_t quanta, const NumberStyle& style);

}  // namespace trunnion::nc
