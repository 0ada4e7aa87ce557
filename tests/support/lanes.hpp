#pragma once
#include "trunnion/base/lanes.hpp"

namespace trunnion::test {

/// As long as it lives objects are built for two lanes, whatever the processor can.
class OnlyTwoLanes {
 public:
  explicit OnlyTwoLanes(bool only_two) { lanes::calculate_two_at_a_time(only_two); }
  OnlyTwoLanes(const OnlyTwoLanes&) = delete;
  OnlyTwoLanes& operator=(const OnlyTwoLanes&) = delete;
  ~OnlyTwoLanes() { lanes::calculate_two_at_a_time(false); }
};

}  // namespace trunnion::test
