#include "cl/goto_layout.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "trunnion/base/character_lanes.hpp"

#include "cl/plain_number.hpp"

namespace trunnion::cl {
namespace {

constexpr std::size_t kDigits = 8;   // of a number
constexpr std::size_t kAround = 16;  // characters in which they are looked for
constexpr std::uint8_t kFree = 0xff;
constexpr std::uint8_t kNone = 0x80;  // no digit

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

void mark(std::array<std::uint64_t, 2>& places, std::size_t at) {
  places[at / 64] |= std::uint64_t{1} << (at % 64);
}

}  // namespace

bool GotoLayout::take_fields(const char* line, std::size_t length, std::array<Field, 6>& fields) const {
  const std::string_view text(line, length);
  std::size_t begin = text.find('/') + 1;
  if (begin == 0) return false;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    const std::size_t point = text.find('.', begin);
    if (point == std::string_view::npos || point == begin || !is_digit(text[point - 1])) return false;
    std::size_t end = point + 1;
    while (is_digit(text[end])) ++end;  // a newline ends the text
    const std::size_t decimals = end - point - 1;
    if (decimals < 1 || decimals >= kDigits) return false;
    for (std::size_t i = begin; i < point; ++i) {
      if (text[i] != ' ' && text[i] != '-' && !is_digit(text[i])) return false;
    }
    if (n + 1 < fields.size() && text[end] != ',') return false;
    fields[n] = {begin, point, end};
    begin = end + 1;
  }
  return true;
}

void GotoLayout::take_field(std::size_t number, const Field& field) {
  const std::size_t lane = number % 2;
  const std::size_t decimals = field.end - field.point - 1;
  const std::size_t whole = kDigits - decimals;  // digits before the point that count
  from_[number] = field.end < kAround ? 0 : field.end - kAround;
  Four& four = four_[lane];
  four.scale[number / 2] = kPowerOfTenExact[decimals];
  std::uint8_t* const digit_at = &digit_at_[number / 2][kAround * lane + (number / 2 == 1 ? kDigits : 0)];
  for (std::size_t i = 0; i < kDigits; ++i) {
    const bool behind = i >= whole;
    if (!behind && field.point + i < field.begin + whole) continue;
    const std::size_t at = field.end - kDigits + i - (behind ? 0 : 1);
    digit_at[i] = static_cast<std::uint8_t>(at - from_[number]);
  }
  for (std::size_t i = field.begin; i < field.point; ++i) {
    fixed_[i] = 0;
    number_[i] = kFree;
    four.leading[i / 64][number / 2] |= std::uint64_t{1} << (i % 64);
    if (i + 1 == field.point) {
      mark(digits_, i);
    } else {
      mark(leading_, i);
    }
    if (i + whole < field.point) mark(no_digit_, i);
  }
  for (std::size_t i = field.point + 1; i < field.end; ++i) {
    fixed_[i] = 0;
    number_[i] = kFree;
    mark(digits_, i);
  }
}

void GotoLayout::learn(const char* line, std::size_t length) {
  length_ = 0;
  if (!lanes::four_at_a_time()) return;
  std::array<Field, 6> fields{};
  if (length > kWidest || !take_fields(line, length, fields)) return;
  digits_ = leading_ = no_digit_ = {};
  four_ = {};
  for (auto& digit_at : digit_at_) digit_at.fill(kNone);
  std::copy_n(line, length, fixed_.begin());
  std::fill(fixed_.begin() + static_cast<std::ptrdiff_t>(length), fixed_.end(), std::uint8_t{0});
  number_ = behind_ = {};
  std::fill(behind_.begin() + static_cast<std::ptrdiff_t>(length), behind_.end(), kFree);
  for (std::size_t n = 0; n < fields.size(); ++n) take_field(n, fields[n]);
  length_ = length;
  column_ = 1;
  while (line[column_ - 1] == ' ' || line[column_ - 1] == '\t') ++column_;
}

#if defined(TRUNNION_HAS_CHARACTER_LANES)

namespace {

// The sign bit where one of the characters at `leading` is a minus.
TRUNNION_FOUR __m256d signs(const std::array<std::uint64_t, 2>& minus,
                            const std::array<std::array<std::uint64_t, 4>, 2>& leading) {
  using characters::aligned;
  const __m256i low = _mm256_set1_epi64x(static_cast<long long>(minus[0]));
  const __m256i high = _mm256_set1_epi64x(static_cast<long long>(minus[1]));
  const __m256i found = _mm256_or_si256(_mm256_and_si256(low, aligned(leading[0].data())),
                                        _mm256_and_si256(high, aligned(leading[1].data())));
  const __m256i none = _mm256_cmpeq_epi64(found, _mm256_setzero_si256());
  return _mm256_andnot_pd(_mm256_castsi256_pd(none), _mm256_set1_pd(-0.0));
}

}  // namespace

bool GotoLayout::read(const char* line, double* numbers) const {
  using namespace characters;
  if (line[length_ - 1] != '\n') return false;
  __m256i fits = _mm256_set1_epi8(-1);
  Places D{}, M{};  // digits and signs
  for (std::size_t v = 0; v < kVectors; ++v) {
    const __m256i text = unaligned(line + 32 * v);
    const __m256i is_digit = is_digit_worth(worth(text));
    const __m256i is_minus = _mm256_cmpeq_epi8(text, _mm256_set1_epi8('-'));
    const __m256i is_blank = _mm256_cmpeq_epi8(text, _mm256_set1_epi8(' '));
    const __m256i of_number = _mm256_and_si256(_mm256_or_si256(_mm256_or_si256(is_digit, is_minus), is_blank),
                                               aligned(&number_[32 * v]));
    const __m256i as_before = _mm256_cmpeq_epi8(text, aligned(&fixed_[32 * v]));
    fits = _mm256_and_si256(
        fits, _mm256_or_si256(_mm256_or_si256(of_number, as_before), aligned(&behind_[32 * v])));
    D[v / 2] |= bits(is_digit) << (32 * (v % 2));
    M[v / 2] |= bits(is_minus) << (32 * (v % 2));
  }
  // Behind a digit or a sign before the point stands a digit.
  const Places begun = {(D[0] | M[0]) & leading_[0], (D[1] | M[1]) & leading_[1]};
  const Places to_come = {begun[0] << 1, begun[1] << 1 | begun[0] >> 63};
  std::uint64_t wrong = 0;
  for (std::size_t w = 0; w < 2; ++w) wrong |= ((digits_[w] | to_come[w]) & ~D[w]) | (no_digit_[w] & D[w]);
  if (wrong != 0 || bits(fits) != 0xffffffff) return false;

  const __m256i first = two_of(line + from_[0], line + from_[1], digit_at_[0].data());
  const __m256i second = two_of(line + from_[2], line + from_[3], digit_at_[1].data());
  const __m256i last = two_of(line + from_[4], line + from_[5], digit_at_[2].data());
  const __m256i whole = values(_mm256_or_si256(first, second), last);
  const __m256d even = _mm256_xor_pd(
      _mm256_div_pd(_mm256_cvtepi32_pd(_mm256_castsi256_si128(whole)), _mm256_load_pd(four_[0].scale.data())),
      signs(M, four_[0].leading));
  const __m256d odd = _mm256_xor_pd(_mm256_div_pd(_mm256_cvtepi32_pd(_mm256_extracti128_si256(whole, 1)),
                                                  _mm256_load_pd(four_[1].scale.data())),
                                    signs(M, four_[1].leading));
  const __m256d outer = _mm256_unpacklo_pd(even, odd);
  _mm_storeu_pd(numbers, _mm256_castpd256_pd128(outer));
  _mm_storeu_pd(numbers + 2, _mm256_castpd256_pd128(_mm256_unpackhi_pd(even, odd)));
  _mm_storeu_pd(numbers + 4, _mm256_extractf128_pd(outer, 1));
  return true;
}

#else

bool GotoLayout::read(const char*, double*) const {
  return false;
}

#endif

}  // namespace trunnion::cl
