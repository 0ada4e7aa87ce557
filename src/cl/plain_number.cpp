#include "cl/plain_number.hpp"

#include <charconv>
#include <cstddef>

namespace trunnion::cl {

const char* long_number(const char* p, bool negative, double& value, unsigned& places) {
  constexpr std::ptrdiff_t kSafeDigits = 15;  // 10^15 - 1 is below 2^53
  const char* const begin = p;
  if (const EightDigits whole(p); whole.count - 1U < 7U && p[whole.count] == '.') {
    const char* const fraction = p + whole.count + 1;
    if (const EightDigits rest(fraction); rest.count - 1U < 7U) {
      const std::uint64_t both = whole.value() * kPowerOfTen[rest.count] + rest.value();
      const double magnitude =
          static_cast<double>(static_cast<std::int64_t>(both)) / kPowerOfTenExact[rest.count];
      places = rest.count;
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
    magnitude = static_cast<double>(static_cast<std::int64_t>(mantissa)) / kPowerOfTenExact[places];
  } else {
    const auto parsed = std::from_chars(begin, p, magnitude, std::chars_format::fixed);
    if (parsed.ec != std::errc{} || parsed.ptr != p) return nullptr;
    if (places > 200) return nullptr;
  }
  value = negative ? -magnitude : magnitude;
  return p;
}

}  // namespace trunnion::cl
