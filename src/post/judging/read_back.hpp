#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "trunnion/post/post.hpp"
#include "trunnion/post/verify.hpp"

#include "post/intake/chunk.hpp"

namespace trunnion::post {

/// Hands the text of a program on and verifies it, while it is made: on the machine with its errors and its
/// drift, and where there are any on the nominal one, too. It may run beside the making of the text, a chunk
/// behind it.
class ReadBack {
 public:
  /// `errors`: of the machine, or null. References must outlive the object.
  ReadBack(const PostJob& job, const PostOptions& options, const TextSink& sink,
           const ModelEvaluator* errors);

  /// The text of the chunk goes to the sink, and is read when the CL points behind it are known: a block near
  /// the last one could not be judged before. Chunks in their order; their text is taken out.
  Result<void> pass_on(Chunk& chunk);
  /// The end of the program: what was found stands in the report. An error where the words themselves are
  /// wrong.
  Result<void> finish(PostReport& report);
  const Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  /// The motions and words that the text of the chunk was made from; then the text before it is read.
  void expect(const Chunk& chunk);
  void expect(const Chunk& chunk, std::size_t first, std::size_t end);

  const TextSink& sink_;
  std::string cl_file_;
  Diagnostics diagnostics_;
  std::unique_ptr<Verifier> verifier_;
  std::string unread_;  // the last text that went out
};

}  // namespace trunnion::post
