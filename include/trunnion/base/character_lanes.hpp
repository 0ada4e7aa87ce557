#pragma once
#include "trunnion/base/lanes.hpp"

// Characters of a text, many at a time, and the numbers that they are. For functions that say TRUNNION_FOUR
// and are called where lanes::four_at_a_time() says so.
#if defined(__x86_64__) && defined(__OPTIMIZE__)
#define TRUNNION_HAS_CHARACTER_LANES 1
#include <immintrin.h>

namespace trunnion::characters {

TRUNNION_FOUR inline __m256i unaligned(const void* from) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(from));
}
TRUNNION_FOUR inline __m256i aligned(const void* from) {
  return _mm256_load_si256(static_cast<const __m256i*>(from));
}
/// A bit for each character of a mask.
TRUNNION_FOUR inline std::uint64_t bits(__m256i mask) {
  return static_cast<std::uint64_t>(static_cast<unsigned>(_mm256_movemask_epi8(mask)));
}
/// What a digit is worth; beyond 9 for other characters.
TRUNNION_FOUR inline __m256i worth(__m256i text) {
  return _mm256_sub_epi8(text, _mm256_set1_epi8('0'));
}
TRUNNION_FOUR inline __m256i is_digit_worth(__m256i worth) {
  return _mm256_cmpeq_epi8(_mm256_min_epu8(worth, _mm256_set1_epi8(9)), worth);
}
/// Sixteen characters each from two places, those at `digit_at` of each.
TRUNNION_FOUR inline __m256i two_of(const char* a, const char* b, const void* digit_at) {
  const __m128i first = _mm_loadu_si128(reinterpret_cast<const __m128i*>(a));
  const __m128i second = _mm_loadu_si128(reinterpret_cast<const __m128i*>(b));
  return _mm256_shuffle_epi8(_mm256_inserti128_si256(_mm256_castsi128_si256(first), second, 1),
                             aligned(digit_at));
}
/// Of the digits among these characters: four by four.
TRUNNION_FOUR inline __m256i fours_of(__m256i text) {
  const __m256i value = worth(text);
  const __m256i digits = _mm256_and_si256(value, is_digit_worth(value));
  const __m256i twos = _mm256_maddubs_epi16(digits, _mm256_set1_epi16(10 | (1 << 8)));
  return _mm256_madd_epi16(twos, _mm256_set1_epi32(100 | (1 << 16)));
}
/// The numbers of eight digits each: 0, 2 and 4 in the lower half, 1, 3 and 5 in the upper one. `first`: the
/// characters of 0 to 3; `last`: of 4 and 5.
TRUNNION_FOUR inline __m256i values(__m256i first, __m256i last) {
  return _mm256_madd_epi16(_mm256_packus_epi32(fours_of(first), fours_of(last)),
                           _mm256_set1_epi32(10000 | (1 << 16)));
}

}  // namespace trunnion::characters
#endif
