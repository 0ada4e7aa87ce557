#pragma once
#include <stdexcept>
#include <string>

namespace trunnion {

/// A defect of the program itself (never of its input). Caught in `main` only, which exits with code 70.
class BugError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void throw_bug(const char* condition, const char* file, int line);

}  // namespace trunnion

/// Checks an assumption of the developer; on in every build. User input is never checked with it.
#define TRUNNION_EXPECTS(condition) \
  ((condition) ? static_cast<void>(0) : ::trunnion::throw_bug(#condition, __FILE__, __LINE__))
