#include "trunnion/base/lanes.hpp"

namespace trunnion::lanes {
namespace {

bool g_only_two = false;

bool has_avx2() {
#if defined(__x86_64__) && defined(__OPTIMIZE__)
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

}  // namespace

bool four_at_a_time() {
  return !g_only_two && has_avx2();
}

void calculate_two_at_a_time(bool only_two) {
  g_only_two = only_two;
}

}  // namespace trunnion::lanes
