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
  /// When the program is at its end: one warning with all axes and temperatures that go beyond, and one where
  /// the temperatures of most of the program are not known.
  void warn(Posting& posting) const;

 private:
  static void warn_of_log(Posting& posting);
  MeasuredRanges used(const Posting& posting) const;

  bool asked_, cuts_ = false;
  JointVector smallest_q_, largest_q_;
};

}  // namespace trunnion::post
