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

/// Where random cases begin: TRUNNION_SEED (for long runs in parts), `usual` otherwise.
inline unsigned seed(unsigned usual) {
  const char* const asked = std::getenv("TRUNNION_SEED");
  return asked != nullptr ? static_cast<unsigned>(std::strtoul(asked, nullptr, 10)) : usual;
}

}  // namespace trunnion::test
