#include "nc/control/number_forms.hpp"

namespace trunnion::nc {
NumberForms::NumberForms(const Controller& c)
    : linear{c.numbers.axes.decimals(AxisLetter::X), c.numbers.trailing_zeros, c.numbers.point_required,
             c.numbers.plus_sign},
      rotary(linear),
      turn(c.numbers.axes.turn()) {
  rotary.decimals = c.numbers.axes.decimals(AxisLetter::A);
  for (const auto mode : {FeedMode::per_minute, FeedMode::inverse_time}) {
    auto& style = feed[static_cast<std::size_t>(mode)];
    style = unsigned_of(c.numbers.feed.decimals(mode));
    const auto& limit = mode == FeedMode::inverse_time ? c.feed.max_inverse_time : c.feed.max_per_minute;
    const auto scale = static_cast<double>(kPowersOfTen[static_cast<std::size_t>(style.decimals)]);
    largest_feed[static_cast<std::size_t>(mode)] =
        limit ? static_cast<std::int64_t>(*limit * scale) : kLargest;
  }
  if (!c.has_inverse_time()) largest_feed[static_cast<std::size_t>(FeedMode::inverse_time)] = 0;
  are_plain = is_four_decimals(linear) && is_four_decimals(rotary) && c.rotary.modulo_axes == 0 &&
              c.line.separator.size() == 1;
}

}  // namespace trunnion::nc
