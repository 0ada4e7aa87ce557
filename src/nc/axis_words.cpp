#include "trunnion/nc/axis_words.hpp"

#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"

#include "nc/digits.hpp"

namespace trunnion::nc {

std::optional<AxisLetter> axis_letter(std::string_view name) {
  if (name.size() != 1) return std::nullopt;
  for (const AxisLetter letter : kAllAxisLetters) {
    if (letter_of(letter) == name.front()) return letter;
  }
  return std::nullopt;
}

AxisFormat::AxisFormat(int linear_decimals, int rotary_decimals)
    : linear_decimals_(linear_decimals), rotary_decimals_(rotary_decimals) {
  TRUNNION_EXPECTS(linear_decimals >= 0 && linear_decimals <= kMaxDecimals);
  TRUNNION_EXPECTS(rotary_decimals >= 0 && rotary_decimals <= kMaxDecimals);
  linear_scale_ = static_cast<double>(power_of_ten(linear_decimals));
  rotary_scale_ = static_cast<double>(power_of_ten(rotary_decimals));
}

std::int64_t AxisFormat::quanta(AxisLetter letter, double internal) const {
  const double scaled =
      is_rotary(letter) ? internal * kDegreePerRad * rotary_scale_ : internal * linear_scale_;
  TRUNNION_EXPECTS(std::abs(scaled) < 9e18);  // fits in 64 bits; also false for NaN
  return std::llround(scaled);
}

double AxisFormat::internal(AxisLetter letter, std::int64_t quanta) const {
  const auto value = static_cast<double>(quanta);
  // Divided, not multiplied: the quotient of a decimal number is the double nearest to it.
  return is_rotary(letter) ? value / rotary_scale_ * kRadPerDegree : value / linear_scale_;
}

std::int64_t AxisFormat::turn() const {
  return quanta(AxisLetter::C, kTwoPi);
}

AxisFormat AxisFormat::finer(int extra) const {
  return {std::min(linear_decimals_ + extra, kMaxDecimals), std::min(rotary_decimals_ + extra, kMaxDecimals)};
}

bool AxisWords::operator==(const AxisWords& other) const {
  if (mask != other.mask) return false;
  for (const AxisLetter letter : kAllAxisLetters) {
    if (has(letter) && (*this)[letter] != other[letter]) return false;
  }
  return true;
}

}  // namespace trunnion::nc
