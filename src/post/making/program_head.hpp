#pragma once
#include "post/intake/chunk.hpp"
#include "post/making/posting.hpp"

namespace trunnion::post {

/// The head of a program: its name, what an operator has to know, and the work offset that it calls.
class ProgramHead {
 public:
  explicit ProgramHead(Posting& posting) : posting_(posting) {}

  bool is_written() const { return is_written_; }
  /// When the first motions and what is said before them are known.
  Result<void> write(const Chunk& chunk);
  /// What the CL file says of it later: fails where it calls another one.
  Result<void> check_work_offset(const cl::WorkOffset& offset, SourceRef where);

 private:
  std::int64_t work_offset_of(const Chunk& chunk) const;
  std::int64_t number_of(const std::string& name) const;

  Posting& posting_;
  bool is_written_ = false;
};

}  // namespace trunnion::post
