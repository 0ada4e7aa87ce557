#pragma once
#include <array>
#include <cstdint>

#include "trunnion/nc/controller.hpp"

#include "nc/digits.hpp"

namespace trunnion::nc {

/// Numbers as the control takes them need at most 18 digits.
inline constexpr std::int64_t kLargest = 999'999'999'999'999'999;

/// How the numbers of a control are written, word by word, and how large they may be.
struct NumberForms {
  explicit NumberForms(const Controller& c);

  const NumberStyle& of_axis(AxisLetter letter) const { return is_rotary(letter) ? rotary : linear; }
  /// Of a number without a plus sign, with the digits of a length or others.
  NumberStyle unsigned_of(int decimals) const {
    return {decimals, linear.trailing_zeros, linear.point_required, false};
  }
  NumberStyle unsigned_length() const { return unsigned_of(linear.decimals); }
  bool may_feed(FeedMode mode, std::int64_t quanta) const {
    return quanta > 0 && quanta <= largest_feed[static_cast<std::size_t>(mode)];
  }

  NumberStyle linear, rotary;
  std::array<NumberStyle, 2> feed;             // by mode
  std::array<std::int64_t, 2> largest_feed{};  // quanta; 0: no such feed
  std::int64_t turn;                           // quanta of a rotary axis
  // Every axis word has four decimals and no other form than its digits, and one character stands behind it.
  bool are_plain;
};

}  // namespace trunnion::nc
