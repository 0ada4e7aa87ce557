#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace trunnion {

/// Why a text is not a number that can be used.
enum class NumberFault { none, empty, not_a_number, trailing_characters, out_of_range };

struct ParsedNumber {
  double value = 0.0;
  NumberFault fault = NumberFault::none;
  explicit operator bool() const { return fault == NumberFault::none; }
};

/// Reads the whole of `text` as a decimal number: `1`, `+.5`, `25.`, `-1.5e-3`, `1.5D+3` (Fortran). Correctly
/// rounded. `nan`, `inf`, hexadecimal and numbers beyond the range of double (`1e400`) are faults, never
/// values.
ParsedNumber parse_number(std::string_view text);

/// Reads a whole, non-negative decimal integer.
std::optional<std::uint64_t> parse_integer(std::string_view text);

/// Shortest text that reads back as the same double (for TOML, JSON and messages).
std::string shortest_text(double value);

/// `value` in `decimals` (0 to 9) places after the point, rounded half away from zero to a whole number of
/// quanta first, so that
/// `-0.0000` cannot occur: fixed_text(-0.00004, 4) == "0.0000".
std::string fixed_text(double value, int decimals);

}  // namespace trunnion
