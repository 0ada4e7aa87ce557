#pragma once
#include <memory>
#include <string>

#include "trunnion/post/post.hpp"

#include "post/chunk.hpp"

namespace trunnion::post {

/// Verifies the text of a program while it is made: on the machine with its errors and its drift, and where
/// there are any on the nominal one, too. It may run beside the making of the text, a chunk behind it.
class ReadBack {
 public:
  /// `errors`: of the machine, or null. Does nothing where the options ask for no verification.
  ReadBack(const PostJob& job, const PostOptions& options, const ModelEvaluator* errors);

  /// The motions and words that the text of the chunk was made from, in their order; then the text before it
  /// is read: a block near the last CL point could not be judged without the points behind it.
  void expect(const Chunk& chunk);
  /// The text of the chunk that was expected last; it is taken out.
  void take(std::string& text);
  /// The end of the program: what was found stands in the report.
  Result<void> finish(PostReport& report);
  const Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  Diagnostics diagnostics_;
  std::unique_ptr<Verifier> with_errors_, nominal_;  // of the machine
  std::string unread_;                               // the last text that went out
};

}  // namespace trunnion::post
