#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A long run whose joints can only be chosen once its last point is known: what `choose_solutions` gives
/// with ChoiceMethod::global for all its points at once, in 64 bytes a point. Points are chosen among while
/// they come in and handed out again with their joints, piece by piece.
class HeldRun {
 public:
  HeldRun(const Machine& machine, const JointVector& seed, const ChoiceOptions& options, std::string cl_file);
  ~HeldRun();

  /// Further points of the run.
  void add(std::span<const ChoicePoint> points);
  std::size_t size() const;
  /// No more points come; options as they are now. Fails as `choose_solutions`.
  Result<void> finish(const ChoiceOptions& options);
  /// What is chosen at the last point; after `finish`, of a run that is not empty.
  ChosenPoint last() const;
  /// The next points, appended, as many as `chosen` has room for, and their joints; their number, 0 at the
  /// end. What was handed out is no longer held. Adds to `summary`.
  std::size_t take(std::span<ChosenPoint> chosen, std::vector<ChoicePoint>& points, ChoiceSummary& summary);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace trunnion::path
