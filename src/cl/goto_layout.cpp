#include "cl/goto_layout.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "cl/plain_number.hpp"

namespace trunnion::cl {
namespace {

constexpr std::size_t kDigits = 8;  // of a number
constexpr std::uint8_t kFree = 0xff;

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
  Pair& pair = pairs_[number / 2];
  const std::size_t lane = number % 2;
  const std::size_t decimals = field.end - field.point - 1;
  const std::size_t whole = kDigits - decimals;  // digits before the point that count
  pair.end[lane] = field.end;
  pair.scale[lane] = kPowerOfTenExact[decimals];
  for (std::size_t i = 0; i < kDigits; ++i) {
    const bool counts = field.point + i >= field.begin + whole;
    pair.before[kDigits * lane + i] = i < whole && counts ? kFree : 0;
    pair.behind[kDigits * lane + i] = i < whole ? 0 : kFree;
  }
  for (std::size_t i = field.begin; i < field.point; ++i) {
    fixed_[i] = 0;
    number_[i] = kFree;
    pair.leading[i / 64][lane] |= std::uint64_t{1} << (i % 64);
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
#if defined(__SSE2__)
  length_ = 0;
  std::array<Field, 6> fields{};
  if (length > kWidest || !take_fields(line, length, fields)) return;
  digits_ = leading_ = no_digit_ = {};
  pairs_ = {};
  std::copy_n(line, length, fixed_.begin());
  std::fill(fixed_.begin() + static_cast<std::ptrdiff_t>(length), fixed_.end(), std::uint8_t{0});
  number_ = behind_ = {};
  std::fill(behind_.begin() + static_cast<std::ptrdiff_t>(length), behind_.end(), kFree);
  for (std::size_t n = 0; n < fields.size(); ++n) take_field(n, fields[n]);
  length_ = length;
  column_ = 1;
  while (line[column_ - 1] == ' ' || line[column_ - 1] == '\t') ++column_;
#else
  static_cast<void>(line);
  static_cast<void>(length);
#endif
}

#if defined(__SSE2__)

namespace {

__m128i load16(const void* from) {
  return _mm_loadu_si128(static_cast<const __m128i*>(from));
}
__m128i aligned16(const void* from) {
  return _mm_load_si128(static_cast<const __m128i*>(from));
}
void store16(void* to, __m128i value) {
  _mm_store_si128(static_cast<__m128i*>(to), value);
}
std::uint64_t bits(__m128i mask) {
  return static_cast<std::uint64_t>(static_cast<unsigned>(_mm_movemask_epi8(mask)));
}
// Eight characters each of two numbers.
__m128i load_two(const char* a, const char* b) {
  __m128i out = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(a));
  return _mm_unpacklo_epi64(out, _mm_loadl_epi64(reinterpret_cast<const __m128i*>(b)));
}
// The values of two numbers of eight digits each: 0 to 9, one in a byte.
__m128d value_of_digits(__m128i digits) {
  const __m128i zero = _mm_setzero_si128();
  const __m128i tens = _mm_set1_epi32(10 | (1 << 16));
  const __m128i hundreds = _mm_set1_epi32(100 | (1 << 16));
  const __m128i of_first = _mm_madd_epi16(_mm_unpacklo_epi8(digits, zero), tens);
  const __m128i of_second = _mm_madd_epi16(_mm_unpackhi_epi8(digits, zero), tens);
  const __m128i fours = _mm_madd_epi16(_mm_packs_epi32(of_first, of_second), hundreds);
  const __m128d upper = _mm_cvtepi32_pd(_mm_shuffle_epi32(fours, _MM_SHUFFLE(3, 1, 2, 0)));
  const __m128d lower = _mm_cvtepi32_pd(_mm_shuffle_epi32(fours, _MM_SHUFFLE(2, 0, 3, 1)));
  return _mm_add_pd(_mm_mul_pd(upper, _mm_set1_pd(10000.0)), lower);
}

}  // namespace

bool GotoLayout::read(const char* line, double* numbers) const {
  if (line[length_ - 1] != '\n') return false;
  constexpr std::size_t kBefore = 16;  // the first number may be short
  alignas(16) std::array<char, kBefore + kWidest> clean;
  __m128i fits = _mm_set1_epi8(-1);
  Places D{}, M{};  // digits and signs
  for (std::size_t v = 0; v < kVectors; ++v) {
    const __m128i text = load16(line + 16 * v);
    const __m128i value = _mm_sub_epi8(text, _mm_set1_epi8('0'));
    const __m128i is_digit = _mm_cmpeq_epi8(_mm_min_epu8(value, _mm_set1_epi8(9)), value);
    store16(&clean[kBefore + 16 * v], _mm_and_si128(value, is_digit));
    const __m128i is_minus = _mm_cmpeq_epi8(text, _mm_set1_epi8('-'));
    const __m128i is_blank = _mm_cmpeq_epi8(text, _mm_set1_epi8(' '));
    const __m128i of_number =
        _mm_and_si128(_mm_or_si128(_mm_or_si128(is_digit, is_minus), is_blank), aligned16(&number_[16 * v]));
    const __m128i as_before = _mm_cmpeq_epi8(text, aligned16(&fixed_[16 * v]));
    fits = _mm_and_si128(fits, _mm_or_si128(_mm_or_si128(of_number, as_before), aligned16(&behind_[16 * v])));
    D[v / 4] |= bits(is_digit) << (16 * (v % 4));
    M[v / 4] |= bits(is_minus) << (16 * (v % 4));
  }
  // Behind a digit or a sign before the point stands a digit.
  const Places begun = {(D[0] | M[0]) & leading_[0], (D[1] | M[1]) & leading_[1]};
  const Places to_come = {begun[0] << 1, begun[1] << 1 | begun[0] >> 63};
  std::uint64_t wrong = 0;
  for (std::size_t w = 0; w < 2; ++w) wrong |= ((digits_[w] | to_come[w]) & ~D[w]) | (no_digit_[w] & D[w]);
  if (wrong != 0 || bits(fits) != 0xffff) return false;
  const __m128i minus0 = _mm_set1_epi64x(static_cast<long long>(M[0]));
  const __m128i minus1 = _mm_set1_epi64x(static_cast<long long>(M[1]));
  for (std::size_t n = 0; n < pairs_.size(); ++n) {
    const Pair& pair = pairs_[n];
    const char* const a = clean.data() + kBefore + pair.end[0] - kDigits;
    const char* const b = clean.data() + kBefore + pair.end[1] - kDigits;
    const __m128i digits = _mm_or_si128(_mm_and_si128(load_two(a - 1, b - 1), aligned16(pair.before.data())),
                                        _mm_and_si128(load_two(a, b), aligned16(pair.behind.data())));
    const __m128d size = _mm_div_pd(value_of_digits(digits), _mm_load_pd(pair.scale.data()));
    // One bit is set where there is a sign, and less that number the highest is.
    const __m128i sign = _mm_or_si128(_mm_and_si128(minus0, aligned16(pair.leading[0].data())),
                                      _mm_and_si128(minus1, aligned16(pair.leading[1].data())));
    const __m128d negative = _mm_castsi128_pd(_mm_sub_epi64(_mm_setzero_si128(), sign));
    _mm_storeu_pd(numbers + 2 * n, _mm_xor_pd(size, _mm_and_pd(negative, _mm_set1_pd(-0.0))));
  }
  return true;
}

#else

bool GotoLayout::read(const char*, double*) const {
  return false;
}

#endif

}  // namespace trunnion::cl
