#include "trunnion/nc/reader.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/printable.hpp"

#include "nc/digits.hpp"
#include "nc/reading/reader_state.hpp"

// Lines and motion.
namespace trunnion::nc {
namespace {

constexpr std::uint8_t kNoAxis = 0xff;
constexpr int kTurnDecimals = 9;  // of a feed per revolution, mm

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

std::size_t code_of(const Number& n) {
  if (n.mantissa < 0 || n.decimals > 1) return SimpleWords::kCodes;
  const auto tenths = static_cast<std::size_t>(n.decimals == 1 ? n.mantissa : 10 * n.mantissa);
  return std::min(tenths, SimpleWords::kCodes);
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

ControlLanguage::ControlLanguage(const Controller& c, const ReaderOptions& options, Diagnostics& diagnostics)
    : format(options.format.value_or(c.numbers.axes)),
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
}

Reader::State::State(const Controller& controller, std::string file_name, Diagnostics& found, Sink out_sink,
                     ReaderOptions opts, RunSink out_runs)
    : c(controller),
      findings{std::move(file_name), found, opts.max_errors,
               "too many errors: is it a program for " + c.name + "?"},
      sink(std::move(out_sink)),
      runs(std::move(out_runs)),
      options(std::move(opts)),
      language(c, options, findings.diagnostics) {
  note_plain_words();
  if (c.cycles.initial_at_start || c.cycles.to_clear.empty()) cycle_return.to_clear = false;
  if (options.whole_program) {
    program.frame.emplace(c, language.patterns);
    modal.length = -1;
  }
  if (options.others) {
    program.holes.emplace(c);
    program.unfolder.emplace(
        c,
        [this](std::string_view text, std::uint32_t number) {
          std::string spelled_out;
          if (spell_out(text, spelled_out)) text = spelled_out;
          const auto read = [&](std::string_view line) {
            findings.line = number - 1;
            read_line(line);
          };
          if (!program.holes->take(text, number, read)) {
            read(text);
          } else if (!program.holes->error.empty()) {
            findings.line = program.holes->error_line;
            error(1, program.holes->error);
          }
          return !program.ended;
        },
        [this](std::uint32_t number, const std::string& message) {
          findings.line = number;
          error(1, message);
        });
  }
  if (runs) at_once.run = std::make_unique<MotionRun>();
  at_once.has_layouts = lanes::four_at_a_time() && c.rotary.modulo_axes == 0;
}

void ControlLanguage::note_simple(const Pattern& p, bool whole_program) {
  // Lines of templates of several lines are followed.
  if (whole_program && (p.is_part || p.is_other)) return;
  const auto& w = p.words.front();
  const auto code = code_of(w.number);
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

void ReadFindings::error(std::uint32_t column, const std::string& message) {
  const SourceRef where{line, column};
  diagnostics.error(file, where, message);
  if (!first) first = Error{ErrorCode::wrong_input, message, file, where};
  if (++errors >= most && !given_up) {
    given_up = true;
    diagnostics.error(file, where, given_up_because);
  }
}

std::string Reader::State::text_of(const Word& word) const {
  return {parsed.begin + word.column - 1, word.length};
}

void Reader::State::unknown_word(const Word& word) {
  const std::string text = text_of(word);
  const auto it = c.refused.find(plain_text(word));
  error(word.column, it != c.refused.end()
                         ? text + ": " + it->second
                         : "'" + text + "' is not known to " + c.name + " (" + c.file + ")");
}

void Reader::State::emit(const Block& block) {
  if (!program.started && !std::holds_alternative<ProgramStart>(block)) emit(ProgramStart{});
  if (std::holds_alternative<ProgramStart>(block)) program.started = true;
  sink(block);
}

// On a control that wants a modulo axis told otherwise its plain word means something else.
bool Reader::State::is_word_of(const Word& word, AxisLetter letter, std::int64_t quanta) const {
  if (!c.rotary.has_modulo_word(letter)) return true;
  if (language.others && !word.modulo &&
      (word.means == Word::Means::way ||
       (language.others->in_increments() && word.means != Word::Means::place)))
    return true;
  return (word.modulo || language.others) && quanta >= 0 && quanta < language.turn;
}

bool Reader::State::take_axis(Word& word, std::uint8_t axis, LineMotion& m) {
  const auto letter = static_cast<AxisLetter>(axis);
  if (m.words.has(letter)) {
    error(word.column, std::string("two ") + word.letter + " words in one block");
    return false;
  }
  std::int64_t quanta = 0;
  if (!to_quanta(word.number, language.format.decimals(letter), quanta)) {
    error(word.column, "'" + text_of(word) + "' has more decimals than " +
                           std::to_string(language.format.decimals(letter)) + ", or is too large");
    return false;
  }
  if (c.numbers.point_required && !word.number.has_point && quanta != 0) {
    error(word.column, "'" + text_of(word) +
                           "' has no decimal point: the control would take it for a number of increments");
    return false;
  }
  if (!is_word_of(word, letter, quanta)) {
    error(word.column, "'" + text_of(word) + "': axis " + letter_of(letter) +
                           " counts modulo one turn and is written as " + letter_of(letter) +
                           c.rotary.modulo_open + "0 to below 360" + c.rotary.modulo_close);
    return false;
  }
  m.words.set(letter, quanta);
  if (c.rotary.has_modulo_word(letter) && !word.modulo) m.means.straight |= AxisWords::bit(letter);
  // The shorter way to a place, under increments too.
  if (word.means == Word::Means::place || word.modulo) m.means.places |= AxisWords::bit(letter);
  if (word.means == Word::Means::way) m.means.ways |= AxisWords::bit(letter);
  if (m.column == 0) m.column = word.column;
  word.used = true;
  return true;
}

bool Reader::State::take_simple(Word& word, LineMotion& m) {
  const auto code = word.letter == 'G' || word.letter == 'M' ? code_of(word.number) : SimpleWords::kCodes;
  if (code == SimpleWords::kCodes) return false;
  switch ((word.letter == 'G' ? language.simple.g : language.simple.m)[code]) {
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

void Reader::State::set_kind(MotionKind kind, LineMotion& m) {
  if (language.others && m.named && m.kind && *m.kind != kind)
    error(
        1,
        "a rapid and a motion at a feed in one block: which of them counts differs from control to control");
  m.kind = kind;
  m.named = true;
}

void Reader::State::set_feed_mode(FeedMode mode) {
  if (mode == modal.feed_mode) return;
  modal.feed_mode = mode;
  feed = 0;
  at_once.layouts = {};
}

// In whole mm a minute alone most controls need none; others have a reason.
void Reader::State::check_point_of_feed(const Number& number, std::uint32_t column) {
  if (!language.others || !c.numbers.point_required || number.has_point || number.mantissa == 0) return;
  const auto reason = c.refused.find("F");
  if (reason != c.refused.end()) return error(column, "F has no decimal point: " + reason->second);
  if (language.others->per_revolution() || language.others->in_inches())
    error(column, "F has no decimal point: the control would take it for a number of increments");
}

void Reader::State::take_modes(LineMotion& m) {
  if (m.kind) modal.motion_kind = m.kind;
  if (m.mode && language.others && language.others->per_revolution()) {
    language.others->end_per_revolution();
    feed = 0;
  }
  if (m.mode) set_feed_mode(*m.mode);
  if (m.has_feed) check_point_of_feed(m.feed, std::max(m.column, 1U));
  if (language.others && language.others->per_revolution()) {
    if (m.has_feed && !to_rounded_quanta(m.feed, kTurnDecimals, language.others->feed_of_turn()))
      language.others->feed_of_turn() = 0;
    if (m.has_feed)
      language.others->feed_of_turn() = language.others->length(language.others->feed_of_turn());
    return;
  }
  if (!m.has_feed) {
    if (modal.feed_mode == FeedMode::inverse_time && c.feed.inverse_time_every_block) feed = 0;
    return;
  }
  if (!to_rounded_quanta(m.feed, c.numbers.feed.decimals(modal.feed_mode), feed)) feed = 0;
  // Degrees a minute are no length.
  const bool turns_only = m.words.mask != 0 && (m.words.mask & kLinearAxes) == 0;
  if (language.others && modal.feed_mode == FeedMode::per_minute && !turns_only)
    feed = language.others->length(feed);
}

void Reader::State::follow_spindle(std::int64_t rpm) {
  constexpr double kFastest = 1e9;  // mm/min: beyond any machine
  const double mm_min = static_cast<double>(language.others->feed_of_turn()) /
                        static_cast<double>(kPowersOfTen[static_cast<std::size_t>(kTurnDecimals)]) *
                        static_cast<double>(rpm);
  const int decimals = c.numbers.feed.per_minute_decimals;
  feed = mm_min > 0.0 && mm_min < kFastest
             ? std::llround(mm_min * static_cast<double>(kPowersOfTen[static_cast<std::size_t>(decimals)]))
             : 0;
}

std::int64_t Reader::State::unwrapped(AxisLetter letter, std::int64_t value) const {
  if (!c.rotary.is_modulo(letter) || !modal.position.has(letter)) return value;
  const std::int64_t from = modal.position[letter];
  std::int64_t way = (value - from) % language.turn;
  if (2 * way > language.turn) way -= language.turn;
  if (2 * way < -language.turn) way += language.turn;
  return from + way;
}

// Where the word of an axis leads that counts modulo one turn.
bool Reader::State::wind(AxisLetter letter, const LineMotion& m, std::int64_t& value) {
  if (!c.rotary.is_modulo(letter)) return true;
  if (!language.others || !modal.position.has(letter)) return value = unwrapped(letter, value), true;
  const std::uint16_t bit = AxisWords::bit(letter);
  if ((m.means.ways & bit) != 0 || (language.others->in_increments() && (m.means.places & bit) == 0))
    return true;
  const std::int64_t from = modal.position[letter];
  std::int64_t stands = from % language.turn;
  if (stands < 0) stands += language.turn;
  std::int64_t place = value % language.turn;
  if (place < 0) place += language.turn;
  const std::int64_t way = place - stands;
  bool straight = (m.means.straight & bit) != 0;
  if (!c.rotary.shorter_way.empty()) {
    const auto shorter = language.others->shorter_way();
    if (!shorter && 2 * std::abs(way) > language.turn) {
      error(m.column, std::string("axis ") + letter_of(letter) +
                          " turns by more than half a turn, and the program "
                          "has not said which way ('" +
                          c.rotary.shorter_way + "' or '" + c.rotary.straight_way + "')");
      return false;
    }
    straight = !shorter.value_or(true);
  }
  value = straight ? from + way : unwrapped(letter, value);
  return true;
}

void Reader::State::run_motion(LineMotion& m) {
  take_modes(m);
  if (m.words.mask == 0) return;
  if (language.others) {
    if (waits_for_plane()) return;
    note_unit();
    if (m.named) language.others->end_circle();
    if (!m.is_resolved && !language.others->resolve(m.words, m.means, modal.position, m.column))
      return error(m.column, language.others->error);
    if (language.others->per_revolution()) follow_spindle();
  }
  if (!may_move(m.column)) return;
  if (!modal.tcp_known && kinematics_unknown(m.column)) return;
  if (modal.clamped != 0 && turns_clamped(m)) return;
  if (modal.cycle && run_next_hole(m)) return;
  if (!c.motion.modal && !m.named) return error(m.column, "axis words without '" + c.motion.linear + "'");
  if (!modal.motion_kind)
    return error(m.column, "axis words before any " + c.motion.rapid + " or " + c.motion.linear);
  auto& motion = std::get<Motion>(motion_block);
  motion.kind = m.rapid ? MotionKind::rapid : *modal.motion_kind;
  if (motion.kind == MotionKind::feed) {
    if (feed <= 0) {
      if (language.others && language.others->per_revolution())
        return error(m.column, "a feed per revolution ('" + c.input.places.per_revolution +
                                   "') without F, or the spindle does not turn");
      return error(m.column, modal.feed_mode == FeedMode::inverse_time
                                 ? "feed move without F, which inverse time needs in every block"
                                 : "feed move without feed");
    }
    motion.feed_mode = modal.feed_mode;
    motion.feed = feed;
  } else {
    motion.feed_mode = FeedMode::per_minute;
    motion.feed = 0;
  }
  bool turns = false;
  for (unsigned rest = m.words.mask; rest != 0; rest &= rest - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rest));
    const auto letter = static_cast<AxisLetter>(i);
    std::int64_t value = m.words.quanta[i];
    if (c.rotary.modulo_axes != 0 && !wind(letter, m, value)) return;
    turns = turns || (is_rotary(letter) && (!modal.position.has(letter) || modal.position[letter] != value));
    modal.position.set(letter, value);
  }
  // The zero has gone with the part: Haas (UMC-750 manual, G254) wants X, Y and Z said anew before a cut.
  if (program.follows_part && turns)
    modal.position.forget(static_cast<std::uint16_t>(kLinearAxes & ~m.words.mask));
  motion.words = modal.position;
  motion.source = {findings.line, m.column};
  if (!parsed.has_values) return emit(motion_block);
  emit(VariableMotion{motion, parsed.coefficient});
  modal.position.forget(kLinearAxes);  // where they stand depends on the values
}

void Reader::State::read_line(std::string_view text) {
  ++findings.line;
  if (findings.given_up) return;
  const char* const begin = text.data();
  const char* end = begin + text.size();
  while (end != begin && is_blank(end[-1])) --end;
  const char* p = language.scanner.skip_block_number(begin, end);
  if (p == end) return;
  if (!options.raw_lines.empty() && is_raw({p, static_cast<std::size_t>(end - p)})) {
    return emit(Raw{std::string(p, end)});
  }
  if (program.tape_line != 0 && !program.ended)
    return error(1, "a block behind the '%' of line " + std::to_string(program.tape_line) +
                        ", at which the control stops reading: is the program whole?");
  if (language.others && (program.ended || is_no_block_of_others({p, static_cast<std::size_t>(end - p)})))
    return;
  if (const auto frame = language.others
                             ? language.others->frame_named({p, static_cast<std::size_t>(end - p)})
                             : std::nullopt)
    return run_frame_line({p, static_cast<std::size_t>(end - p)}, *frame);
  if (language.others &&
      (run_datum_shift({p, static_cast<std::size_t>(end - p)}) || run_pole_line(begin, p, end)))
    return;
  if (language.others && language.others->has_place_name()) {
    std::string line(begin, end);
    if (language.others->take_place_name(line, static_cast<std::size_t>(p - begin)))
      return run_past_offsets(line, static_cast<std::size_t>(p - begin));
  }
  if (std::string numbered; language.others && number_tool({p, static_cast<std::size_t>(end - p)}, numbered))
    return read_words(numbered.data(), numbered.data(), numbered.data() + numbered.size());
  read_words(begin, p, end);
}

// M13 is M3 and M8 there.
bool Reader::State::spell_out(std::string_view text, std::string& out) const {
  bool found = false;
  for (const std::string& line : c.input.lines.stands_for) {
    const auto sign = line.find(" = ");
    const std::string_view word = std::string_view(line).substr(0, sign);
    const std::string_view of = found ? std::string_view(out) : text;
    const auto at = of.substr(0, of.find(c.comments.open)).find(word);
    const auto behind = at + word.size();
    if (at == std::string_view::npos || (behind < of.size() && (is_digit(of[behind]) || of[behind] == '.')) ||
        (at > 0 && is_letter(of[at - 1])))
      continue;
    out = std::string(of.substr(0, at)).append(line.substr(sign + 3)).append(of.substr(behind));
    found = true;
  }
  return found;
}

// A control finds it by the name; a number that no program has by chance stands for it.
bool Reader::State::number_tool(std::string_view text, std::string& numbered) {
  const std::string begins = c.input.lines.tool_name + "\"";
  const auto at = c.input.lines.tool_name.empty() ? std::string_view::npos : text.find(begins);
  if (at == std::string_view::npos) return false;
  const auto name = at + begins.size();
  const auto quote = text.find('"', name);
  // Within a comment, or open: as any text.
  if (quote == std::string_view::npos || text.substr(0, at).find(c.comments.open) != std::string_view::npos)
    return false;
  const auto [number, is_new] = language.others->number_of(std::string(text.substr(name, quote - name)));
  numbered.assign(text.substr(0, at))
      .append("T")
      .append(std::to_string(number))
      .append(text.substr(quote + 1));
  if (is_new) {
    findings.diagnostics.warning(
        findings.file, {findings.line, 1},
        "tool '" + printable(text.substr(name, quote - name)) + "' has no number: it is T" +
            std::to_string(number) +
            " here and in the program that is written; its length is that of this number (--tools)");
  }
  return true;
}

void Reader::State::read_words(const char* begin, const char* p, const char* end) {
  LineMotion plain;
  if (!program.ended && !(program.frame && program.frame->is_head()) &&
      take_plain_motion(begin, p, end, plain)) {
    if (parsed.has_values) parsed.clear();
    if (program.increments_since != 0 && !counts_absolute(plain)) return;
    return run_motion(plain);
  }
  parsed.clear();
  language.scanner.scan(begin, p, end, parsed);
  if (!parsed.error.empty()) return error(parsed.error_column, parsed.error);
  for (auto& comment : parsed.comments) {
    const bool marked = comment.starts_with(c.comments.mark);
    if (marked) comment.erase(0, c.comments.mark.size());
    emit(Comment{std::move(comment), marked});
  }
  run_line();
}

bool Reader::State::is_raw(std::string_view text) const {
  return std::find(options.raw_lines.begin(), options.raw_lines.end(), text) != options.raw_lines.end();
}

// The only words in increments that are read are those of a retract.
bool Reader::State::counts_absolute(const LineMotion& m) {
  if (program.increments_since == findings.line ||
      (parsed.word_count == 0 && parsed.phrases.empty() && m.words.mask == 0))
    return true;
  if (m.absolute) {
    program.increments_since = 0;
    return true;
  }
  error(1, "'" + c.incremental.on + "' of line " + std::to_string(program.increments_since) +
               " is still in force: '" + c.incremental.off + "' is missing");
  return false;
}

void Reader::State::run_line() {
  // Almost every line of a program is a motion and nothing else.
  LineMotion m;
  if (program.frame && program.frame->is_head()) note_head();
  if (language.others) return run_line_of_others();
  if (parsed.phrases.empty() && !program.ended && take_motion(m)) {
    if (program.increments_since != 0 && !counts_absolute(m)) return;
    return run_motion(m);
  }
  m = {};
  for (std::size_t i = 0; i < parsed.word_count; ++i) parsed.words[i].used = false;
  const std::vector<FoundEvent> events = find_events(m);
  if (!take_words(m)) return;
  if (program.increments_since != 0 && !counts_absolute(m)) return;
  if (program.ended && (m.words.mask != 0 || !events.empty())) {
    if (std::all_of(events.begin(), events.end(),
                    [](const auto& e) {
                      return e.event.kind == EventKind::program_end || e.event.kind == EventKind::tape;
                    }) &&
        m.words.mask == 0) {
      return;
    }
    return error(1, "text after the end of the program");
  }
  if (events.empty()) return run_motion(m);
  run_events(events, m);
}

// The words that [input] names first; what is left is as in any program.
void Reader::State::run_line_of_others() {
  OtherWords& others = *language.others;
  const auto refused = [&] {
    if (others.error.empty()) return false;
    error(std::max(others.error_column, 1U), others.error);
    return true;
  };
  if (!others.has_each_once(parsed)) {
    refused();
    return;
  }
  const bool per_revolution = others.per_revolution();
  // Some keep the number of F, some the speed.
  if (others.take_modes(parsed) && !c.input.unit_keeps_speed) feed = others.feed_of_turn() = 0;
  if (others.per_revolution() && !per_revolution) {
    set_feed_mode(FeedMode::per_minute);
    feed = language.others->feed_of_turn() = 0;
  }
  if (others.zero_follows() != program.follows_part && !follow_part(others.zero_follows())) return;
  if (!others.take_frame(parsed, modal.position, against_frame(false))) {
    refused();
    return;
  }
  const auto home = others.take_machine_motion(parsed);
  if (refused()) return;
  if (home && home->to_position && !others.is_rapid(parsed, modal.motion_kind == MotionKind::rapid))
    return error(home->column, "no rapid to a place of the machine (" + c.input.machine_position +
                                   "): where it cuts in the part is not followed");
  if (home && !run_by_way_of(*home)) return;
  if (home) run_machine_motion(*home);
  const auto shape =
      home ? std::nullopt
           : others.take_shape(parsed, language.patterns, modal.position, modal.cycle.has_value());
  if (refused()) return;
  if (shape) note_unit();
  LineMotion m;
  std::vector<FoundEvent> events = find_events(m);
  if (shape) events.push_back(*shape);
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.event.kind < b.event.kind; });
  leave_feed_of_tcp(events);
  if (!take_words(m)) return;
  if (!c.motion.modal && m.words.mask != 0 && modal.tcp &&
      std::any_of(events.begin(), events.end(),
                  [](const FoundEvent& found) { return found.event.kind == EventKind::tcp_off; }))
    return error(std::max(m.column, 1U),
                 "'" + c.tcp.off.back() + "' beside a motion: it holds from the end of its block on there");
  if (events.empty()) return run_motion(m);
  run_events(events, m);
}

// 'L X+0 Y+38.5 IB-15 RL F125 M128 F1000' of Heidenhain's manuals: the second F is how fast the axes make up
// for the rotary ones, and no feed of the cut.
void Reader::State::leave_feed_of_tcp(const std::vector<FoundEvent>& events) {
  if (c.motion.modal) return;
  for (const FoundEvent& found : events) {
    if (found.event.kind != EventKind::tcp_on) continue;
    for (std::size_t i = 0; i < parsed.word_count; ++i) {
      Word& word = parsed.words[i];
      if (word.letter == 'F' && word.column > found.column) word.used = true;
    }
  }
}

// A line of several that mean a tilted plane only together: in some controls it turns the coordinates alone.
bool Reader::State::waits_for_plane() {
  if (language.others->frame_moved_aside()) {
    error(1, "a datum shift in a tilted plane, and a motion behind it: end the plane first");
    return true;
  }
  if (program.plane_since == 0) return false;
  error(1, "a motion in the tilted plane of line " + std::to_string(program.plane_since) + " without '" +
               c.tilted_plane.on.back() + "' before it: where the rotary axes stand to it is not said");
  program.plane_since = 0;
  return true;
}

bool Reader::State::follow_part(bool on) {
  if (on && (modal.tcp || modal.plane || modal.cycle || !language.others->frame().is_idle())) {
    error(1, "'" + c.input.places.zero_follows +
                 "' under tool-centre-point control, in a tilted plane, a shift, a turn or a drilling cycle");
    return false;
  }
  program.follows_part = on;
  modal.plane = on;  // what is not read in one is not read here
  modal.position.forget(kLinearAxes);
  TiltedPlane now;
  now.on = now.follows_part = on;
  emit(now);
  return true;
}

const char* Reader::State::against_frame(bool turns) const {
  if (modal.cycle) return "under a drilling cycle is not read: end that first";
  if (modal.plane) return "in a tilted plane is not read: in which coordinates it counts is not said";
  if (modal.tcp && (turns || c.offset_shift.not_under_tcp))
    return "under tool-centre-point control is not read: the control refuses it, or turns more than X Y Z";
  return nullptr;
}

void Reader::State::run_frame_line(std::string_view text, std::size_t name) {
  text.remove_prefix(c.input.places.frames[name].size());
  const char* const begin = text.data() - c.input.places.frames[name].size();
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end && is_blank(*p)) ++p;
  std::optional<Number> angle;
  constexpr std::string_view kAngle = "RPL";
  if (std::string_view(p, static_cast<std::size_t>(end - p)).starts_with(kAngle)) {
    const char* s = p + kAngle.size();
    while (s != end && (is_blank(*s) || *s == '=')) ++s;
    Number number;
    if (s == end || !scan_number(s, end, number)) return error(1, "RPL without a number");
    angle = number;
    p = s;
  }
  parsed.clear();
  language.scanner.scan(begin, p, end, parsed);
  if (!parsed.error.empty()) return error(parsed.error_column, parsed.error);
  if (!parsed.phrases.empty())
    return error(1, "'" + c.input.places.frames[name] + "' stands in a line of its own");
  if (!language.others->has_each_once(parsed) ||
      !language.others->take_named_frame(parsed, name, angle, against_frame(name >= 2)))
    error(std::max(language.others->error_column, 1U), language.others->error);
}

void Reader::State::run_past_offsets(const std::string& line, std::size_t from) {
  parsed.clear();
  language.scanner.scan(line.data(), line.data() + from, line.data() + line.size(), parsed);
  if (!parsed.error.empty()) return error(parsed.error_column, parsed.error);
  parsed.past_offsets = true;
  run_line_of_others();
}

bool Reader::State::run_datum_shift(std::string_view text) {
  auto rest = language.others->datum_shift_in(text);
  if (!rest) return false;
  const bool names = rest->front() == '0';  // the name of the cycle, and no value
  while (!rest->empty() && is_digit(rest->front())) rest->remove_prefix(1);
  if (names) return true;
  parsed.clear();
  language.scanner.scan(rest->data(), rest->data(), rest->data() + rest->size(), parsed);
  if (!parsed.error.empty() || !parsed.phrases.empty() || parsed.word_count == 0) {
    error(1, "a datum shift is read with X, Y and Z, and nothing else in its lines");
  } else if (program.shift_added) {
    error(1, "a datum shift, and another one of the program's own is in force: end that first");
  } else if (!language.others->has_each_once(parsed) ||
             !language.others->take_datum_shift(
                 parsed, modal.cycle || (modal.tcp && c.offset_shift.not_under_tcp) ? against_frame(false)
                                                                                    : nullptr)) {
    error(1, language.others->error);
  }
  return true;
}

bool Reader::State::run_pole_line(const char* begin, const char* p, const char* end) {
  OtherWords& others = *language.others;
  OtherWords::PoleLine said;
  said.word = others.pole_word({p, static_cast<std::size_t>(end - p)});
  if (said.word == OtherWords::PoleWord::none) return false;
  std::string line(begin, end);
  const auto refused = [&] {
    error(std::max(others.error_column, 1U), others.error);
    return true;
  };
  others.error_column = 1;
  // A remark may hold the same words.
  if (const auto remark = line.find(c.comments.open, static_cast<std::size_t>(p - begin));
      remark != std::string::npos && c.comments.close.empty())
    line.resize(remark);
  if (!others.take_pole_words(line, static_cast<std::size_t>(p - begin), said)) return refused();
  parsed.clear();
  language.scanner.scan(line.data(), line.data() + (p - begin), line.data() + line.size(), parsed);
  if (!parsed.error.empty()) return error(parsed.error_column, parsed.error), true;
  if (!others.has_each_once(parsed)) return refused();
  for (auto& comment : parsed.comments) emit(Comment{std::move(comment), false});
  LineMotion m;
  std::vector<FoundEvent> events = find_events(m);
  if (!take_words(m)) return true;
  if (!others.resolve(m.words, m.means, modal.position, std::max(m.column, 1U))) return refused();
  said.end = m.words;
  if (!others.take_pole_line(said, modal.position)) return refused();
  if (said.word == OtherWords::PoleWord::set) {
    if (!events.empty() || m.has_feed) error(1, "other words in the line of a pole");
    return true;
  }
  m.words = {};
  if (said.word == OtherWords::PoleWord::line) {
    m.words = said.end;
    m.is_resolved = true;
    m.column = 1;
    set_kind(MotionKind::feed, m);
  } else {
    FoundEvent arc;
    arc.event = {EventKind::arc, *said.clockwise ? 1 : 0};
    arc.column = 1;
    events.push_back(arc);
  }
  if (events.empty())
    run_motion(m);
  else
    run_events(events, m);
  return true;
}

void Reader::State::note_unit() {
  if (!language.others->wants_unit()) return;
  if (options.inches) {
    language.others->set_inches(*options.inches);
    return;
  }
  findings.diagnostics.warning(findings.file, {findings.line, 1},
                               "the program moves and has not said its unit ('" + c.input.inch.front() +
                                   "' or '" + c.input.millimetre.front() + "'): taken as mm (--cl-units)");
}

// A reference point is gone to over the place that the line names, at rapid rate.
bool Reader::State::run_by_way_of(const OtherWords::MachineMotion& motion) {
  if (motion.by_way_of.mask == 0) return true;
  const std::size_t errors = findings.errors;
  const auto kind = modal.motion_kind;
  LineMotion over;
  over.words = motion.by_way_of;
  over.kind = MotionKind::rapid;
  over.named = true;
  over.column = motion.column;
  run_motion(over);
  modal.motion_kind = kind;
  return findings.errors == errors;
}

// Past all offsets: where a rotary axis then stands its word says.
void Reader::State::run_machine_motion(const OtherWords::MachineMotion& motion) {
  Retract now{0, {}};
  for (const AxisLetter letter : kAllAxisLetters) {
    if (!motion.axes.has(letter)) continue;
    if (motion.to_position && is_rotary(letter)) {
      modal.position.set(letter, unwrapped(letter, motion.axes[letter]));
      continue;
    }
    modal.position.forget(letter);
    now.axes = static_cast<std::uint16_t>(now.axes | AxisWords::bit(letter));
    if (motion.to_position) now.to.set(letter, motion.axes[letter]);
  }
  if (modal.cycle) modal.motion_kind.reset();  // of what it was before the cycle nothing is kept
  modal.cycle.reset();
  if (now.axes != 0) emit(now);
}

// Lines that say nothing of the path, and the mark at both ends of a tape.
bool Reader::State::is_no_block_of_others(std::string_view text) {
  // A call that is all of its line.
  const auto is_all = [&](const std::string& begin) {
    return !begin.ends_with('(') || text.find(')') + 1 == text.size();
  };
  for (const std::string& begin : c.input.lines.skipped)
    if (text.starts_with(begin) && is_all(begin)) return true;
  if (std::find(c.input.lines.away.begin(), c.input.lines.away.end(), text) != c.input.lines.away.end()) {
    OtherWords::MachineMotion away;
    away.axes.mask = AxisWords::bit(AxisLetter::Z);
    run_machine_motion(away);
    return true;
  }
  // A comment may stand behind it.
  const auto& comments = c.comments;
  if (text.size() > 1 && text.front() == '%' && !comments.close.empty()) {
    std::string_view rest = text.substr(1);
    while (is_blank(rest.front())) rest.remove_prefix(1);
    if (rest.starts_with(comments.open) && rest.find(comments.close) + comments.close.size() == rest.size())
      text = "%";
  }
  if (text != "%") return false;
  if (program.begun_by_tape) {
    if (!std::exchange(program.ended, true)) emit(ProgramEnd{});
  } else if (!program.said_anything && modal.position.mask == 0) {
    program.begun_by_tape = true;
  } else {
    program.tape_line = findings.line;  // it may be all that is left of a pair
  }
  return true;
}

// Without a message: what this does not take may be another kind of line.
bool Reader::State::take_motion(LineMotion& m) {
  for (std::size_t i = 0; i < parsed.word_count; ++i) {
    Word& word = parsed.words[i];
    if (const auto axis = axis_of(word.letter); axis != kNoAxis) {
      const auto letter = static_cast<AxisLetter>(axis);
      std::int64_t quanta = 0;
      if (m.words.has(letter) || !to_quanta(word.number, language.format.decimals(letter), quanta))
        return false;
      if (c.numbers.point_required && !word.number.has_point && quanta != 0) return false;
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
bool Reader::State::take_words(LineMotion& m) {
  for (std::size_t i = 0; i < parsed.word_count; ++i) {
    Word& word = parsed.words[i];
    if (word.used) continue;
    if (const auto axis = axis_of(word.letter); axis != kNoAxis) {
      if (!take_axis(word, axis, m)) return false;
    } else if (word.letter == 'F') {
      if (m.has_feed) return error(word.column, "two F words in one block"), false;
      m.has_feed = true;
      m.feed = word.number;
    } else if (!take_simple(word, m) && !keep(word)) {
      return unknown_word(word), false;
    }
  }
  return true;
}

Reader::Reader(const Controller& controller, std::string file, Diagnostics& diagnostics, Sink sink,
               ReaderOptions options, RunSink runs)
    : state_(std::make_unique<State>(controller, std::move(file), diagnostics, std::move(sink),
                                     std::move(options), std::move(runs))) {
  const AxisFormat& own = controller.numbers.axes;
  TRUNNION_EXPECTS(state_->language.format.decimals(AxisLetter::X) >= own.decimals(AxisLetter::X));
  TRUNNION_EXPECTS(state_->language.format.decimals(AxisLetter::A) >= own.decimals(AxisLetter::A));
}

Reader::~Reader() = default;

void Reader::feed(std::string_view text) {
  if (state_->program.unfolder) return state_->program.unfolder->feed(text);
  auto& carry = state_->carry;
  while (!text.empty()) {
    if (carry.empty()) {
      while (const std::size_t taken = state_->read_run(text)) text.remove_prefix(taken);
    }
    const void* const newline = std::memchr(text.data(), '\n', text.size());
    if (newline == nullptr) {
      carry += text;
      return;
    }
    const auto n = static_cast<std::size_t>(static_cast<const char*>(newline) - text.data());
    if (carry.empty()) {
      state_->read_line(text.substr(0, n));
    } else {
      carry += text.substr(0, n);
      state_->read_line(carry);
      carry.clear();
    }
    text.remove_prefix(n + 1);
  }
}

std::uint32_t Reader::line() const {
  return state_->findings.line;
}

Result<void> Reader::finish() {
  auto& s = *state_;
  if (s.program.unfolder) {
    s.program.unfolder->finish();
    while (s.program.unfolder->step()) {
    }
  }
  if (!s.carry.empty()) s.read_line(s.carry);
  s.carry.clear();
  if (s.program.tape_line != 0 && s.findings.errors == 0 && !std::exchange(s.program.ended, true))
    s.emit(ProgramEnd{});
  if (!s.program.ended && s.findings.errors == 0) {
    ++s.findings.line;
    s.error(0, "the program has no end (" + s.c.program.end.front() + ")");
  }
  if (s.program.holes) {
    for (const std::uint32_t line : s.program.holes->never_called())
      s.findings.diagnostics.warning(s.findings.file, {line, 1},
                                     "a drilling cycle that is never called: no hole is drilled by it");
  }
  if (s.findings.first) return tl::unexpected(*s.findings.first);
  return {};
}

Result<std::vector<Block>> read_program(const Controller& controller, std::string_view text,
                                        const std::string& file, Diagnostics& diagnostics,
                                        const ReaderOptions& options) {
  std::vector<Block> blocks;
  Reader reader(
      controller, file, diagnostics, [&](const Block& block) { blocks.push_back(block); }, options);
  reader.feed(text);
  if (auto done = reader.finish(); !done) return tl::unexpected(done.error());
  return blocks;
}

}  // namespace trunnion::nc
