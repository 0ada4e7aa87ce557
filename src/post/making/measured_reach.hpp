#pragma once
#include "post/intake/chunk.hpp"
#include "post/making/posting.hpp"

namespace trunnion::post {

/// Whether the model whose errors are compensated was measured where the program cuts. Rapids are left out:
/// where nothing is cut nothing is lost.
class MeasuredReach {
 public:
  explicit MeasuredReach(const Posting& posting)
      : asked_(posting.job.model != nullptr && !posting.job.model->valid.empty()) {}

  void take(const Chunk& chunk);
  /// One warning, with all axes and temperatures that go beyond, when the program is at its end.
  void warn(Posting& posting) const;

 private:
  MeasuredRanges used(const Posting& posting) const;

  bool asked_, cuts_ = false;
  JointVector smallest_q_, largest_q_;
};

}  // namespace trunnion::post
