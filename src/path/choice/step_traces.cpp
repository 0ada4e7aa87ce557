#include "path/choice/step_traces.hpp"

#include <algorithm>

namespace trunnion::path {

void StepTraces::add(std::span<const TracedStep> steps) {
  const auto all_below = [&](std::uint16_t limit) {
    return std::all_of(steps.begin(), steps.end(),
                       [&](const TracedStep& s) { return s.from < limit && s.pick < limit; });
  };
  if (steps.size() <= 2 && all_below(2)) {
    unsigned code = steps.size() == 2 ? kTwo : 0;
    for (std::size_t i = 0; i < steps.size(); ++i)
      code |= (steps[i].from | static_cast<unsigned>(steps[i].pick) << 1) << (1 + 2 * i);
    return add(static_cast<std::uint8_t>(code));
  }
  if (steps.size() <= 16 && all_below(16)) {
    for (const TracedStep& s : steps) bytes_.push_back(static_cast<std::uint8_t>(s.from << 4 | s.pick));
    bytes_.push_back(static_cast<std::uint8_t>(steps.size()));
    return add(kNibbles);
  }
  for (const TracedStep& s : steps) {
    put(s.from);
    put(s.pick);
  }
  put(static_cast<std::uint16_t>(steps.size()));
  add(kWide);
}

StepTraces::Read StepTraces::take_last(std::size_t at) {
  const std::uint8_t code = bytes_.back();
  bytes_.pop_back();
  --layers_;
  if (code < kSmall) {
    const unsigned bits = static_cast<unsigned>(code & (kPlain - 1)) >> (1 + 2 * at);
    const TracedStep step = {static_cast<std::uint16_t>(bits & 1), static_cast<std::uint16_t>(bits >> 1 & 1)};
    return {step, (code & kPlain) != 0, std::size_t{1} + (code & kTwo)};
  }
  Read out;
  if (code == kNibbles) {
    const std::size_t first = bytes_.size() - 1 - bytes_.back();
    const unsigned both = bytes_[first + at];
    out.step = {static_cast<std::uint16_t>(both >> 4), static_cast<std::uint16_t>(both & 15)};
    bytes_.resize(first);
    return out;
  }
  const std::size_t first = bytes_.size() - 2 - std::size_t{4} * number_at(bytes_.size() - 2);
  out.step = {number_at(first + 4 * at), number_at(first + 4 * at + 2)};
  bytes_.resize(first);
  return out;
}

}  // namespace trunnion::path
