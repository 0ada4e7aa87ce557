#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "trunnion/nc/writer.hpp"

#include "nc/control/number_forms.hpp"
#include "nc/control/templates.hpp"
#include "nc/digits.hpp"
#include "nc/modal_state.hpp"
#include "nc/writing/words_due.hpp"

namespace trunnion::nc {

/// Longest motion block: 9 axis words and F of at most 26 characters each, block number, motion and feed
/// words, separators.
inline constexpr std::size_t kMotionRoom = 512;
/// Words of one block that come from the controller file may be this long together.
inline constexpr std::size_t kWordRoom = 128;

/// Words are so short that a call costs more than the copy.
inline char* put_text(char* p, const std::string& text) {
  for (const char c : text) *p++ = c;
  return p;
}

/// What the control knows after the text so far, and how lines and words become text. The reader follows the
/// same modal state.
struct WriteState {
  WriteState(const Controller& controller, std::string& text);

  const Controller& c;
  std::string& out;
  NumberForms forms{c};
  ModalState modal{c};
  std::array<std::int64_t, 2> feed = {kUnknown, kUnknown};
  bool started = false;
  bool ended = false;
  WordsDue due;
  std::int64_t block_number;
  std::size_t lines = 0;
  std::size_t motions = 0;

  tl::unexpected<Error> refuse(const std::string& message, SourceRef where = {}) const;

  // Lines.
  char* put_separator(char* p) const;
  char* put_block_number(char* p);
  bool wants_number(const std::string& line) const;
  Result<void> put_line(const std::string& line);
  Result<void> put_template(const Template& lines_of_template, const Values& values);
  /// `what` in words, and the key of the controller file, for the message where there are none.
  tl::unexpected<Error> no_words(const char* what, const std::string& key) const;
  Result<void> put_words(const Template& words, const Values& values, const char* what,
                         const std::string& key);
  std::string number_text(std::int64_t quanta, const NumberStyle& style) const;

  // Words of a motion.
  std::uint16_t changed_axes(const AxisWords& words) const;
  Result<void> refuse_feed(const Motion& m) const;
  char* put_axis(char* p, std::size_t i, std::int64_t quanta) const {
    const AxisLetter letter = kAllAxisLetters[i];
    *p++ = letter_of(letter);
    if (c.rotary.modulo_axes == 0 || !c.rotary.is_modulo(letter))
      return put_number(p, quanta, forms.of_axis(letter));
    quanta %= forms.turn;
    if (quanta < 0) quanta += forms.turn;
    p = std::copy(c.rotary.modulo_open.begin(), c.rotary.modulo_open.end(), p);
    p = put_number(p, quanta, forms.rotary);
    return std::copy(c.rotary.modulo_close.begin(), c.rotary.modulo_close.end(), p);
  }
  char* put_axes(char* p, const AxisWords& words, unsigned axes);
  char* put_plain_axes(char* p, const AxisWords& words, unsigned axes);
  /// Motion word, words that wait for a motion, feed mode: in this order in front of the axis words.
  char* put_leading(char* p, const Motion& m, bool with_pending);
  char* put_feed(char* p, const Motion& m);
};

}  // namespace trunnion::nc
