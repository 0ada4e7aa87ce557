#include "trunnion/base/large_pages.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace trunnion {

void ask_for_large_pages([[maybe_unused]] void* begin, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  // Refused (no such pages in this kernel, or not for this program) it says so, and nobody minds.
  (void)madvise(begin, bytes, MADV_HUGEPAGE);
#endif
}

}  // namespace trunnion
