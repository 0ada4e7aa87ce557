#pragma once
#include <string>

#include "post/intake/chunk.hpp"
#include "post/making/posting.hpp"

namespace trunnion::post {

/// Whether what is taken out is known for the program: the model where it cuts, temperatures and thermal
/// offsets while it runs. Where it cuts: rapids are left out.
class MeasuredReach {
 public:
  explicit MeasuredReach(const Posting& posting)
      : asked_(posting.job.model != nullptr && !posting.job.model->valid.empty()) {}

  void take(const Chunk& chunk);
  /// When the program is at its end: one warning with all axes and temperatures that go beyond, and one where
  /// temperatures or offsets over time are not known for most of the program.
  void warn(Posting& posting) const;

 private:
  static void warn_of_times(Posting& posting, const std::string& what, double first_s, double last_s);
  MeasuredRanges used(const Posting& posting) const;

  bool asked_, cuts_ = false;
  JointVector smallest_q_, largest_q_;
};

}  // namespace trunnion::post
