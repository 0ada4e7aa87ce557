#pragma once
#include <string>
#include <vector>

#include "trunnion/post/batch.hpp"

namespace trunnion::report {

struct BatchCounts {
  std::size_t posted = 0;
  std::size_t skipped = 0;
  std::size_t failed = 0;
  std::size_t would_post = 0;
  std::size_t not_run = 0;
};
BatchCounts count(const std::vector<post::BatchResult>& results);

/// Summary for a terminal: one line for each file that was posted or failed, and the counts.
std::string batch_table(const std::vector<post::BatchResult>& results);
/// The counts in one line.
std::string batch_summary(const std::vector<post::BatchResult>& results);
std::string batch_json(const std::vector<post::BatchResult>& results);

}  // namespace trunnion::report
