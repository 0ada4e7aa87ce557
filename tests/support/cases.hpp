#pragma once
#include <cstdlib>

namespace trunnion::test {

/// How many random cases a property is tried on: what an environment variable says (for long runs), `usual`
/// otherwise. An instrumented build, ten times slower and looking for other faults than a wrong figure, tries
/// a tenth; the release build of the same run tries them all.
inline int cases(int usual, const char* variable = nullptr) {
  const char* const asked = variable != nullptr ? std::getenv(variable) : nullptr;
  if (asked != nullptr) return std::atoi(asked);
#if defined(__SANITIZE_ADDRESS__)
  return (usual + 9) / 10;
#else
  return usual;
#endif
}

}  // namespace trunnion::test
