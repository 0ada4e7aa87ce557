// The lines that make nearly all of a program: a motion, its words in capital letters.
#include "nc/reading/plain_number.hpp"
#include "nc/reading/reader_state.hpp"

namespace trunnion::nc {
void Reader::State::note_plain_words() {
  using Kind = SimpleWords::Letter::Kind;
  const auto note = [&](char letter, const SimpleWords::Letter& word) {
    if (!language.scanner.begins_other(letter))
      language.simple.letters[static_cast<unsigned char>(letter)] = word;
  };
  for (const AxisLetter axis : kAllAxisLetters)
    if (!c.rotary.has_modulo_word(axis))
      note(letter_of(axis), {Kind::axis, axis, static_cast<std::int8_t>(language.format.decimals(axis))});
  note('F', {Kind::feed, {}, 0});
  note('G', {Kind::code, {}, 0});
  note('M', {Kind::code, {}, 0});
  // X[...] and the like are read word by word; an opening that looks like a number would hide behind one.
  if (!c.run_time.open.empty() && begins_number(c.run_time.open.front())) language.simple.letters = {};
}

bool Reader::State::take_plain_motion(const char* begin, const char* p, const char* end, LineMotion& m) {
  using Kind = SimpleWords::Letter::Kind;
  Number number;
  for (std::size_t count = 0; count <= kMaxWords; ++count) {
    while (p != end && *p == ' ') ++p;
    if (p == end) return true;
    const char letter = *p;
    const SimpleWords::Letter word = language.simple.letters[static_cast<unsigned char>(letter)];
    if (word.kind == Kind::other) return false;
    const char* const behind = take_number(p + 1, end, number);
    if (behind == nullptr || behind > end) return false;
    switch (word.kind) {
      case Kind::axis: {
        std::int64_t quanta = 0;
        if (m.words.has(word.axis) || !to_quanta(number, word.decimals, quanta)) return false;
        if (c.numbers.point_required && !number.has_point && quanta != 0) return false;
        m.words.set(word.axis, quanta);
        if (m.column == 0) m.column = static_cast<std::uint32_t>(p - begin) + 1;
        break;
      }
      case Kind::feed:
        if (m.has_feed) return false;
        m.has_feed = true;
        m.feed = number;
        break;
      default: {
        Word code;
        code.letter = letter;
        code.number = number;
        if (!take_simple(code, m)) return false;
      }
    }
    p = behind;
  }
  return false;
}

}  // namespace trunnion::nc
