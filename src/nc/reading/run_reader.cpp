#include "nc/reading/run_reader.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "nc/reading/plain_number.hpp"

namespace trunnion::nc {
namespace {

// A number as nearly every word has it, one to four digits before the point and four behind it, in units of
// its last one. Null for any other. Sixteen characters can be read.
inline const char* take_four_decimals(const char* p, std::int32_t& out) {
  if constexpr (std::endian::native != std::endian::little) return nullptr;
  const bool negative = *p == '-';
  p += negative ? 1 : 0;
  std::uint64_t v = 0;
  std::memcpy(&v, p, sizeof(v));
  v ^= 0x3030303030303030;  // of digits 0 to 9; the first character is the lowest byte
  const std::uint64_t others = ((v + 0x7676767676767676) | v) & 0x8080808080808080;
  const auto whole = static_cast<unsigned>(std::countr_zero(others)) / 8;  // of no other: 8
  constexpr std::uint64_t kPoint = '.' ^ '0';
  if (whole - 1 > 3 || ((v >> (8 * whole)) & 0xff) != kPoint) return nullptr;
  std::uint32_t fraction = 0;
  std::memcpy(&fraction, p + whole + 1, sizeof(fraction));
  fraction ^= 0x30303030;
  if ((((fraction + 0x76767676) | fraction) & 0x80808080) != 0) return nullptr;
  // Eight digits, zeros in front of those before the point.
  std::uint64_t digits =
      (std::uint64_t{fraction} << 32) | (static_cast<std::uint32_t>(v) << (32 - 8 * whole));
  digits = 10 * digits + (digits >> 8);
  constexpr std::uint64_t kPairs = 0x000000ff000000ff;
  const std::uint64_t value = ((digits & kPairs) * (100 + (std::uint64_t{1000000} << 32)) +
                               ((digits >> 16) & kPairs) * (1 + (std::uint64_t{10000} << 32))) >>
                              32;
  const auto magnitude = static_cast<std::int32_t>(value);
  out = negative ? -magnitude : magnitude;
  return p + whole + 5;
}

constexpr int kRunDecimals = 4;  // of take_four_decimals
constexpr auto kLineReads = static_cast<std::ptrdiff_t>(RunLayout::kReads);

bool fits(std::int64_t quanta) {
  return quanta >= std::numeric_limits<std::int32_t>::min() &&
         quanta <= std::numeric_limits<std::int32_t>::max();
}

}  // namespace

RunReader::RunReader(ReadState& state, Reader::RunSink sink)
    : s_(state),
      sink_(std::move(sink)),
      has_layouts_(lanes::four_at_a_time() && state.c.rotary.modulo_axes == 0) {}

bool RunReader::may_begin() const {
  if (!s_.program.started || s_.program.ended || s_.findings.given_up || s_.modal.cycle ||
      s_.modal.clamped != 0 || s_.program.increments_since != 0 || !s_.options.raw_lines.empty())
    return false;
  if (s_.program.frame && (s_.program.frame->is_head() || s_.program.frame->is_open())) return false;
  if (s_.modal.motion_kind != MotionKind::feed || !s_.c.motion.modal || s_.c.block_numbers.prefix.size() > 1)
    return false;
  return std::all_of(kAllAxisLetters.begin(), kAllAxisLetters.end(), [this](AxisLetter letter) {
    return !s_.modal.position.has(letter) || fits(s_.modal.position[letter]);
  });
}

// Behind the block number; null where that is not one.
const char* RunReader::skip_run_number(const char* p) const {
  const std::string& prefix = s_.c.block_numbers.prefix;
  if (!prefix.empty()) {
    if (*p != prefix.front()) return p;
    if (!is_digit(*++p)) return nullptr;
  }
  while (is_digit(*p)) ++p;
  return *p == ' ' ? p + 1 : p;
}

// Of a line without F. Lines that were read by their layout may have said another one since the last line
// that was read word by word.
std::int64_t RunReader::feed_of_silent_line() const {
  return s_.modal.feed_mode == FeedMode::inverse_time && s_.c.feed.inverse_time_every_block ? 0 : s_.feed;
}

// Nearly every line has the letters of the one before it.
const char* RunReader::take_same_words(const char* const begin, const char* const end) {
  constexpr std::ptrdiff_t kReadAtOnce = 18;  // for one word, its letter, a sign and a blank among it
  RunLine& l = line_;
  const char* p = skip_run_number(begin);
  if (p == nullptr || !four_decimals_ || end - p < kReadAtOnce * static_cast<std::ptrdiff_t>(l.count))
    return nullptr;
  const auto column = static_cast<std::uint32_t>(p - begin) + 1;
  for (std::size_t k = 0; k < l.count; ++k) {
    if (*p != l.letter[k]) return nullptr;
    p = take_four_decimals(p + 1, l.value[k]);
    if (p == nullptr) return nullptr;
    p += *p == ' ' ? 1 : 0;
  }
  if (*p != '\n') return nullptr;
  l.feed = l.feed_at < l.count ? l.value[l.feed_at] : feed_of_silent_line();
  return put_run_line(column) ? p + 1 : nullptr;
}

const char* RunReader::take_run_line(const char* const begin, const char* const end) {
  using Kind = SimpleWords::Letter::Kind;
  RunLine& l = line_;
  l = {};
  l.feed = feed_of_silent_line();
  const char* p = skip_run_number(begin);
  if (p == nullptr) return nullptr;
  std::uint32_t column = 0;
  four_decimals_ = false;
  bool all_four = true;
  Number number;
  while (*p != '\n') {
    const SimpleWords::Letter word = s_.language.simple.letters[static_cast<unsigned char>(*p)];
    const bool is_axis = word.kind == Kind::axis;
    if (!is_axis && (word.kind != Kind::feed || l.feed_at < kRunWords)) return nullptr;
    const char* const behind = take_number(p + 1, end, number);
    if (behind == nullptr) return nullptr;
    std::int64_t quanta = 0;
    const int decimals = is_axis ? word.decimals : s_.c.numbers.feed.decimals(s_.modal.feed_mode);
    if (is_axis) {
      if ((l.mask & AxisWords::bit(word.axis)) != 0) return nullptr;
      if (!to_quanta(number, decimals, quanta) || !fits(quanta)) return nullptr;
      if (s_.c.numbers.point_required && !number.has_point && quanta != 0) return nullptr;
      l.mask = static_cast<std::uint16_t>(l.mask | AxisWords::bit(word.axis));
      l.value[l.count] = static_cast<std::int32_t>(quanta);
      if (column == 0) column = static_cast<std::uint32_t>(p - begin) + 1;
    } else {
      if (!to_rounded_quanta(number, decimals, l.feed) || s_.wants_point_of_feed(number)) return nullptr;
      l.feed_at = l.count;
    }
    all_four = all_four && decimals == kRunDecimals;
    l.decimals[l.count] = static_cast<std::int8_t>(decimals);
    l.axis[l.count] = word.axis;
    l.letter[l.count++] = *p;
    p = behind;
    while (*p == ' ') ++p;
    if (*p == '\r' && p[1] == '\n') ++p;
  }
  if (!put_run_line(column)) return nullptr;
  four_decimals_ = all_four && l.feed_at != 0;  // else no pattern for the lines that follow
  return p + 1;
}

bool RunReader::put_run_line(std::uint32_t column) {
  MotionRun& r = run_;
  RunLine& l = line_;
  const std::size_t n = r.count;
  const auto mask = static_cast<std::uint16_t>(s_.modal.position.mask | l.mask);
  if (l.mask == 0 || l.feed <= 0 || (n > 0 && mask != r.mask)) return false;
  if (s_.c.rotary.modulo_axes != 0 && !unwrap_run_line()) return false;
  for (std::size_t k = 0; k < l.count; ++k) {
    if (k != l.feed_at) r.quanta[index(l.axis[k])][n] = l.value[k];
  }
  for (unsigned rest = static_cast<unsigned>(mask & ~l.mask); rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    r.quanta[i][n] = n > 0 ? r.quanta[i][n - 1] : static_cast<std::int32_t>(s_.modal.position.quanta[i]);
  }
  s_.modal.position.mask = mask;
  r.mask = mask;
  s_.feed = l.feed;
  r.feed[r.count] = l.feed;
  r.source[r.count] = {++s_.findings.line, column};
  ++r.count;
  return true;
}

// The way of a modulo axis begins where the line before it ended.
bool RunReader::unwrap_run_line() {
  RunLine& l = line_;
  for (std::size_t k = 0; k < l.count; ++k) {
    if (k == l.feed_at || !s_.c.rotary.is_modulo(l.axis[k])) continue;
    const std::int64_t turned = s_.unwrapped(l.axis[k], l.value[k]);
    if (!fits(turned)) return false;
    l.value[k] = static_cast<std::int32_t>(turned);
  }
  for (std::size_t k = 0; k < l.count; ++k) {
    if (k != l.feed_at) s_.modal.position.quanta[index(l.axis[k])] = l.value[k];
  }
  return true;
}

const char* RunReader::take_laid_out(const char* p, const char* end) {
  if (!has_layouts_ || run_.count == 0 || end - p < kLineReads) return p;
  if (const char* const behind = take_of_layout(layouts_[last_], p, end); behind != p) return behind;
  const char* const words = skip_run_number(p);
  if (words == nullptr || end - words < kLineReads) return p;
  const std::uint64_t digits = RunLayout::digits_at(words);
  for (std::size_t i = 0; i < layouts_.size(); ++i) {
    if (i == last_ || !layouts_[i].may_be(digits)) continue;
    const char* const behind = take_of_layout(layouts_[i], p, end);
    if (behind == p) continue;
    last_ = i;
    return behind;
  }
  return p;
}

const char* RunReader::take_of_layout(const RunLayout& layout, const char* p, const char* end) {
  MotionRun& r = run_;
  if ((layout.mask() & ~r.mask) != 0) return p;
  const std::size_t first = r.count;
  const std::string& prefix = s_.c.block_numbers.prefix;
  const char* const behind = layout.read(p, end, prefix.empty() ? '\0' : prefix.front(), s_.findings.line, r);
  if (behind == p) return p;
  const auto repeat = [&](auto& column) {
    std::fill(column.begin() + static_cast<std::ptrdiff_t>(first),
              column.begin() + static_cast<std::ptrdiff_t>(r.count), column[first - 1]);
  };
  for (unsigned rest = static_cast<unsigned>(r.mask & ~layout.mask()); rest != 0; rest &= rest - 1)
    repeat(r.quanta[static_cast<std::size_t>(std::countr_zero(rest))]);
  if (!layout.has_feed()) repeat(r.feed);
  s_.feed = r.feed[r.count - 1];
  return behind;
}

void RunReader::learn_layout(const char* p, const char* behind, const char* end) {
  const bool keeps_feed =
      !(s_.modal.feed_mode == FeedMode::inverse_time && s_.c.feed.inverse_time_every_block);
  const char* const words = p + (run_.source[run_.count - 1].column - 1);
  if (!has_layouts_ || end - words < kLineReads || (line_.feed_at == kRunWords && !keeps_feed)) return;
  next_ = (next_ + 1) % layouts_.size();
  if (layouts_[next_].learn(words, behind, line_)) last_ = next_;
}

std::size_t RunReader::read(std::string_view text) {
  if (!may_begin()) return 0;
  const std::size_t last = text.rfind('\n');
  if (last == std::string_view::npos) return 0;
  run_.count = 0;
  // The decimals of F are those of its mode.
  if (std::exchange(run_.feed_mode, s_.modal.feed_mode) != s_.modal.feed_mode) layouts_ = {};
  four_decimals_ = false;
  const char* p = text.data();
  const char* const end = p + last + 1;
  while (run_.count < MotionRun::kMost && p != end) {
    if (const char* const behind = take_laid_out(p, end); behind != p) {
      p = behind;
      continue;
    }
    const char* behind = take_same_words(p, end);
    if (behind == nullptr) behind = take_run_line(p, end);
    if (behind == nullptr) break;
    learn_layout(p, behind, end);
    p = behind;
  }
  if (run_.count == 0) return 0;
  for (unsigned rest = run_.mask; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    s_.modal.position.quanta[i] = run_.quanta[i][run_.count - 1];
  }
  s_.check_size_of_feeds(run_);
  sink_(run_);
  return static_cast<std::size_t>(p - text.data());
}

}  // namespace trunnion::nc
