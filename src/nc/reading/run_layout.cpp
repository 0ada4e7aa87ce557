#include "nc/reading/run_layout.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "trunnion/base/character_lanes.hpp"

namespace trunnion::nc {
namespace {

constexpr std::size_t kDigits = 8;   // of a number
constexpr std::size_t kAround = 16;  // characters in which they are looked for
constexpr std::uint64_t kEach = 0x0101010101010101;
constexpr std::uint64_t kNone = 0x80 * kEach;  // no digit

// Numbers 0, 2 and 4 are calculated in the lower half of eight, 1, 3 and 5 in the upper one.
constexpr std::size_t place_of(std::size_t word) {
  return 4 * (word % 2) + word / 2;
}

// Bits of the places from `first` on, before `end`.
constexpr std::uint64_t places(std::size_t first, std::size_t end) {
  const std::uint64_t before_end = end == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << end) - 1;
  return before_end & (~std::uint64_t{0} << first);
}

// Where the digits of a number with so many decimals stand in the sixteen characters that end with it: of
// the eight, the first in the lowest byte.
constexpr auto kDigitAt = [] {
  std::array<std::uint64_t, kDigits> out{};
  for (std::size_t decimals = 0; decimals < kDigits; ++decimals) {
    for (std::size_t i = 0; i < kDigits; ++i) {
      const std::size_t at = kAround - kDigits + i - (i + decimals < kDigits ? 1 : 0);
      out[decimals] |= std::uint64_t{at} << (8 * i);
    }
  }
  return out;
}();

}  // namespace

// From their digits: every other character is looked at here.
bool RunLayout::take_fields(const char* line, std::size_t length, const RunLine& words,
                            std::array<Field, kWords>& fields) const {
  const auto digits_from = [&](std::size_t at) {
    return static_cast<std::size_t>(std::countr_one(digits_ >> at));
  };
  std::size_t i = 0;
  for (std::size_t k = 0; k < words.count; ++k) {
    Field& field = fields[k];
    field.first = i + (line[i + 1] == '-' ? 2 : 1);
    field.point = field.first + digits_from(field.first);
    field.end = field.point + 1 + digits_from(field.point + 1);
    const std::size_t decimals = field.end - field.point - 1;
    const bool is_feed = k == words.feed_at;
    if (line[field.point] != '.' || field.point == field.first || field.end >= length ||
        decimals != static_cast<std::size_t>(words.decimals[k]) || decimals >= kDigits ||
        field.digits() > kDigits + (is_feed ? 1 : 0) || (is_feed && line[i + 1] == '-'))
      return false;
    i = field.end + (line[field.end] == ' ' ? 1 : 0);
  }
  return i + 1 == length;
}

void RunLayout::take_digits(std::size_t word, const Field& field, bool negative) {
  from_[word] = field.end < kAround ? 0 : field.end - kAround;
  const std::size_t missing = kDigits - std::min(field.digits(), kDigits);
  // What is missing is none before and after places are counted from another character.
  const std::uint64_t none = missing == 0 ? 0 : (0xf0 * kEach) >> (8 * (kDigits - missing));
  digit_at_[word / 2][2 * (word % 2) + (word / 2 == 1 ? 1 : 0)] =
      (kDigitAt[field.end - field.point - 1] | none) - (from_[word] + kAround - field.end) * kEach;
  if (field.digits() > kDigits) ninth_at_ = field.first;
  sign_[place_of(word)] = negative ? -1 : 0;
}

bool RunLayout::learn(const char* line, const char* behind, const RunLine& words) {
  length_ = 0;
  const auto length = static_cast<std::size_t>(behind - line);
  if (length > kWidest || words.count > kWords || words.feed_at == 0 || words.mask == 0) return false;
  std::array<Field, kWords> fields{};
  within_ = places(0, length);
  digits_ = digits_at(line) & within_;
  if (!take_fields(line, length, words, fields)) return false;
  mask_ = words.mask;
  count_ = words.count;
  feed_at_ = std::min(words.feed_at, kWords);
  std::copy_n(words.axis.begin(), kWords, axis_.begin());
  std::memcpy(text_.data(), line, kWidest);
  ninth_at_ = 0;
  from_ = {};
  sign_ = {};
  for (auto& digit_at : digit_at_) digit_at.fill(kNone);
  for (std::size_t k = 0; k < count_; ++k) take_digits(k, fields[k], line[fields[k].first - 1] == '-');
  length_ = length;
  return true;
}

#if defined(TRUNNION_HAS_CHARACTER_LANES)

namespace {

// Behind the block number and a blank, as RunReader::skip_run_number; null where there is none in these
// words, or one of eight digits.
TRUNNION_FOUR inline const char* skip_number(const char* p, char prefix) {
  if (prefix != 0) {
    if (*p != prefix) return p;
    ++p;
  }
  std::uint64_t v = 0;
  std::memcpy(&v, p, sizeof(v));
  v ^= 0x3030303030303030;
  const std::uint64_t others = ((v + 0x7676767676767676) | v) & 0x8080808080808080;
  if (others == 0) return nullptr;
  const auto count = static_cast<std::size_t>(std::countr_zero(others)) / 8;
  if (prefix != 0 && count == 0) return nullptr;
  p += count;
  return p + (*p == ' ' ? 1 : 0);
}

}  // namespace

std::uint64_t RunLayout::digits_at(const char* line) {
  using namespace characters;
  return bits(is_digit_worth(worth(unaligned(line)))) | bits(is_digit_worth(worth(unaligned(line + 32))))
                                                            << 32;
}

const char* RunLayout::read(const char* p, const char* end, char prefix, std::uint32_t& line,
                            MotionRun& run) const {
  if (length_ == 0) return p;
  const std::size_t first = run.count;
  const char* const behind = read_lines(p, end, prefix, line, run);
  line += static_cast<std::uint32_t>(run.count - first);
  return behind;
}

const char* RunLayout::read_lines(const char* p, const char* end, char prefix, std::uint32_t line,
                                  MotionRun& run) const {
  using namespace characters;
  constexpr std::int32_t kNinth = 100'000'000;
  MotionRun::Column<std::int32_t> unused;
  std::array<std::int32_t*, kWords> to{};
  to.fill(unused.data());
  for (std::size_t k = 0; k < count_; ++k) {
    if (k != feed_at_) to[k] = run.quanta[index(axis_[k])].data();
  }
  const bool has_feed = feed_at_ < kWords;
  const std::size_t feed_place = has_feed ? place_of(feed_at_) : 0;
  const std::uint64_t others = within_ & ~digits_;
  std::size_t n = run.count;
  for (; n < MotionRun::kMost && end - p >= static_cast<std::ptrdiff_t>(kReads); ++n) {
    const char* const words = skip_number(p, prefix);
    if (words == nullptr) break;
    const __m256i low = unaligned(words);
    const __m256i high = unaligned(words + 32);
    const std::uint64_t as_before = bits(_mm256_cmpeq_epi8(low, aligned(&text_[0]))) |
                                    bits(_mm256_cmpeq_epi8(high, aligned(&text_[32]))) << 32;
    const std::uint64_t digits = bits(is_digit_worth(worth(low))) | bits(is_digit_worth(worth(high))) << 32;
    if ((digits & within_) != digits_ || (~as_before & others) != 0) break;

    const __m256i first = two_of(words + from_[0], words + from_[1], digit_at_[0].data());
    const __m256i second = two_of(words + from_[2], words + from_[3], digit_at_[1].data());
    const __m256i last = two_of(words + from_[4], words + from_[5], digit_at_[2].data());
    const __m256i sign = aligned(sign_.data());
    const __m256i size = values(_mm256_or_si256(first, second), last);
    alignas(32) std::array<std::int32_t, 8> value;
    _mm256_store_si256(reinterpret_cast<__m256i*>(value.data()),
                       _mm256_sub_epi32(_mm256_xor_si256(size, sign), sign));
    if (has_feed) {
      if (ninth_at_ != 0) value[feed_place] += kNinth * (words[ninth_at_] - '0');
      if (value[feed_place] == 0) break;
      run.feed[n] = value[feed_place];
    }
    for (std::size_t k = 0; k < kWords; ++k) to[k][n] = value[place_of(k)];
    run.source[n] = {++line, static_cast<std::uint32_t>(words - p) + 1};
    p = words + length_;
  }
  run.count = n;
  return p;
}

#else

std::uint64_t RunLayout::digits_at(const char*) {
  return 0;
}

const char* RunLayout::read(const char* p, const char*, char, std::uint32_t&, MotionRun&) const {
  return p;
}

#endif

}  // namespace trunnion::nc
