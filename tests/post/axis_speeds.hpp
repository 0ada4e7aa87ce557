#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <variant>

#include "trunnion/machine/machine.hpp"

#include "support/controllers.hpp"

namespace trunnion::test {

/// Duration of a feed block as the manuals have it: G93 F is one over the minutes; G94 F divides the length
/// of X Y Z (or all axes, one degree as one millimetre), or degrees where only rotary axes move.
inline double block_seconds(const nc::Controller& c, const nc::Motion& from, const nc::Motion& to) {
  const double f = static_cast<double>(to.feed) / std::pow(10.0, c.numbers.feed.decimals(to.feed_mode));
  double linear = 0.0;
  double rotary = 0.0;
  for (const nc::AxisLetter letter : nc::kAllAxisLetters) {
    if (!to.words.has(letter)) continue;
    const double d = static_cast<double>(to.words[letter] - from.words[letter]) /
                     std::pow(10.0, c.numbers.axes.decimals(letter));
    (nc::is_rotary(letter) ? rotary : linear) += d * d;
  }
  const bool all = c.feed.path == nc::FeedPath::all_axes;
  const double length = std::sqrt(linear == 0.0 ? rotary : all ? linear + rotary : linear);
  if (to.feed_mode == nc::FeedMode::per_minute) return 60.0 * length / f;
  double seconds = 60.0 / f;
  if (c.feed.min_linear_rate_mm_s)
    seconds = std::min(seconds, length / *c.feed.min_linear_rate_mm_s);  // LinuxCNC: at least 0.1 a minute
  return seconds;
}

struct Speeds {
  double worst_ratio = 0.0;
  std::size_t blocks = 0;
  double feed_seconds = 0.0;
};

/// Of all feed blocks that are not under tool-centre-point control.
inline Speeds speeds_of(const Machine& machine, const nc::Controller& c, const std::string& text) {
  Speeds out;
  std::optional<nc::Motion> before;
  for (const nc::Block& block : nc_blocks(c, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (std::holds_alternative<nc::Retract>(block)) before.reset();
    if (motion == nullptr) continue;
    if (before && motion->kind == nc::MotionKind::feed && before->words.mask == motion->words.mask) {
      const double seconds = block_seconds(c, *before, *motion);
      out.feed_seconds += seconds;
      ++out.blocks;
      for (const Axis& axis : machine.axes) {
        const nc::AxisLetter letter = *nc::axis_letter(axis.name);
        const double way = std::abs(c.numbers.axes.internal(letter, motion->words[letter]) -
                                    c.numbers.axes.internal(letter, before->words[letter]));
        out.worst_ratio = std::max(out.worst_ratio, way / seconds / *axis.max_feed);
      }
    }
    before = *motion;
  }
  return out;
}

}  // namespace trunnion::test
