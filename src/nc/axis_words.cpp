#include "trunnion/nc/axis_words.hpp"

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

std::int64_t AxisFormat::turn() const {
  return quanta(AxisLetter::C, kTwoPi);
}

bool AxisWords::operator==(const AxisWords& other) const {
  if (mask != other.mask) return false;
  for (const AxisLetter letter : kAllAxisLetters) {
    if (has(letter) && (*this)[letter] != other[letter]) return false;
  }
  return true;
}

}  // namespace trunnion::nc
