#pragma once
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "trunnion/base/source_ref.hpp"

namespace trunnion {

/// What went wrong, as the process exit code will tell it (see README, "Exit codes").
enum class ErrorCode {
  check_failed = 1,  // the work was done and a check failed: tolerance, limits, unreachable
  wrong_use = 2,     // the command line
  wrong_input = 3,   // a file's content
  io_failed = 4,     // a file could not be read or written, memory or a thread not be had
  defect = 70,       // of the program; only in a batch, whose other files go on
};

/// One failure. `file` may be empty (no file involved) and `where` zero (place not known).
struct Error {
  ErrorCode code = ErrorCode::wrong_input;
  std::string message;
  std::string file;
  SourceRef where;

  /// `file:line:column: error: message`, leaving out what is not known.
  std::string text() const;
};

template <class T>
using Result = tl::expected<T, Error>;

/// Failure value for `return fail(...)` in a function that returns Result<T>.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message, std::string file = {},
                                  SourceRef where = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(file), where});
}

}  // namespace trunnion
