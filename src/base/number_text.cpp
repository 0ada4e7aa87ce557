#include "trunnion/base/number_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

NumberFault fault_of(std::string_view text, const std::from_chars_result& r) {
  if (r.ec == std::errc::result_out_of_range) return NumberFault::out_of_range;
  if (r.ec != std::errc{}) return NumberFault::not_a_number;
  return r.ptr == text.data() + text.size() ? NumberFault::none : NumberFault::trailing_characters;
}

// An exponent letter of Fortran (`1.5D+3`), which from_chars does not know.
ParsedNumber parse_with_fortran_exponent(std::string_view text, std::size_t letter) {
  std::string copy(text);
  copy[letter] = 'e';
  ParsedNumber out;
  out.fault = fault_of(copy, std::from_chars(copy.data(), copy.data() + copy.size(), out.value));
  return out;
}

// from_chars says "out of range" for an underflow too; 1e-400 is a harmless zero.
bool underflows(std::string_view text) {
  const auto e = text.find_first_of("eE");
  return e != std::string_view::npos && text.find('-', e) != std::string_view::npos;
}

// Plain decimals of at most 15 digits (`-12.345`): both the digits and the power of ten are exact doubles, so
// that one division is correctly rounded (Clinger 1990). Anything else is left to from_chars.
std::optional<double> plain_decimal(std::string_view text) {
  constexpr std::array<double, 16> kPower = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                             1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const char* p = text.data();
  const char* const end = p + text.size();
  const bool negative = p != end && *p == '-';
  if (negative) ++p;
  if (end - p > 16 || p == end) return std::nullopt;  // 15 digits and a point
  std::int64_t digits = 0;
  const char* point = nullptr;
  std::ptrdiff_t count = 0;
  for (; p != end; ++p) {
    const unsigned digit = static_cast<unsigned char>(*p) - static_cast<unsigned>('0');
    if (digit <= 9) {
      digits = 10 * digits + static_cast<std::int64_t>(digit);
      ++count;
    } else if (*p == '.' && point == nullptr) {
      point = p;
    } else {
      return std::nullopt;
    }
  }
  if (count == 0 || count > 15) return std::nullopt;
  double value = static_cast<double>(digits);
  if (point != nullptr) value /= kPower[static_cast<std::size_t>(end - point - 1)];
  return negative ? -value : value;
}

}  // namespace

ParsedNumber parse_number(std::string_view text) {
  if (const auto value = plain_decimal(text)) return {*value, NumberFault::none};
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return {0.0, NumberFault::not_a_number};
  }
  if (text.empty()) return {0.0, NumberFault::empty};
  if (text.find_first_of("0123456789") == std::string_view::npos) return {0.0, NumberFault::not_a_number};
  if (const auto d = text.find_first_of("dD"); d != std::string_view::npos)
    return parse_with_fortran_exponent(text, d);
  ParsedNumber out;
  out.fault = fault_of(text, std::from_chars(text.data(), text.data() + text.size(), out.value));
  if (out.fault == NumberFault::out_of_range && underflows(text)) return {0.0, NumberFault::none};
  if (out.fault == NumberFault::none && !std::isfinite(out.value)) out.fault = NumberFault::not_a_number;
  return out;
}

std::optional<std::uint64_t> parse_integer(std::string_view text) {
  std::uint64_t value = 0;
  const auto r = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || r.ec != std::errc{} || r.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string shortest_text(double value) {
  std::array<char, 32> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value);
  TRUNNION_EXPECTS(r.ec == std::errc{});
  return {buffer.data(), r.ptr};
}

std::string fixed_text(double value, int decimals) {
  constexpr std::array<double, 10> kScale = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  TRUNNION_EXPECTS(decimals >= 0 && decimals < static_cast<int>(kScale.size()));
  const double scale = kScale[static_cast<std::size_t>(decimals)];
  TRUNNION_EXPECTS(std::isfinite(value));
  if (!(std::abs(value) * scale < 9e18)) {  // a number of so many digits has none behind the point
    std::array<char, 400> digits;
    const auto r = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::fixed, decimals);
    return {digits.data(), r.ptr};
  }
  std::int64_t quanta = std::llround(value * scale);
  std::string out;
  if (quanta < 0) {
    out += '-';
    quanta = -quanta;
  }
  const auto unit = static_cast<std::int64_t>(scale);
  out += std::to_string(quanta / unit);
  if (decimals > 0) {
    std::string fraction = std::to_string(quanta % unit);
    out += '.';
    out.append(static_cast<std::size_t>(decimals) - fraction.size(), '0');
    out += fraction;
  }
  return out;
}

}  // namespace trunnion
