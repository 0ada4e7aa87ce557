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

/// "0000" to "9999", for the numbers of motion blocks.
inline constexpr auto kFourDigits = [] {
  std::array<char, 40000> out{};
  for (std::size_t i = 0; i < 10000; ++i) {
    out[4 * i] = static_cast<char>('0' + i / 1000);
    out[4 * i + 1] = static_cast<char>('0' + i / 100 % 10);
    out[4 * i + 2] = static_cast<char>('0' + i / 10 % 10);
    out[4 * i + 3] = static_cast<char>('0' + i % 10);
  }
  return out;
}();

inline char* put_pair(char* p, std::uint32_t value) {
  std::memcpy(p, &kDigitPairs[std::size_t{2} * value], 2);
  return p + 2;
}

/// Writes `value` in decimal at `p`, where four characters may be written; returns the end. Most coordinates
/// have one to four digits here: as many of "0000" to "9999" as count, without a jump that nobody can
/// foresee.
inline char* put_unsigned(char* p, std::uint32_t value) {
  if (value < 10000) {
    std::uint32_t digits = 0;
    std::memcpy(&digits, &kFourDigits[std::size_t{4} * value], sizeof(digits));
    const unsigned zeros = (value < 10 ? 1U : 0U) + (value < 100 ? 1U : 0U) + (value < 1000 ? 1U : 0U);
    digits >>= 8 * zeros;  // the first character is the lowest byte
    std::memcpy(p, &digits, sizeof(digits));
    return p + 4 - zeros;
  }
  const std::uint32_t low = value % 10000;
  return put_pair(put_pair(put_unsigned(p, value / 10000), low / 100), low % 100);
}

inline char* put_unsigned(char* p, std::uint64_t value) {
  if (value < (std::uint64_t{1} << 32)) return put_unsigned(p, static_cast<std::uint32_t>(value));
  const auto low = static_cast<std::uint32_t>(value % 10000);
  return put_pair(put_pair(put_unsigned(p, value / 10000), low / 100), low % 100);
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
  if constexpr (Decimals == 4) {
    std::memcpy(p, &kFourDigits[std::size_t{4} * fraction], 4);
    return p + 4;
  }
  if constexpr (Decimals == 3) {
    std::memcpy(p, &kFourDigits[std::size_t{4} * fraction + 1], 3);
    return p + 3;
  }
  for (int i = Decimals - 2; i >= 0; i -= 2) {
    std::memcpy(p + i, &kDigitPairs[std::size_t{2} * (fraction % 100)], 2);
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
char* put_any_number(char* p, std::int64_t quanta, const NumberStyle& style);

/// What nearly all controls take, in the range of machine tools, stands here so that the compiler can unroll
/// it.
inline bool is_four_decimals(const NumberStyle& style) {
  return style.decimals == 4 && style.trailing_zeros && !style.plus_sign;
}
/// Below this on either side four digits stand before the point and four behind it.
inline constexpr std::int64_t kEightDigits = 100'000'000;
/// Digits of 0 to 9999 with a point behind them, first character lowest; in the highest byte how many there
/// are.
inline constexpr auto kWholeAndPoint = [] {
  std::array<std::uint64_t, 10000> out{};
  for (std::uint64_t n = 0; n < out.size(); ++n) {
    std::uint64_t text = '.';
    std::uint64_t count = 1;
    std::uint64_t rest = n;
    do {
      text = text << 8 | ('0' + rest % 10);
      rest /= 10;
      ++count;
    } while (rest > 0);
    out[n] = text | count << 56;
  }
  return out;
}();
/// The two stretches of up to four digits and the point: `quanta` in thousandths or ten thousandths, where
/// twelve characters may be written.
template <int Decimals>
inline char* put_magnitude(char* p, std::uint32_t magnitude) {
  static_assert(Decimals == 3 || Decimals == 4);
  constexpr std::uint32_t kScale = Decimals == 4 ? 10000 : 1000;
  const std::uint32_t whole = magnitude / kScale;
  const std::uint64_t text = kWholeAndPoint[whole];
  std::memcpy(p, &text, sizeof(text));
  return put_fraction<Decimals>(p + (text >> 56), magnitude - kScale * whole);
}
inline char* put_eight_digits(char* p, std::int32_t quanta) {
  *p = '-';
  p += quanta < 0 ? 1 : 0;
  return put_magnitude<4>(p, static_cast<std::uint32_t>(quanta < 0 ? -quanta : quanta));
}
/// `number` < 10^8, where twelve characters may be written.
inline char* put_number_word(char* p, std::uint32_t number) {
  const auto put_high = [&p](std::uint32_t high) {
    const std::uint64_t text = kWholeAndPoint[high];
    std::memcpy(p, &text, sizeof(text));
    return p + (text >> 56) - 1;  // without the point
  };
  if (number < 10000) return put_high(number);
  return put_fraction<4>(put_high(number / 10000), number % 10000);
}
/// Below it three decimals leave four digits before the point.
inline constexpr std::int64_t kSevenDigits = 10'000'000;

/// As put_any_number.
inline char* put_number(char* p, std::int64_t quanta, const NumberStyle& style) {
  if (is_four_decimals(style) && quanta < kEightDigits && quanta > -kEightDigits)
    return put_eight_digits(p, static_cast<std::int32_t>(quanta));
  // Feeds.
  if (style.decimals == 3 && style.trailing_zeros && !style.plus_sign && quanta >= 0 && quanta < kSevenDigits)
    return put_magnitude<3>(p, static_cast<std::uint32_t>(quanta));
  return put_any_number(p, quanta, style);
}

}  // namespace trunnion::nc
