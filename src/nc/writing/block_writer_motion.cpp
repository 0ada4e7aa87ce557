// Motion blocks.
#include <cstdlib>

#include "trunnion/base/contract.hpp"

#include "nc/writing/block_writer.hpp"

namespace trunnion::nc {
namespace {

constexpr std::uint16_t kZ = AxisWords::bit(AxisLetter::Z);

}  // namespace

Result<void> BlockWriter::put_with_motion(const Template& words, const Values& values, const char* what,
                                          const std::string& key) {
  if (words.empty()) return s_.no_words(what, key);
  s_.due.in_motion.clear();
  for (const auto& line : words) s_.due.in_motion += render(line, values) + s_.c.line.separator;
  if (s_.due.in_motion.size() > kWordRoom) return s_.refuse("words too long: '" + s_.due.in_motion + "'");
  return {};
}

Result<void> BlockWriter::check_turns(const Motion& m, std::uint16_t changed) const {
  for (const AxisLetter letter : {AxisLetter::A, AxisLetter::B, AxisLetter::C}) {
    if ((changed & AxisWords::bit(letter)) == 0 || !s_.modal.position.has(letter) ||
        !s_.c.rotary.is_modulo(letter))
      continue;
    const std::int64_t way = std::abs(m.words[letter] - s_.modal.position[letter]);
    if (2 * way >= s_.forms.turn) {
      return s_.refuse(std::string("axis ") + letter_of(letter) + " turns by " +
                           s_.number_text(way, s_.forms.rotary) +
                           " degrees in one feed block, and the control would take the shorter way",
                       m.source);
    }
  }
  return {};
}

Result<void> BlockWriter::write(const Motion& m) {
  if (s_.due.setup) {
    if (auto done = flush_setup(true); !done) return done;
  }
  TRUNNION_EXPECTS(s_.started && !s_.ended);
  std::uint16_t changed = s_.changed_axes(m.words);
  if (changed == 0) return {};
  if (!s_.c.clamps.empty()) {
    if (auto done = free_axes(changed); !done) return done;
  }
  if (s_.modal.cycle) {
    if (auto done = shapes_.end_cycle(); !done) return done;
  }
  if (s_.due.restores()) {
    if (auto done = restore_after_retract(changed); !done) return done;
    changed = s_.changed_axes(m.words);
  }
  if (m.kind == MotionKind::feed && !s_.forms.may_feed(m.feed_mode, m.feed)) return s_.refuse_feed(m);
  if (s_.c.rotary.modulo_axes != 0 && m.kind == MotionKind::feed) {
    if (auto ok = check_turns(m, changed); !ok) return ok;
  }
  // Rotary axes may turn before tool-centre-point control is on; a linear word would mean another point.
  if (!s_.due.in_motion.empty() && s_.due.in_motion_is_tcp && (changed & kLinearAxes) != 0 &&
      (changed & kZ) == 0) {
    return s_.refuse("the first linear motion under tool-centre-point control must say where Z goes",
                     m.source);
  }
  const bool with_pending = !s_.due.in_motion.empty() && (changed & kZ) != 0;
  if (with_pending) {
    s_.modal.position.forget(kLinearAxes);  // from here on they are counted otherwise
    changed = s_.changed_axes(m.words);
  }
  std::array<char, kMotionRoom + 3 * kWordRoom> buffer;
  char* p = buffer.data();
  if (s_.c.block_numbers.enabled) p = s_.put_block_number(p);
  p = s_.put_leading(p, m, with_pending);
  if (!s_.due.cutter.empty() && (changed & kPlaneWords) != 0) {
    p = put_text(p, s_.due.cutter);
    s_.due.cutter.clear();
  }
  p = s_.forms.are_plain ? s_.put_plain_axes(p, m.words, changed) : s_.put_axes(p, m.words, changed);
  if (p == nullptr) return s_.refuse("coordinate too large", m.source);
  s_.modal.position.mask = static_cast<std::uint16_t>(s_.modal.position.mask | changed);
  if (m.kind == MotionKind::feed) {
    p = s_.put_feed(p, m);
  } else if (!s_.c.motion.rapid_suffix.empty()) {
    p = s_.put_separator(put_text(p, s_.c.motion.rapid_suffix));
  }
  p -= s_.c.line.separator.size();
  const auto length_of_line = static_cast<std::size_t>(p - buffer.data());
  if (length_of_line > s_.c.line.max_length) {
    return s_.refuse("a motion block of " + std::to_string(length_of_line) +
                         " characters is longer than the " + std::to_string(s_.c.line.max_length) +
                         " that the control takes",
                     m.source);
  }
  p = put_text(p, s_.c.line.end);
  s_.out.append(buffer.data(), static_cast<std::size_t>(p - buffer.data()));
  ++s_.lines;
  ++s_.motions;
  Result<void> written;  // default-initialised: `{}` would clear the room of an Error first
  return written;
}

}  // namespace trunnion::nc
