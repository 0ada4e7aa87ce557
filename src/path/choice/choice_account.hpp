#pragma once
#include <array>
#include <span>

#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// Adds up what a choice did, point after point.
class ChoiceAccount {
 public:
  /// The points of a run come from `seed`, on `branch`.
  ChoiceAccount(const Machine& machine, const JointVector& seed, std::uint8_t branch);
  void add(std::span<const ChosenPoint> chosen, ChoiceSummary& summary);

 private:
  std::array<double, kMaxAxes> turns_{};  // 1 for those that turn
  std::array<double, kMaxAxes> seconds_{};
  JointVector before_;
  std::uint8_t branch_;
};

/// What is said of a point that no position within the limits reaches.
Error unreachable(const Machine& machine, const ChoicePoint& point, const ChoiceOptions& options,
                  const std::string& cl_file);

}  // namespace trunnion::path
