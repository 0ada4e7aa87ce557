#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "trunnion/base/lanes.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::post {

/// Positions of the axes `id` and `id` + 1 side by side.
inline Lanes joint_pair(const JointVector& q, AxisId id) {
  static_assert(sizeof(JointVector) == kMaxAxes * sizeof(double));
  Lanes out;
  std::memcpy(&out, reinterpret_cast<const std::byte*>(&q) + id * sizeof(double), sizeof(out));
  return out;
}

/// a == b, without a jump for each axis.
inline bool same_joints(const JointVector& a, const JointVector& b) {
  static_assert(kMaxAxes == 5, "two pairs and one");
#if defined(__SSE2__)
  // Masks that the compiler makes of vectors it takes apart again.
  const auto same = [&](AxisId id) { return _mm_cmpeq_pd(joint_pair(a, id), joint_pair(b, id)); };
  return _mm_movemask_pd(_mm_and_pd(same(0), same(2))) == 3 && a[4] == b[4];
#else
  return a == b;
#endif
}

/// least <= q <= most, axis by axis.
inline bool joints_within(const JointVector& q, const JointVector& least, const JointVector& most) {
#if defined(__SSE2__)
  const auto within = [&](AxisId id) {
    const Lanes at = joint_pair(q, id);
    return _mm_and_pd(_mm_cmpge_pd(at, joint_pair(least, id)), _mm_cmple_pd(at, joint_pair(most, id)));
  };
  return _mm_movemask_pd(_mm_and_pd(within(0), within(2))) == 3 && q[4] >= least[4] && q[4] <= most[4];
#else
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    if (!(q[id] >= least[id] && q[id] <= most[id])) return false;
  }
  return true;
#endif
}

/// Both numbers as the nearest whole ones; the least that 32 bits hold where one has more.
inline void put_whole(const Lanes& pair, std::int32_t* out) {
#if defined(__SSE2__)
  _mm_storel_epi64(reinterpret_cast<__m128i*>(out), _mm_cvtpd_epi32(pair));
#else
  for (int i = 0; i < 2; ++i) {
    const double whole = std::nearbyint(pair[i]);
    out[i] = std::abs(whole) < 2147483648.0 ? static_cast<std::int32_t>(whole)
                                            : std::numeric_limits<std::int32_t>::min();
  }
#endif
}

}  // namespace trunnion::post
