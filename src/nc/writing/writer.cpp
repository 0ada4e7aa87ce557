#include "trunnion/nc/writer.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/writing/writer_state.hpp"

// Lines and motion blocks.
namespace trunnion::nc {
namespace {

// Longest motion block: 9 axis words and F of at most 26 characters each, block number, motion and feed
// words, separators.
constexpr std::size_t kMotionRoom = 512;
// Words of one block that come from the controller file may be this long together.
constexpr std::size_t kWordRoom = 128;

// Words are so short that a call costs more than the copy.
char* put_text(char* p, const std::string& text) {
  for (const char c : text) *p++ = c;
  return p;
}

constexpr std::uint16_t kZ = AxisWords::bit(AxisLetter::Z);

}  // namespace

Writer::State::State(const Controller& controller, std::string& text)
    : c(controller), out(text), block_number(c.block_numbers.start) {
  modal.length = kUnknown;
  TRUNNION_EXPECTS(c.motion.rapid.size() + c.motion.linear.size() + c.motion.rapid_suffix.size() +
                       c.feed.per_minute.size() + c.feed.inverse_time.size() + c.block_numbers.prefix.size() +
                       16 * c.line.separator.size() <
                   kWordRoom);
}

tl::unexpected<Error> Writer::State::refuse(const std::string& message, SourceRef where) const {
  return fail(ErrorCode::wrong_input, c.name + ": " + message, {}, where);
}

char* Writer::State::put_separator(char* p) const {
  if (c.line.separator.size() != 1) return put_text(p, c.line.separator);
  *p = c.line.separator.front();
  return p + 1;
}

char* Writer::State::put_block_number(char* p) {
  p = put_text(p, c.block_numbers.prefix);
  p = put_unsigned(p, static_cast<std::uint64_t>(block_number));
  p = put_separator(p);
  block_number += c.block_numbers.step;
  if (block_number > c.block_numbers.max) block_number = c.block_numbers.start;
  return p;
}

bool Writer::State::wants_number(const std::string& line) const {
  if (!c.block_numbers.enabled) return false;
  return std::none_of(c.block_numbers.not_before.begin(), c.block_numbers.not_before.end(),
                      [&](const std::string& start) { return line.starts_with(start); });
}

Result<void> Writer::State::put_line(const std::string& line) {
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

Result<void> Writer::State::put_template(const Template& lines_of_template, const Values& values) {
  for (const auto& line : lines_of_template) {
    if (auto done = put_line(render(line, values)); !done) return done;
  }
  return {};
}

tl::unexpected<Error> Writer::State::no_words(const char* what, const std::string& key) const {
  return refuse("the controller file has no words for " + std::string(what) + ": " + key + " in " + c.file +
                ", or in a file of your own with it as 'base'");
}

Result<void> Writer::State::put_words(const Template& words, const Values& values, const char* what,
                                      const std::string& key) {
  if (words.empty()) return no_words(what, key);
  return put_template(words, values);
}

Result<void> Writer::State::put_with_motion(const Template& words, const Values& values, const char* what,
                                            const std::string& key) {
  if (words.empty()) return no_words(what, key);
  due.in_motion.clear();
  for (const auto& line : words) due.in_motion += render(line, values) + c.line.separator;
  if (due.in_motion.size() > kWordRoom) return refuse("words too long: '" + due.in_motion + "'");
  return {};
}

std::string Writer::State::number_text(std::int64_t quanta, const NumberStyle& style) const {
  std::array<char, 32> buffer;
  return {buffer.data(), put_number(buffer.data(), quanta, style)};
}

std::uint16_t Writer::State::changed_axes(const AxisWords& words) const {
  unsigned changed = words.mask & ~static_cast<unsigned>(modal.position.mask);
  for (unsigned rest = words.mask & modal.position.mask; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    changed |= static_cast<unsigned>(modal.position.quanta[i] != words.quanta[i]) << i;
  }
  return static_cast<std::uint16_t>(changed);
}

Result<void> Writer::State::check_turns(const Motion& m, std::uint16_t changed) const {
  for (const AxisLetter letter : {AxisLetter::A, AxisLetter::B, AxisLetter::C}) {
    if ((changed & AxisWords::bit(letter)) == 0 || !modal.position.has(letter) || !c.rotary.is_modulo(letter))
      continue;
    const std::int64_t way = std::abs(m.words[letter] - modal.position[letter]);
    if (2 * way >= forms.turn) {
      return refuse(std::string("axis ") + letter_of(letter) + " turns by " + number_text(way, forms.rotary) +
                        " degrees in one feed block, and the control would take the shorter way",
                    m.source);
    }
  }
  return {};
}

// Why write_motion did not take the feed.
Result<void> Writer::State::refuse_feed(const Motion& m) const {
  if (m.feed <= 0) return refuse("a feed move without feed", m.source);
  const auto mode = static_cast<std::size_t>(m.feed_mode);
  if (forms.largest_feed[mode] == 0) return refuse("the control has no inverse-time feed", m.source);
  return refuse("feed " + number_text(m.feed, forms.feed[mode]) +
                    " is beyond the largest that the control takes, " +
                    number_text(forms.largest_feed[mode], forms.feed[mode]),
                m.source);
}

// Of as many axes as have numbers of eight digits; as put_axes for the rest.
char* Writer::State::put_plain_axes(char* p, const AxisWords& words, unsigned axes) {
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
char* Writer::State::put_axes(char* p, const AxisWords& words, unsigned axes) {
  for (unsigned rest = axes; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    const std::int64_t quanta = words.quanta[i];
    if (quanta > kLargest || quanta < -kLargest) return nullptr;
    modal.position.quanta[i] = quanta;
    p = put_separator(put_axis(p, i, quanta));
  }
  return p;
}

char* Writer::State::put_leading(char* p, const Motion& m, bool with_pending) {
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

char* Writer::State::put_feed(char* p, const Motion& m) {
  const auto mode = static_cast<std::size_t>(m.feed_mode);
  const bool always = m.feed_mode == FeedMode::inverse_time && c.feed.inverse_time_every_block;
  if (!always && feed[mode] == m.feed) return p;
  feed[mode] = m.feed;
  *p++ = 'F';
  p = put_number(p, m.feed, forms.feed[mode]);
  return put_separator(p);
}

Result<void> Writer::State::write_motion(const Motion& m) {
  if (due.setup) {
    if (auto done = flush_setup(true); !done) return done;
  }
  TRUNNION_EXPECTS(started && !ended);
  std::uint16_t changed = changed_axes(m.words);
  if (changed == 0) return {};
  if (!c.clamps.empty()) {
    if (auto done = free_axes(changed); !done) return done;
  }
  if (modal.cycle) {
    if (auto done = end_cycle(); !done) return done;
  }
  if (due.restores()) {
    if (auto done = restore_after_retract(changed); !done) return done;
    changed = changed_axes(m.words);
  }
  if (m.kind == MotionKind::feed && !forms.may_feed(m.feed_mode, m.feed)) return refuse_feed(m);
  if (c.rotary.modulo_axes != 0 && m.kind == MotionKind::feed) {
    if (auto ok = check_turns(m, changed); !ok) return ok;
  }
  // Rotary axes may turn before tool-centre-point control is on; a linear word would mean another point.
  if (!due.in_motion.empty() && due.in_motion_is_tcp && (changed & kLinearAxes) != 0 && (changed & kZ) == 0) {
    return refuse("the first linear motion under tool-centre-point control must say where Z goes", m.source);
  }
  const bool with_pending = !due.in_motion.empty() && (changed & kZ) != 0;
  if (with_pending) {
    modal.position.forget(kLinearAxes);  // from here on they are counted otherwise
    changed = changed_axes(m.words);
  }
  std::array<char, kMotionRoom + 3 * kWordRoom> buffer;
  char* p = buffer.data();
  if (c.block_numbers.enabled) p = put_block_number(p);
  p = put_leading(p, m, with_pending);
  if (!due.cutter.empty() && (changed & kPlaneWords) != 0) {
    p = put_text(p, due.cutter);
    due.cutter.clear();
  }
  p = forms.are_plain ? put_plain_axes(p, m.words, changed) : put_axes(p, m.words, changed);
  if (p == nullptr) return refuse("coordinate too large", m.source);
  modal.position.mask = static_cast<std::uint16_t>(modal.position.mask | changed);
  if (m.kind == MotionKind::feed) {
    p = put_feed(p, m);
  } else if (!c.motion.rapid_suffix.empty()) {
    p = put_separator(put_text(p, c.motion.rapid_suffix));
  }
  p -= c.line.separator.size();
  const auto length_of_line = static_cast<std::size_t>(p - buffer.data());
  if (length_of_line > c.line.max_length) {
    return refuse("a motion block of " + std::to_string(length_of_line) + " characters is longer than the " +
                      std::to_string(c.line.max_length) + " that the control takes",
                  m.source);
  }
  p = put_text(p, c.line.end);
  out.append(buffer.data(), static_cast<std::size_t>(p - buffer.data()));
  ++lines;
  ++motions;
  Result<void> written;  // default-initialised: `{}` would clear the room of an Error first
  return written;
}

Writer::Writer(const Controller& controller, std::string& out)
    : state_(std::make_unique<State>(controller, out)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<void> Writer::write(const Motion& motion) {
  return state_->write_motion(motion);
}
Result<void> Writer::write(const Block& block) {
  return state_->write_block(block);
}
Result<void> Writer::step(AxisLetter axis, std::int64_t distance, std::int64_t feed) {
  return state_->step(axis, distance, feed);
}
std::size_t Writer::lines() const {
  return state_->lines;
}
std::size_t Writer::motions() const {
  return state_->motions;
}

}  // namespace trunnion::nc
