#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::nc {

/// The nine axis words of NC programs. A, B, C are rotary; the others are linear.
enum class AxisLetter : std::uint8_t { X, Y, Z, A, B, C, U, V, W };
inline constexpr std::size_t kAxisLetters = 9;
inline constexpr std::array<AxisLetter, kAxisLetters> kAllAxisLetters = {
    AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::B,
    AxisLetter::C, AxisLetter::U, AxisLetter::V, AxisLetter::W};

constexpr std::size_t index(AxisLetter letter) {
  return static_cast<std::size_t>(letter);
}
constexpr char letter_of(AxisLetter letter) {
  return "XYZABCUVW"[index(letter)];
}
constexpr bool is_rotary(AxisLetter letter) {
  return letter == AxisLetter::A || letter == AxisLetter::B || letter == AxisLetter::C;
}
/// Bits of AxisWords::mask.
inline constexpr std::uint16_t kAllAxes = 0b111111111;
inline constexpr std::uint16_t kRotaryAxes = 0b000111000;
inline constexpr std::uint16_t kXyz = 0b111;  // bits of X, Y and Z
inline constexpr std::uint16_t kLinearAxes = kAllAxes & ~kRotaryAxes;
/// The letter that `name` ("X", "A", ...) is; nothing for any other text.
std::optional<AxisLetter> axis_letter(std::string_view name);

/// How many decimals an axis word has. One quantum is 10^-decimals mm (linear) or degrees (rotary): what the
/// control is told is a whole number of quanta, and a planner that wants to know what the control will do
/// must calculate with those numbers (round the angles first, then calculate X Y Z from the rounded angles).
/// This is the one place of the conversion.
class AxisFormat {
 public:
  /// Both from 0 to 9.
  AxisFormat(int linear_decimals = 4, int rotary_decimals = 4);

  int decimals(AxisLetter letter) const { return is_rotary(letter) ? rotary_decimals_ : linear_decimals_; }
  /// Nearest whole number of quanta (halves away from zero) of `internal`: mm for linear axes, rad for rotary
  /// axes.
  std::int64_t quanta(AxisLetter letter, double internal) const {
    const double scaled =
        is_rotary(letter) ? internal * kDegreePerRad * rotary_scale_ : internal * linear_scale_;
    TRUNNION_EXPECTS(std::abs(scaled) < 9e18);  // fits in 64 bits; also false for NaN
    return nearest(scaled);
  }
  /// mm or rad of that many quanta.
  double internal(AxisLetter letter, std::int64_t quanta) const {
    const auto value = static_cast<double>(quanta);
    // Divided, not multiplied: the quotient of a decimal number is the double nearest to it.
    return is_rotary(letter) ? value / rotary_scale_ * kRadPerDegree : value / linear_scale_;
  }
  /// As std::llround, without the call, for |value| < 9e18.
  static std::int64_t nearest(double value) {
    const auto whole = static_cast<std::int64_t>(value);
    const double rest = value - static_cast<double>(whole);
    return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
  }
  /// `internal` rounded to what the word can say.
  double rounded(AxisLetter letter, double internal_value) const {
    return internal(letter, quanta(letter, internal_value));
  }
  /// One quantum in mm or rad.
  double quantum(AxisLetter letter) const { return internal(letter, 1); }
  /// Quanta of one turn of a rotary axis.
  std::int64_t turn() const;
  bool operator==(const AxisFormat&) const = default;

 private:
  int linear_decimals_ = 4;
  int rotary_decimals_ = 4;
  double linear_scale_ = 1e4;  // quanta per mm
  double rotary_scale_ = 1e4;  // quanta per degree
};

/// Axis words of one block, in quanta of an AxisFormat; only those whose bit is set in the mask stand there.
struct AxisWords {
  std::array<std::int64_t, kAxisLetters> quanta{};
  std::uint16_t mask = 0;

  static constexpr std::uint16_t bit(AxisLetter letter) {
    return static_cast<std::uint16_t>(1U << index(letter));
  }
  bool has(AxisLetter letter) const { return (mask & bit(letter)) != 0; }
  std::int64_t operator[](AxisLetter letter) const { return quanta[index(letter)]; }
  void set(AxisLetter letter, std::int64_t value) {
    quanta[index(letter)] = value;
    mask = static_cast<std::uint16_t>(mask | bit(letter));
  }
  void forget(std::uint16_t axes) { mask = static_cast<std::uint16_t>(mask & ~axes); }
  void forget(AxisLetter letter) { forget(bit(letter)); }
  /// Equal words; quanta of absent words do not count.
  bool operator==(const AxisWords& other) const;
};

/// The plane in which arcs run and holes are drilled: the tool axis is the control's Z.
inline constexpr std::uint16_t kPlaneWords = AxisWords::bit(AxisLetter::X) | AxisWords::bit(AxisLetter::Y);

}  // namespace trunnion::nc
