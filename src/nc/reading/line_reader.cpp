// Lines, their words, and motion.
#include "nc/reading/line_reader.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "nc/control/comment_text.hpp"
#include "nc/digits.hpp"
#include "nc/reading/plain_number.hpp"

namespace trunnion::nc {
namespace {

constexpr std::uint8_t kNoAxis = 0xff;

// Axis number of each capital letter.
constexpr auto kAxisOfLetter = [] {
  std::array<std::uint8_t, 32> out{};
  for (auto& v : out) v = kNoAxis;
  for (const AxisLetter letter : kAllAxisLetters) {
    out[static_cast<std::size_t>(letter_of(letter) - '@')] = static_cast<std::uint8_t>(letter);
  }
  return out;
}();
std::uint8_t axis_of(char letter) {
  return kAxisOfLetter[static_cast<std::size_t>(letter - '@') & 31U];
}

constexpr const char* kOtherOfGroup =
    "' and another word of the same modal group in one block: controls differ in which one applies";

// Words of one group change the same state. Of others each counts for itself.
EventKind group_of(EventKind kind, const Controller& c) {
  switch (kind) {
    case EventKind::length_off:
    case EventKind::length_or_tcp_off:
      return EventKind::length_on;
    case EventKind::tcp_on:
    case EventKind::tcp_off:
      return c.tcp.replaces_length ? EventKind::length_on : EventKind::tcp_on;
    case EventKind::plane_off:
      return EventKind::plane_on;
    case EventKind::cycle_off:
      return EventKind::cycle;
    default:
      return kind;
  }
}

// Whether both can hold: two kinds of coolant, clamps of two axes.
bool exclude(const Event& a, const Event& b, const Controller& c) {
  if (a == b || group_of(a.kind, c) != group_of(b.kind, c)) return false;
  switch (group_of(a.kind, c)) {
    case EventKind::spindle:
    case EventKind::length_on:
    case EventKind::tcp_on:
    case EventKind::work_offset:
    case EventKind::path_mode:
    case EventKind::plane_on:
    case EventKind::cutter:
    case EventKind::cycle_return:
    case EventKind::cycle:
    case EventKind::arc:
      return true;
    case EventKind::clamp:
      return a.argument / 2 == b.argument / 2;
    case EventKind::coolant:
      return a.argument == static_cast<int>(CoolantKind::off) ||
             b.argument == static_cast<int>(CoolantKind::off);
    default:
      return false;
  }
}

// G02 as G2: how the controller file names it.
std::string plain_text(const Word& word) {
  std::string out(1, word.letter);
  std::array<char, 32> buffer;
  if (word.number.decimals > kMaxDecimals) return out;
  return out.append(buffer.data(),
                    put_number(buffer.data(), word.number.mantissa, {word.number.decimals, false}));
}

}  // namespace

std::string LineReader::text_of(const Word& word) const {
  return {parsed_.begin + word.column - 1, word.length};
}

void LineReader::unknown_word(const Word& word) {
  const std::string text = text_of(word);
  const auto it = s_.c.refused.find(plain_text(word));
  s_.error(word.column, it != s_.c.refused.end()
                            ? text + ": " + it->second
                            : "'" + text + "' is not known to " + s_.c.name + " (" + s_.c.file + ")");
}

// On a control that wants a modulo axis told otherwise its plain word means something else.
bool LineReader::is_word_of(const Word& word, AxisLetter letter, std::int64_t quanta) const {
  if (!s_.c.rotary.has_modulo_word(letter)) return true;
  if (s_.language.others && !word.modulo &&
      (word.means == Word::Means::way ||
       (s_.language.others->in_increments() && word.means != Word::Means::place)))
    return true;
  return (word.modulo || s_.language.others) && quanta >= 0 && quanta < s_.language.turn;
}

bool LineReader::take_axis(Word& word, std::uint8_t axis, LineMotion& m) {
  const auto letter = static_cast<AxisLetter>(axis);
  if (m.words.has(letter)) {
    s_.error(word.column, std::string("two ") + word.letter + " words in one block");
    return false;
  }
  std::int64_t quanta = 0;
  if (!to_quanta(word.number, s_.language.format.decimals(letter), quanta)) {
    s_.error(word.column, "'" + text_of(word) + "' has more decimals than " +
                              std::to_string(s_.language.format.decimals(letter)) + ", or is too large");
    return false;
  }
  if (s_.c.numbers.point_required && !word.number.has_point && quanta != 0) {
    s_.error(word.column, "'" + text_of(word) +
                              "' has no decimal point: the control would take it for a number of increments");
    return false;
  }
  if (!is_word_of(word, letter, quanta)) {
    s_.error(word.column, "'" + text_of(word) + "': axis " + letter_of(letter) +
                              " counts modulo one turn and is written as " + letter_of(letter) +
                              s_.c.rotary.modulo_open + "0 to below 360" + s_.c.rotary.modulo_close);
    return false;
  }
  m.words.set(letter, quanta);
  if (s_.c.rotary.has_modulo_word(letter) && !word.modulo) m.means.straight |= AxisWords::bit(letter);
  // The shorter way to a place, under increments too.
  if (word.means == Word::Means::place || word.modulo) m.means.places |= AxisWords::bit(letter);
  if (word.means == Word::Means::way) m.means.ways |= AxisWords::bit(letter);
  if (m.column == 0) m.column = word.column;
  word.used = true;
  return true;
}

bool LineReader::contradicts(const Word& word, const LineMotion& m) const {
  using Code = SimpleWords::Code;
  switch (s_.language.simple.code(word.letter, word.number)) {
    case Code::rapid:
      return m.kind == MotionKind::feed;
    case Code::linear:
      return m.kind == MotionKind::rapid;
    case Code::per_minute:
      return m.mode == FeedMode::inverse_time;
    case Code::inverse_time:
      return m.mode == FeedMode::per_minute;
    default:
      return false;
  }
}

bool LineReader::take_simple(Word& word, LineMotion& m) {
  if (!s_.language.others && contradicts(word, m)) return false;
  switch (s_.language.simple.code(word.letter, word.number)) {
    case SimpleWords::Code::no:
      return false;
    case SimpleWords::Code::silent:
      break;
    case SimpleWords::Code::absolute:
      m.absolute = true;
      break;
    case SimpleWords::Code::rapid:
      set_kind(MotionKind::rapid, m);
      break;
    case SimpleWords::Code::linear:
      set_kind(MotionKind::feed, m);
      break;
    case SimpleWords::Code::per_minute:
      m.mode = FeedMode::per_minute;
      break;
    case SimpleWords::Code::inverse_time:
      m.mode = FeedMode::inverse_time;
      break;
  }
  word.used = true;
  return true;
}

void LineReader::set_kind(MotionKind kind, LineMotion& m) {
  if (s_.language.others && m.named && m.kind && *m.kind != kind)
    s_.error(
        1,
        "a rapid and a motion at a feed in one block: which of them counts differs from control to control");
  m.kind = kind;
  m.named = true;
}

void LineReader::take_modes(LineMotion& m) {
  if (m.kind) s_.modal.motion_kind = m.kind;
  if (m.mode && s_.language.others && s_.language.others->per_revolution()) {
    s_.language.others->end_per_revolution();
    s_.feed = 0;
  }
  if (m.mode) s_.set_feed_mode(*m.mode);
  if (m.has_feed) s_.check_point_of_feed(m.feed, std::max(m.column, 1U));
  if (m.has_feed && m.feed.mantissa <= 0 && s_.program.frame)
    s_.error(std::max(m.column, 1U), "F is not above 0");
  if (s_.language.others && s_.language.others->per_revolution()) {
    if (m.has_feed) s_.language.others->set_feed_of_turn(m.feed);
    return;
  }
  if (!m.has_feed) {
    if (s_.modal.feed_mode == FeedMode::inverse_time && s_.c.feed.inverse_time_every_block) s_.feed = 0;
    return;
  }
  if (!to_rounded_quanta(m.feed, s_.c.numbers.feed.decimals(s_.modal.feed_mode), s_.feed)) s_.feed = 0;
  // Degrees a minute are no length.
  const bool turns_only = m.words.mask != 0 && (m.words.mask & kLinearAxes) == 0;
  if (s_.language.others && s_.modal.feed_mode == FeedMode::per_minute && !turns_only)
    s_.feed = s_.language.others->length(s_.feed);
  s_.check_size_of_feed(s_.feed, std::max(m.column, 1U));
}

// Where the word of an axis leads that counts modulo one turn.
bool LineReader::wind(AxisLetter letter, const LineMotion& m, std::int64_t& value) {
  if (!s_.c.rotary.is_modulo(letter)) return true;
  if (!s_.language.others || !s_.modal.position.has(letter)) return value = s_.unwrapped(letter, value), true;
  const std::uint16_t bit = AxisWords::bit(letter);
  if ((m.means.ways & bit) != 0 || (s_.language.others->in_increments() && (m.means.places & bit) == 0))
    return true;
  const std::int64_t from = s_.modal.position[letter];
  std::int64_t stands = from % s_.language.turn;
  if (stands < 0) stands += s_.language.turn;
  std::int64_t place = value % s_.language.turn;
  if (place < 0) place += s_.language.turn;
  const std::int64_t way = place - stands;
  bool straight = (m.means.straight & bit) != 0;
  if (!s_.c.rotary.shorter_way.empty()) {
    const auto shorter = s_.language.others->shorter_way();
    if (!shorter && 2 * std::abs(way) > s_.language.turn) {
      s_.error(m.column, std::string("axis ") + letter_of(letter) +
                             " turns by more than half a turn, and the program "
                             "has not said which way ('" +
                             s_.c.rotary.shorter_way + "' or '" + s_.c.rotary.straight_way + "')");
      return false;
    }
    straight = !shorter.value_or(true);
  }
  value = straight ? from + way : s_.unwrapped(letter, value);
  return true;
}

void LineReader::run_motion(LineMotion& m) {
  take_modes(m);
  if (s_.modal.cycle && !m.begins_shape && !shapes_.take_modes_under_cycle(m)) return;
  if (m.words.mask == 0) return;
  if (s_.language.others) {
    if (s_.waits_for_plane()) return;
    note_unit();
    if (m.named) s_.language.others->end_circle();
    if (!m.is_resolved && !s_.language.others->resolve(m.words, m.means, s_.modal.position, m.column))
      return s_.error(m.column, s_.language.others->error);
    if (s_.language.others->per_revolution()) s_.follow_spindle();
  }
  if (!s_.may_move(m.column)) return;
  if (!s_.modal.tcp_known && s_.kinematics_unknown(m.column)) return;
  if (s_.modal.clamped != 0 && turns_clamped(m)) return;
  if (s_.modal.cycle) return shapes_.run_next_hole(m);
  if (!s_.c.motion.modal && !m.named)
    return s_.error(m.column, "axis words without '" + s_.c.motion.linear + "'");
  if (!s_.modal.motion_kind)
    return s_.error(m.column, "axis words before any " + s_.c.motion.rapid + " or " + s_.c.motion.linear);
  auto& motion = std::get<Motion>(motion_block_);
  motion.kind = m.rapid ? MotionKind::rapid : *s_.modal.motion_kind;
  if (motion.kind == MotionKind::feed) {
    if (s_.feed <= 0) {
      if (s_.language.others && s_.language.others->per_revolution())
        return s_.error(m.column, "a feed per revolution ('" + s_.c.input.places.per_revolution +
                                      "') without F, or the spindle does not turn");
      return s_.error(m.column, s_.modal.feed_mode == FeedMode::inverse_time
                                    ? "feed move without F, which inverse time needs in every block"
                                    : "feed move without feed");
    }
    if (s_.spindle_turns_at_nothing(m.column)) return;
    motion.feed_mode = s_.modal.feed_mode;
    motion.feed = s_.feed;
  } else {
    motion.feed_mode = FeedMode::per_minute;
    motion.feed = 0;
  }
  bool turns = false;
  for (unsigned rest = m.words.mask; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    const auto letter = static_cast<AxisLetter>(i);
    std::int64_t value = m.words.quanta[i];
    if (s_.c.rotary.modulo_axes != 0 && !wind(letter, m, value)) return;
    turns = turns ||
            (is_rotary(letter) && (!s_.modal.position.has(letter) || s_.modal.position[letter] != value));
    s_.modal.position.set(letter, value);
  }
  // The zero has gone with the part: Haas (UMC-750 manual, G254) wants X, Y and Z said anew before a cut.
  if (s_.program.follows_part && turns)
    s_.modal.position.forget(static_cast<std::uint16_t>(kLinearAxes & ~m.words.mask));
  motion.words = s_.modal.position;
  motion.source = {s_.findings.line, m.column};
  if (!parsed_.has_values) return s_.emit(motion_block_);
  s_.emit(VariableMotion{motion, parsed_.coefficient});
  s_.modal.position.forget(kLinearAxes);  // where they stand depends on the values
}

void LineReader::read(std::string_view text) {
  ++s_.findings.line;
  if (s_.findings.given_up) return;
  if (s_.findings.line == 1) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark of UTF-8
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
      s_.error(1, "UTF-16 text: save the program as ASCII or UTF-8");
      s_.findings.given_up = true;
      return;
    }
  }
  const char* const begin = text.data();
  const char* end = begin + text.size();
  while (end != begin && is_blank(end[-1])) --end;
  const char* p = s_.language.scanner.skip_block_number(begin, end);
  if (p == end) return;
  if (!s_.options.raw_lines.empty() && is_raw({p, static_cast<std::size_t>(end - p)})) {
    return s_.emit(Raw{std::string(p, end)});
  }
  if (s_.program.tape_line != 0 && !s_.program.ended)
    return s_.error(1, "a block behind the '%' of line " + std::to_string(s_.program.tape_line) +
                           ", at which the control stops reading: is the program whole?");
  if (s_.language.others &&
      (s_.program.ended || is_no_block_of_others({p, static_cast<std::size_t>(end - p)})))
    return;
  if (const auto frame = s_.language.others
                             ? s_.language.others->frame_named({p, static_cast<std::size_t>(end - p)})
                             : std::nullopt)
    return run_frame_line({p, static_cast<std::size_t>(end - p)}, *frame);
  if (s_.language.others &&
      (run_datum_shift({p, static_cast<std::size_t>(end - p)}) || run_pole_line(begin, p, end)))
    return;
  if (s_.language.others && s_.language.others->has_place_name()) {
    std::string line(begin, end);
    if (s_.language.others->take_place_name(line, static_cast<std::size_t>(p - begin)))
      return run_past_offsets(line, static_cast<std::size_t>(p - begin));
  }
  if (std::string numbered;
      s_.language.others && number_tool({p, static_cast<std::size_t>(end - p)}, numbered))
    return read_words(numbered.data(), numbered.data(), numbered.data() + numbered.size());
  read_words(begin, p, end);
}

void LineReader::read_words(const char* begin, const char* p, const char* end) {
  LineMotion plain;
  if (!s_.program.ended && !(s_.program.frame && s_.program.frame->is_head()) &&
      take_plain_motion(begin, p, end, plain)) {
    if (parsed_.has_values) parsed_.clear();
    if (s_.program.increments_since != 0 && !counts_absolute(plain)) return;
    return run_motion(plain);
  }
  parsed_.clear();
  s_.language.scanner.scan(begin, p, end, parsed_);
  if (!parsed_.error.empty()) return s_.error(parsed_.error_column, parsed_.error);
  for (auto& comment : parsed_.comments) {
    const bool marked = comment.starts_with(s_.c.comments.mark);
    if (marked) comment.erase(0, s_.c.comments.mark.size());
    if (!marked && s_.program.frame && acts(s_.c.comments, comment))
      return s_.error(1, "the control executes the comment '" + comment + "'");
    s_.emit(Comment{std::move(comment), marked});
  }
  run_line();
}

bool LineReader::is_raw(std::string_view text) const {
  return std::find(s_.options.raw_lines.begin(), s_.options.raw_lines.end(), text) !=
         s_.options.raw_lines.end();
}

// The only words in increments that are read are those of a retract.
bool LineReader::counts_absolute(const LineMotion& m) {
  if (s_.program.increments_since == s_.findings.line ||
      (parsed_.word_count == 0 && parsed_.phrases.empty() && m.words.mask == 0))
    return true;
  if (m.absolute) {
    s_.program.increments_since = 0;
    return true;
  }
  s_.error(1, "'" + s_.c.incremental.on + "' of line " + std::to_string(s_.program.increments_since) +
                  " is still in force: '" + s_.c.incremental.off + "' is missing");
  return false;
}

void LineReader::run_line() {
  // Almost every line of a program is a motion and nothing else.
  LineMotion m;
  if (s_.program.frame && s_.program.frame->is_head()) note_head();
  if (s_.language.others) return run_line_of_others();
  if (parsed_.phrases.empty() && !s_.program.ended && take_motion(m)) {
    if (s_.program.increments_since != 0 && !counts_absolute(m)) return;
    return run_motion(m);
  }
  if (says_twice()) return;
  m = {};
  for (std::size_t i = 0; i < parsed_.word_count; ++i) parsed_.words[i].used = false;
  const std::vector<FoundEvent> events = find_events(m);
  if (contradict(events) || !take_words(m)) return;
  if (s_.program.increments_since != 0 && !counts_absolute(m)) return;
  if (s_.program.ended && (m.words.mask != 0 || !events.empty())) {
    if (std::all_of(events.begin(), events.end(),
                    [](const auto& e) {
                      return e.event.kind == EventKind::program_end || e.event.kind == EventKind::tape;
                    }) &&
        m.words.mask == 0) {
      return;
    }
    return s_.error(1, "text after the end of the program");
  }
  if (events.empty()) return run_motion(m);
  run_events(events, m);
}

// Without a message: what this does not take may be another kind of line.
bool LineReader::take_motion(LineMotion& m) {
  for (std::size_t i = 0; i < parsed_.word_count; ++i) {
    Word& word = parsed_.words[i];
    if (const auto axis = axis_of(word.letter); axis != kNoAxis) {
      const auto letter = static_cast<AxisLetter>(axis);
      std::int64_t quanta = 0;
      if (m.words.has(letter) || !to_quanta(word.number, s_.language.format.decimals(letter), quanta))
        return false;
      if (s_.c.numbers.point_required && !word.number.has_point && quanta != 0) return false;
      if (!is_word_of(word, letter, quanta)) return false;
      m.words.set(letter, quanta);
      if (m.column == 0) m.column = word.column;
    } else if (word.letter == 'F') {
      if (m.has_feed) return false;
      m.has_feed = true;
      m.feed = word.number;
    } else if (!take_simple(word, m)) {
      return false;
    }
  }
  return true;
}

bool LineReader::take_words(LineMotion& m) {
  for (std::size_t i = 0; i < parsed_.word_count; ++i) {
    Word& word = parsed_.words[i];
    if (word.used) continue;
    if (const auto axis = axis_of(word.letter); axis != kNoAxis) {
      if (!take_axis(word, axis, m)) return false;
    } else if (word.letter == 'F') {
      if (m.has_feed) return s_.error(word.column, "two F words in one block"), false;
      m.has_feed = true;
      m.feed = word.number;
    } else if (!s_.language.others && contradicts(word, m)) {
      return s_.error(word.column, "'" + text_of(word) + kOtherOfGroup), false;
    } else if (!take_simple(word, m) && !keep(word, m)) {
      return unknown_word(word), false;
    }
  }
  return true;
}

// A pattern takes one of them, and what would become of the other no line of a program says.
bool LineReader::says_twice() {
  std::size_t m_words = 0;
  std::size_t feeds = 0;
  for (std::size_t i = 0; i < parsed_.word_count; ++i) {
    const Word& word = parsed_.words[i];
    if (word.letter == 'M' && ++m_words > s_.c.line.m_words && s_.c.line.m_words > 0) {
      s_.error(word.column,
               "'" + text_of(word) + "': the control takes " + std::to_string(s_.c.line.m_words) +
                   " M word in a block and may leave out the others ([line] m_words of " + s_.c.file + ")");
      return true;
    }
    // One may be that of a cycle.
    if (word.letter == 'F' && ++feeds > 1) return s_.error(word.column, "two F words in one block"), true;
    if (s_.language.simple.kept[static_cast<std::size_t>(word.letter - '@') & 31U] == 0) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (parsed_.words[j].letter != word.letter) continue;
      s_.error(word.column, std::string("two ") + word.letter + " words in one block");
      return true;
    }
  }
  return false;
}

bool LineReader::keep(const Word& word, const LineMotion& m) {
  auto placeholder = s_.language.simple.kept[static_cast<std::size_t>(word.letter - '@') & 31U];
  if (placeholder == 0 && s_.language.others && word.letter == 'S')
    placeholder = static_cast<std::uint8_t>(Placeholder::rpm) + 1;
  if (placeholder == 0) return false;
  s_.kept.set(static_cast<Placeholder>(placeholder - 1), word.number);
  if (static_cast<Placeholder>(placeholder - 1) == Placeholder::rpm && !m.changes_tool)
    s_.change_speed(word.number);
  return true;
}

std::vector<FoundEvent> LineReader::find_events(LineMotion& m) {
  std::vector<FoundEvent> events;
  for (auto& phrase : parsed_.phrases) {
    s_.note_pattern(phrase);
    switch (phrase.event.kind) {
      case EventKind::silent:
        break;
      case EventKind::motion:
        set_kind(static_cast<MotionKind>(phrase.event.argument), m);
        break;
      case EventKind::feed_mode:
        m.mode = static_cast<FeedMode>(phrase.event.argument);
        break;
      case EventKind::rapid_suffix:
        m.rapid = true;
        break;
      default:
        events.push_back(std::move(phrase));
    }
  }
  for (const auto& pattern : s_.language.patterns.words) {
    const auto kind = pattern.event.kind;
    if (kind == EventKind::motion || kind == EventKind::feed_mode) continue;  // left to take_simple
    FoundEvent found;
    if (!match_words(pattern, found)) continue;
    found.pattern = &pattern;
    s_.note_pattern(found);
    if (kind == EventKind::rapid_suffix) m.rapid = true;
    if (pattern.counts == Counts::increments) s_.program.increments_since = s_.findings.line;
    m.absolute = m.absolute || pattern.counts == Counts::absolute;
    if (kind != EventKind::silent && kind != EventKind::rapid_suffix) events.push_back(std::move(found));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.event.kind < b.event.kind; });
  m.changes_tool = std::any_of(events.begin(), events.end(),
                               [](const FoundEvent& e) { return e.event.kind == EventKind::tool; });
  return events;
}

void LineReader::note_head() {
  for (std::size_t i = 0; i < parsed_.word_count; ++i)
    s_.program.frame->head(pattern_key(text_of(parsed_.words[i])));
  for (const FoundEvent& phrase : parsed_.phrases) s_.program.frame->head(phrase.pattern->key);
}

bool LineReader::contradict(const std::vector<FoundEvent>& events) {
  for (std::size_t i = 1; i < events.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!exclude(events[j].event, events[i].event, s_.c)) continue;
      const FoundEvent& later = events[j].column > events[i].column ? events[j] : events[i];
      s_.error(later, "'" + later.pattern->origin + kOtherOfGroup);
      return true;
    }
  }
  return false;
}

Word* LineReader::find_word(const PatternWord& wanted) {
  for (std::size_t i = 0; i < parsed_.word_count; ++i) {
    Word& word = parsed_.words[i];
    if (word.letter != wanted.letter || word.used || word.by_name || word.means == Word::Means::way) continue;
    if (!wanted.is_fixed || equal(word.number, wanted.number)) return &word;
  }
  return nullptr;
}

bool LineReader::match_words(const Pattern& pattern, FoundEvent& found) {
  std::array<Word*, kMaxWords> taken{};
  std::size_t n = 0;
  bool any_fixed = false;
  for (const auto& wanted : pattern.words) {
    Word* word = find_word(wanted);
    if (word == nullptr) {
      const bool may_be_kept = !wanted.is_fixed && (wanted.placeholder == Placeholder::tool ||
                                                    wanted.placeholder == Placeholder::rpm);
      if (!may_be_kept) return false;
      continue;
    }
    any_fixed = any_fixed || wanted.is_fixed || pattern.words.size() == 1;
    if (!wanted.is_fixed) found.captures.set(wanted.placeholder, word->number);
    found.column = word->column;
    taken[n++] = word;
  }
  if (!any_fixed) return false;
  for (std::size_t i = 0; i < n; ++i) taken[i]->used = true;
  found.event = pattern.event;
  return true;
}

bool LineReader::acts_last(const FoundEvent& found, const LineMotion& m) const {
  if (!s_.language.others) return false;
  const auto kind = found.event.kind;
  if (kind == EventKind::spindle && m.changes_tool) return true;
  if (s_.c.line.m_words_before_motion) return false;
  return (kind == EventKind::spindle && found.event.argument == static_cast<int>(SpindleTurn::off)) ||
         (kind == EventKind::coolant && found.event.argument == static_cast<int>(CoolantKind::off));
}

bool LineReader::may_start_late(const FoundEvent& found, const LineMotion& m, bool shapes) {
  const bool turns_so =
      s_.modal.spindle && s_.modal.spindle->turn == static_cast<SpindleTurn>(found.event.argument);
  const bool cuts =
      shapes || (m.words.mask != 0 && !m.rapid &&
                 m.kind.value_or(s_.modal.motion_kind.value_or(MotionKind::rapid)) == MotionKind::feed);
  if (turns_so || s_.language.others || s_.c.line.m_words_before_motion || !cuts ||
      found.event.kind != EventKind::spindle || found.event.argument == static_cast<int>(SpindleTurn::off))
    return false;
  s_.error(found,
           "the spindle is started in the block of a cut: some controls do so when the block is done, and "
           "the tool stands in the cut. Start it in a block before");
  return true;
}

void LineReader::run_events(const std::vector<FoundEvent>& events, LineMotion& m) {
  bool moved = false;
  std::vector<const FoundEvent*> behind;
  const auto is_shape_of = [](EventKind kind) {
    return kind == EventKind::arc || kind == EventKind::cycle || kind == EventKind::probe;
  };
  const bool shapes = std::any_of(events.begin(), events.end(),
                                  [&](const FoundEvent& e) { return is_shape_of(e.event.kind); });
  m.begins_shape = shapes;
  for (const auto& found : events) {
    const auto kind = found.event.kind;
    if (acts_last(found, m)) {
      behind.push_back(&found);
      continue;
    }
    if (may_start_late(found, m, shapes)) return;
    if (m.words.mask != 0 && excludes_motion(kind)) {
      return s_.error(m.column, "axis words stand in one block with words that exclude motion");
    }
    // Stops and the end take place when the motion of their block is done.
    if (!moved && kind >= EventKind::stop) {
      run_motion(m);
      for (const FoundEvent* last : std::exchange(behind, {})) events_.run(*last);
      moved = true;
    }
    const bool is_shape = is_shape_of(kind);
    if (is_shape && m.rapid && (kind == EventKind::arc || !s_.language.others))
      return s_.error(found,
                      "'" + s_.c.motion.rapid_suffix + "' in a block that cuts: it would run at rapid rate");
    if (is_shape && m.named) return s_.error(found, "two motion words in one block");
    if (is_shape) take_modes(m);
    events_.run(found);
  }
  if (!moved) run_motion(m);
  for (const FoundEvent* last : behind) events_.run(*last);
}

bool LineReader::excludes_motion(EventKind kind) {
  return kind == EventKind::tool || kind == EventKind::dwell || kind == EventKind::retract ||
         kind == EventKind::offset_shift || kind == EventKind::latch_begin || kind == EventKind::latch ||
         kind == EventKind::run_time_step || kind == EventKind::arc || kind == EventKind::cycle ||
         kind == EventKind::probe || kind == EventKind::plane_on || kind == EventKind::plane_off ||
         kind == EventKind::program_start;
}

// The drive would work against the brake.
bool LineReader::turns_clamped(const LineMotion& m) {
  for (unsigned rest = m.words.mask & s_.modal.clamped; rest != 0; rest &= rest - 1) {
    const auto letter = static_cast<AxisLetter>(std::countr_zero(rest));
    const auto to = s_.c.rotary.modulo_axes != 0 ? s_.unwrapped(letter, m.words[letter]) : m.words[letter];
    if (s_.modal.position.has(letter) && s_.modal.position[letter] == to) continue;
    s_.error(m.column, std::string("axis ") + letter_of(letter) + " turns while it is clamped");
    return true;
  }
  return false;
}

bool LineReader::take_plain_motion(const char* begin, const char* p, const char* end, LineMotion& m) {
  using Kind = SimpleWords::Letter::Kind;
  Number number;
  for (std::size_t count = 0; count <= kMaxWords; ++count) {
    while (p != end && *p == ' ') ++p;
    if (p == end) return true;
    const char letter = *p;
    const SimpleWords::Letter word = s_.language.simple.letters[static_cast<unsigned char>(letter)];
    if (word.kind == Kind::other) return false;
    const char* const behind = take_number(p + 1, end, number);
    if (behind == nullptr || behind > end) return false;
    switch (word.kind) {
      case Kind::axis: {
        std::int64_t quanta = 0;
        if (m.words.has(word.axis) || !to_quanta(number, word.decimals, quanta)) return false;
        if (s_.c.numbers.point_required && !number.has_point && quanta != 0) return false;
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
