#include "nc/writing/run_writer.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace trunnion::nc {
namespace {

constexpr std::size_t kAxes = RunBlock::kAxes;
// So many blocks are put together before they go to the text.
constexpr std::size_t kTogether = 64;
// Longest block: five words of eleven characters, F, a block number, and what the copies write beyond.
constexpr std::size_t kBlockRoom = 128;
constexpr std::size_t kLongest = 96;

bool words_fit(const RunBlock& block) {
  constexpr std::uint32_t kMost = kEightDigits - 1;
  bool fits = true;
  for (const std::int32_t quanta : block.words)
    fits &= static_cast<std::uint32_t>(quanta) + kMost <= 2 * kMost;
  return fits;
}

}  // namespace

/// What does not change from block to block, and the last block.
struct RunWriter::Run {
  // A few characters, copied as eight.
  struct Affix {
    static constexpr std::size_t kRoom = 8;
    std::array<char, kRoom> text{};
    std::size_t size = 0;

    explicit Affix(const std::string& from) : size(from.size()) {
      std::copy_n(from.begin(), std::min(size, kRoom), text.begin());
    }
    char* put(char* p) const {
      std::memcpy(p, text.data(), kRoom);
      return p + size;
    }
  };

  Affix prefix, end;
  std::array<std::array<char, 2>, kAxes> names{};  // a separator, the letter
  char separator = ' ';
  NumberStyle feed_style{};
  bool feed_always = false;
  bool numbered = false;
  std::int32_t most_feed = 0;
  RunBlock before;

  explicit Run(const Controller& c) : prefix(c.block_numbers.prefix), end(c.line.end) {}

  /// The words of a block, a separator before each.
  char* put(char* p, const RunBlock& block) const {
#pragma GCC unroll 5
    for (std::size_t k = 0; k < kAxes; ++k) {
      const std::int32_t quanta = block.words[k];
      if (quanta == before.words[k]) continue;
      std::memcpy(p, names[k].data(), 2);
      p = put_eight_digits(p + 2, quanta);
    }
    return p;
  }
  char* put_feed(char* p, std::int32_t feed) {
    if (feed == before.feed && !feed_always) return p;
    *p++ = separator;
    *p++ = 'F';
    return put_number(p, feed, feed_style);
  }
};

// A motion is nothing but its words: all of them known, the same motion word and feed mode as before.
bool RunWriter::takes(const std::array<AxisLetter, kAxes>& letters, FeedMode mode) const {
  bool goes = s_.forms.are_plain && s_.started && !s_.ended && s_.due.none() && !s_.modal.cycle &&
              s_.modal.clamped == 0 && s_.c.motion.modal && s_.modal.motion_kind == MotionKind::feed &&
              s_.modal.feed_mode == mode && s_.c.line.max_length >= kLongest && !s_.c.line.end.empty() &&
              s_.c.line.end.size() <= Run::Affix::kRoom &&
              s_.c.block_numbers.prefix.size() <= Run::Affix::kRoom &&
              s_.c.block_numbers.max < kEightDigits && s_.c.block_numbers.start >= 0 &&
              s_.feed[static_cast<std::size_t>(mode)] <= std::numeric_limits<std::int32_t>::max();
  for (std::size_t i = 0; i < kAxes && goes; ++i) {
    const std::int64_t at = s_.modal.position[letters[i]];
    goes = s_.modal.position.has(letters[i]) && at < kEightDigits && at > -kEightDigits &&
           (i == 0 || letters[i - 1] < letters[i]);
  }
  return goes;
}

RunWriter::Run RunWriter::begin(const std::array<AxisLetter, kAxes>& letters, FeedMode mode) const {
  const auto of = static_cast<std::size_t>(mode);
  Run run(s_.c);
  run.separator = s_.c.line.separator.front();
  run.feed_style = s_.forms.feed[of];
  run.feed_always = mode == FeedMode::inverse_time && s_.c.feed.inverse_time_every_block;
  run.numbered = s_.c.block_numbers.enabled;
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  run.most_feed = static_cast<std::int32_t>(std::min(s_.forms.largest_feed[of], kMost));
  for (std::size_t k = 0; k < kAxes; ++k) {
    run.names[k] = {run.separator, letter_of(letters[k])};
    run.before.words[k] = static_cast<std::int32_t>(s_.modal.position[letters[k]]);
  }
  run.before.feed = static_cast<std::int32_t>(s_.feed[of]);
  return run;
}

// As many as there is room for, up to the first that is not plain.
std::size_t RunWriter::put_together(Run& run, std::span<const RunBlock> blocks) {
  std::array<char, 1 + kTogether * kBlockRoom> buffer;
  char* const text = buffer.data() + 1;
  char* p = text;
  std::size_t done = 0;
  const std::size_t most = std::min(blocks.size(), kTogether);
  for (; done < most; ++done) {
    const RunBlock& block = blocks[done];
    if (!words_fit(block) || block.feed <= 0 || block.feed > run.most_feed) break;
    // Without a number the first separator stands where the line before ends.
    char* const words = run.numbered
                            ? put_number_word(run.prefix.put(p), static_cast<std::uint32_t>(s_.block_number))
                            : p - 1;
    char* const behind = run.put(words, block);
    if (behind == words) break;
    if (!run.numbered) *words = run.end.text[run.end.size - 1];
    p = run.end.put(run.put_feed(behind, block.feed));
    run.before = block;
    if (!run.numbered) continue;
    s_.block_number += s_.c.block_numbers.step;
    if (s_.block_number > s_.c.block_numbers.max) s_.block_number = s_.c.block_numbers.start;
  }
  s_.out.append(text, static_cast<std::size_t>(p - text));
  return done;
}

std::size_t RunWriter::write(const std::array<AxisLetter, kAxes>& letters, FeedMode mode,
                             std::span<const RunBlock> blocks) {
  if (!takes(letters, mode)) return 0;
  Run run = begin(letters, mode);
  std::size_t done = 0;
  for (std::size_t more = kTogether; more == kTogether && done < blocks.size();) {
    more = put_together(run, blocks.subspan(done));
    done += more;
  }
  if (done == 0) return 0;
  for (std::size_t k = 0; k < kAxes; ++k) s_.modal.position.quanta[index(letters[k])] = run.before.words[k];
  s_.feed[static_cast<std::size_t>(mode)] = run.before.feed;
  s_.lines += done;
  s_.motions += done;
  return done;
}

}  // namespace trunnion::nc
