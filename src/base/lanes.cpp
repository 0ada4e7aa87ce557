#include "trunnion/base/lanes.hpp"

#include <algorithm>

namespace trunnion::lanes {
namespace {

Way g_most = Way::four_in_32;

bool has_avx2() {
#if defined(__x86_64__) && defined(__OPTIMIZE__)
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

bool has_avx512() {
#if defined(__x86_64__) && defined(__OPTIMIZE__)
  return __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
         __builtin_cpu_supports("avx512bw") != 0;
#else
  return false;
#endif
}

}  // namespace

Way way() {
  static const Way known = !has_avx2() ? Way::two : has_avx512() ? Way::four_in_32 : Way::four;
  return std::min(known, g_most);
}

void calculate(Way most) {
  g_most = most;
}

}  // namespace trunnion::lanes
