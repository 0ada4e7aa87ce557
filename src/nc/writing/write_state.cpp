#include "nc/writing/write_state.hpp"

#include <algorithm>
#include <bit>

#include "trunnion/base/contract.hpp"

namespace trunnion::nc {

WriteState::WriteState(const Controller& controller, std::string& text)
    : c(controller), out(text), block_number(c.block_numbers.start) {
  modal.length = kUnknown;
  TRUNNION_EXPECTS(c.motion.rapid.size() + c.motion.linear.size() + c.motion.rapid_suffix.size() +
                       c.feed.per_minute.size() + c.feed.inverse_time.size() + c.block_numbers.prefix.size() +
                       16 * c.line.separator.size() <
                   kWordRoom);
}

tl::unexpected<Error> WriteState::refuse(const std::string& message, SourceRef where) const {
  return fail(ErrorCode::wrong_input, c.name + ": " + message, {}, where);
}

char* WriteState::put_separator(char* p) const {
  if (c.line.separator.size() != 1) return put_text(p, c.line.separator);
  *p = c.line.separator.front();
  return p + 1;
}

char* WriteState::put_block_number(char* p) {
  p = put_text(p, c.block_numbers.prefix);
  p = put_unsigned(p, static_cast<std::uint64_t>(block_number));
  p = put_separator(p);
  block_number += c.block_numbers.step;
  if (block_number > c.block_numbers.max) block_number = c.block_numbers.start;
  return p;
}

bool WriteState::wants_number(const std::string& line) const {
  if (!c.block_numbers.enabled) return false;
  return std::none_of(c.block_numbers.not_before.begin(), c.block_numbers.not_before.end(),
                      [&](const std::string& start) { return line.starts_with(start); });
}

Result<void> WriteState::put_line(const std::string& line) {
  const std::size_t begin = out.size();
  if (wants_number(line)) {
    std::array<char, kWordRoom + 24> buffer;
    out.append(buffer.data(), put_block_number(buffer.data()));
  }
  out += line;
  const std::size_t length_of_line = out.size() - begin;
  if (length_of_line > c.line.max_length) {
    out.resize(begin);
    return refuse("a line of " + std::to_string(length_of_line) + " characters is longer than the " +
                  std::to_string(c.line.max_length) + " that the control takes: '" + line.substr(0, 40) +
                  "...'");
  }
  out += c.line.end;
  ++lines;
  return {};
}

Result<void> WriteState::put_template(const Template& lines_of_template, const Values& values) {
  for (const auto& line : lines_of_template) {
    if (auto done = put_line(render(line, values)); !done) return done;
  }
  return {};
}

tl::unexpected<Error> WriteState::no_words(const char* what, const std::string& key) const {
  return refuse("the controller file has no words for " + std::string(what) + ": " + key + " in " + c.file +
                ", or in a file of your own with it as 'base'");
}

Result<void> WriteState::put_words(const Template& words, const Values& values, const char* what,
                                   const std::string& key) {
  if (words.empty()) return no_words(what, key);
  return put_template(words, values);
}

std::string WriteState::number_text(std::int64_t quanta, const NumberStyle& style) const {
  std::array<char, 32> buffer;
  return {buffer.data(), put_number(buffer.data(), quanta, style)};
}

std::uint16_t WriteState::changed_axes(const AxisWords& words) const {
  unsigned changed = words.mask & ~static_cast<unsigned>(modal.position.mask);
  for (unsigned rest = words.mask & modal.position.mask; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    changed |= static_cast<unsigned>(modal.position.quanta[i] != words.quanta[i]) << i;
  }
  return static_cast<std::uint16_t>(changed);
}

// Why write_motion did not take the feed.
Result<void> WriteState::refuse_feed(const Motion& m) const {
  if (m.feed <= 0) return refuse("a feed move without feed", m.source);
  const auto mode = static_cast<std::size_t>(m.feed_mode);
  if (forms.largest_feed[mode] == 0) return refuse("the control has no inverse-time feed", m.source);
  return refuse("feed " + number_text(m.feed, forms.feed[mode]) +
                    " is beyond the largest that the control takes, " +
                    number_text(forms.largest_feed[mode], forms.feed[mode]),
                m.source);
}

// Of as many axes as have numbers of eight digits; as put_axes for the rest.
char* WriteState::put_plain_axes(char* p, const AxisWords& words, unsigned axes) {
  const char separator = c.line.separator.front();
  for (unsigned rest = axes; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    const std::int64_t quanta = words.quanta[i];
    // Both ends in one comparison.
    if (static_cast<std::uint64_t>(quanta) + kEightDigits - 1 >= 2 * kEightDigits - 1)
      return put_axes(p, words, rest);
    modal.position.quanta[i] = quanta;
    *p = letter_of(kAllAxisLetters[i]);
    p = put_eight_digits(p + 1, static_cast<std::int32_t>(quanta));
    *p++ = separator;
  }
  return p;
}

// The words of these axes, a separator behind each; null when a number is too large for the control.
char* WriteState::put_axes(char* p, const AxisWords& words, unsigned axes) {
  for (unsigned rest = axes; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    const std::int64_t quanta = words.quanta[i];
    if (quanta > kLargest || quanta < -kLargest) return nullptr;
    modal.position.quanta[i] = quanta;
    p = put_separator(put_axis(p, i, quanta));
  }
  return p;
}

char* WriteState::put_leading(char* p, const Motion& m, bool with_pending) {
  if (m.kind == MotionKind::feed && m.feed_mode != modal.feed_mode) {
    const auto& word = m.feed_mode == FeedMode::inverse_time ? c.feed.inverse_time : c.feed.per_minute;
    if (!word.empty()) p = put_separator(put_text(p, word));
    modal.feed_mode = m.feed_mode;
    feed = {kUnknown, kUnknown};
  }
  if (!c.motion.modal || modal.motion_kind != m.kind) {
    p = put_text(p, m.kind == MotionKind::rapid ? c.motion.rapid : c.motion.linear);
    p = put_separator(p);
    modal.motion_kind = m.kind;
  }
  if (with_pending) {
    p = put_text(p, due.in_motion);
    due.in_motion.clear();
  }
  return p;
}

char* WriteState::put_feed(char* p, const Motion& m) {
  const auto mode = static_cast<std::size_t>(m.feed_mode);
  const bool always = m.feed_mode == FeedMode::inverse_time && c.feed.inverse_time_every_block;
  if (!always && feed[mode] == m.feed) return p;
  feed[mode] = m.feed;
  *p++ = 'F';
  p = put_number(p, m.feed, forms.feed[mode]);
  return put_separator(p);
}

}  // namespace trunnion::nc
