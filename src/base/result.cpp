#include "trunnion/base/result.hpp"

#include "trunnion/base/contract.hpp"
#include "trunnion/base/diagnostics.hpp"

namespace trunnion {

std::string Error::text() const {
  return Finding{Severity::error, file, where, message}.text();
}

void throw_bug(const char* condition, const char* file, int line) {
  throw BugError(std::string("expectation failed: ") + condition + " (" + file + ":" + std::to_string(line) +
                 ")");
}

}  // namespace trunnion
