#pragma once
#include <cstddef>
#include <cstdint>

#include "trunnion/machine/machine.hpp"

namespace trunnion::path {

/// The whole turns of one angle that an axis may stand at: within its limits, in ascending order, and where
/// there are more than asked for the ones nearest to where it comes from. Of an axis that may turn for ever
/// the nearest one and, `both_ways`, the one that it comes to the other way round.
class Turns {
 public:
  Turns(const Axis& axis, double angle, double near, std::size_t most, bool both_ways = false);

  std::size_t count() const { return count_; }
  double at(std::size_t i) const;
  /// There are more: one of them that is as near to `near` as any.
  bool left_out() const { return left_out_; }
  double nearest_left_out() const;

 private:
  const Axis& axis_;
  double angle_;
  double near_;
  double first_ = 0.0;  // whole turns of the first one
  std::size_t count_ = 0;
  bool left_out_ = false;
  double least_ = 0.0;  // whole turns that the limits leave
  double most_ = 0.0;
};

/// An angle that misses a limit by its own rounding is at it.
inline constexpr double kAtLimit = 1e-12;

/// Travel over rate: seconds that an axis takes for a unit of its motion. Where the machine file gives no
/// rate it is that of a small trunnion: only ratios matter for the choice.
double seconds_per_unit(const Axis& axis);

}  // namespace trunnion::path
