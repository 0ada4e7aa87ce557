#include "nc/reading/control_language.hpp"

#include "nc/reading/plain_number.hpp"

namespace trunnion::nc {

ControlLanguage::ControlLanguage(const Controller& c, const ReaderOptions& options, Diagnostics& diagnostics)
    : format(c.numbers.axes),
      turn(format.turn()),
      patterns(compile_patterns(c, diagnostics)),
      scanner(c, patterns, options.others) {
  if (options.others) others.emplace(c, format);
  for (const auto& p : patterns.words) {
    if (p.words.size() == 1) note_simple(p, options.whole_program);
    for (const auto& w : p.words) {
      if (!w.is_fixed && (w.placeholder == Placeholder::tool || w.placeholder == Placeholder::rpm)) {
        simple.kept[static_cast<std::size_t>(w.letter - '@') & 31U] =
            static_cast<std::uint8_t>(w.placeholder) + 1;
      }
    }
  }
  note_plain_words(c);
}

void ControlLanguage::note_simple(const Pattern& p, bool whole_program) {
  // Lines of templates of several lines are followed.
  if (whole_program && (p.is_part || p.is_other)) return;
  const auto& w = p.words.front();
  const std::size_t code = SimpleWords::place_of(w.number);
  if (!w.is_fixed || code == SimpleWords::kCodes || (w.letter != 'G' && w.letter != 'M')) return;
  if (others && others->claims(w.letter, w.number)) return;
  SimpleWords::Code means = SimpleWords::Code::no;
  if (p.event.kind == EventKind::silent)
    means = p.counts == Counts::absolute ? SimpleWords::Code::absolute : SimpleWords::Code::silent;
  if (p.event == Event{EventKind::motion, static_cast<int>(MotionKind::rapid)})
    means = SimpleWords::Code::rapid;
  if (p.event == Event{EventKind::motion, static_cast<int>(MotionKind::feed)})
    means = SimpleWords::Code::linear;
  if (p.event == Event{EventKind::feed_mode, static_cast<int>(FeedMode::per_minute)})
    means = SimpleWords::Code::per_minute;
  if (p.event == Event{EventKind::feed_mode, static_cast<int>(FeedMode::inverse_time)})
    means = SimpleWords::Code::inverse_time;
  (w.letter == 'G' ? simple.g : simple.m)[code] = means;
}

void ControlLanguage::note_plain_words(const Controller& c) {
  using Kind = SimpleWords::Letter::Kind;
  const auto note = [&](char letter, const SimpleWords::Letter& word) {
    if (!scanner.begins_other(letter)) simple.letters[static_cast<unsigned char>(letter)] = word;
  };
  for (const AxisLetter axis : kAllAxisLetters)
    if (!c.rotary.has_modulo_word(axis))
      note(letter_of(axis), {Kind::axis, axis, static_cast<std::int8_t>(format.decimals(axis))});
  note('F', {Kind::feed, {}, 0});
  note('G', {Kind::code, {}, 0});
  note('M', {Kind::code, {}, 0});
  // X[...] and the like are read word by word; an opening that looks like a number would hide behind one.
  if (!c.run_time.open.empty() && begins_number(c.run_time.open.front())) simple.letters = {};
}

}  // namespace trunnion::nc
