#pragma once
#include <array>

#include "trunnion/base/lanes.hpp"

namespace trunnion::test {

inline constexpr std::array kEveryWay{lanes::Way::two, lanes::Way::four, lanes::Way::four_in_32};

/// As long as it lives objects are built to calculate in this way at most, whatever the processor can.
class Calculating {
 public:
  explicit Calculating(lanes::Way most) { lanes::calculate(most); }
  Calculating(const Calculating&) = delete;
  Calculating& operator=(const Calculating&) = delete;
  ~Calculating() { lanes::calculate(lanes::Way::four_in_32); }
};

}  // namespace trunnion::test
