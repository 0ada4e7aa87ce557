#pragma once
#include <cstddef>

namespace trunnion {

/// Length of a large page of memory, and what it is aligned to.
inline constexpr std::size_t kLargePage = std::size_t{2} << 20;

/// Asks the system to have this memory, which begins at a large page and was not touched yet, in large pages
/// as far as it has whole ones: it then comes in one piece where it would come in 512. Where the system does
/// not do that nothing changes but the time.
void ask_for_large_pages(void* begin, std::size_t bytes);

}  // namespace trunnion
