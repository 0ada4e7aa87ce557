#include "trunnion/nc/reader.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/digits.hpp"
#include "nc/patterns.hpp"
#include "nc/reader_line.hpp"

namespace trunnion::nc {
namespace {

constexpr std::int64_t kUnknown = -1;
constexpr std::uint16_t kLinearAxes = 0b111000111;
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

// G0 to G999.9 in tenths.
constexpr std::size_t kCodes = 10000;
enum class Simple : std::uint8_t { no, silent, rapid, linear, per_minute, inverse_time };

std::size_t code_of(const Number& n) {
  if (n.mantissa < 0 || n.decimals > 1) return kCodes;
  const auto tenths = static_cast<std::size_t>(n.decimals == 1 ? n.mantissa : 10 * n.mantissa);
  return std::min(tenths, kCodes);
}

std::string text_of(const Word& word) {
  std::string out(1, word.letter);
  std::array<char, 32> buffer;
  const NumberStyle style{word.number.decimals, true, word.number.has_point, false};
  return out.append(buffer.data(), put_number(buffer.data(), word.number.mantissa, style));
}

}  // namespace

struct Reader::State {
  State(const Controller& controller, std::string file_name, Diagnostics& found, Sink out_sink,
        ReaderOptions opts)
      : c(controller),
        file(std::move(file_name)),
        diagnostics(found),
        sink(std::move(out_sink)),
        options(std::move(opts)),
        format(options.format.value_or(c.numbers.axes)),
        patterns(compile_patterns(c, diagnostics)),
        scanner(c, patterns),
        turn(format.turn()) {
    for (const auto& p : patterns.words) {
      if (p.words.size() == 1) note_simple(p);
      for (const auto& w : p.words) {
        if (!w.is_fixed && (w.placeholder == Placeholder::tool || w.placeholder == Placeholder::rpm)) {
          kept_letters[static_cast<std::size_t>(w.letter - '@') & 31U] =
              static_cast<std::uint8_t>(w.placeholder) + 1;
        }
      }
    }
  }

  void note_simple(const Pattern& p) {
    const auto& w = p.words.front();
    const auto code = code_of(w.number);
    if (!w.is_fixed || code == kCodes || (w.letter != 'G' && w.letter != 'M')) return;
    Simple simple = Simple::no;
    if (p.event.kind == EventKind::silent) simple = Simple::silent;
    if (p.event == Event{EventKind::motion, static_cast<int>(MotionKind::rapid)}) simple = Simple::rapid;
    if (p.event == Event{EventKind::motion, static_cast<int>(MotionKind::feed)}) simple = Simple::linear;
    if (p.event == Event{EventKind::feed_mode, static_cast<int>(FeedMode::per_minute)})
      simple = Simple::per_minute;
    if (p.event == Event{EventKind::feed_mode, static_cast<int>(FeedMode::inverse_time)})
      simple = Simple::inverse_time;
    (w.letter == 'G' ? g_codes : m_codes)[code] = simple;
  }

  const Controller& c;
  std::string file;
  Diagnostics& diagnostics;
  Sink sink;
  ReaderOptions options;
  AxisFormat format;
  PatternSet patterns;
  LineScanner scanner;
  std::int64_t turn;
  std::array<Simple, kCodes> g_codes{};
  std::array<Simple, kCodes> m_codes{};
  std::array<std::uint8_t, 32> kept_letters{};  // letter -> placeholder + 1 that later lines use

  // Text.
  std::string carry;  // an unfinished line
  std::uint32_t line = 0;
  ParsedLine parsed;
  std::size_t errors = 0;
  bool given_up = false;
  std::optional<Error> first_error;

  // What the control knows.
  Block motion_block = Motion{};
  AxisWords position;
  std::optional<MotionKind> motion_kind;
  FeedMode feed_mode = FeedMode::per_minute;
  std::int64_t feed = 0;  // 0: none
  Spindle spindle;
  std::uint8_t coolant = 0;
  std::int64_t length = 0;
  bool tcp = false;
  std::int64_t tcp_offset = 0;
  std::int64_t work_offset = 0;
  std::optional<PathMode> path_mode;
  bool plane = false;
  Captures kept;
  bool started = false;
  bool ended = false;

  // --- findings
  // --------------------------------------------------------------------------------------------------------------

  void error(std::uint32_t column, const std::string& message) {
    const SourceRef where{line, column};
    diagnostics.error(file, where, message);
    if (!first_error) first_error = Error{ErrorCode::wrong_input, message, file, where};
    if (++errors >= options.max_errors && !given_up) {
      given_up = true;
      diagnostics.error(file, where, "too many errors: is it a program for " + c.name + "?");
    }
  }

  void unknown_word(const Word& word) {
    const std::string text = text_of(word);
    const auto it = c.refused.find(text);
    error(word.column, it != c.refused.end()
                           ? text + ": " + it->second
                           : "'" + text + "' is not known to " + c.name + " (" + c.file + ")");
  }

  void emit(const Block& block) {
    if (!started && !std::holds_alternative<ProgramStart>(block)) emit(ProgramStart{});
    if (std::holds_alternative<ProgramStart>(block)) started = true;
    sink(block);
  }

  // --- motion
  // ----------------------------------------------------------------------------------------------------------------

  struct LineMotion {
    AxisWords words;
    bool has_feed = false;
    Number feed;
    std::uint32_t column = 0;
    bool rapid = false;  // by a word that holds for this line only
    bool named = false;  // a motion word stands in the line
  };

  bool take_axis(Word& word, std::uint8_t axis, LineMotion& m) {
    const auto letter = static_cast<AxisLetter>(axis);
    if (m.words.has(letter)) {
      error(word.column, std::string("two ") + word.letter + " words in one block");
      return false;
    }
    std::int64_t quanta = 0;
    if (!to_quanta(word.number, format.decimals(letter), quanta)) {
      error(word.column, "'" + text_of(word) + "' has more decimals than " +
                             std::to_string(format.decimals(letter)) + ", or is too large");
      return false;
    }
    if (c.numbers.point_required && !word.number.has_point && quanta != 0) {
      error(word.column, "'" + text_of(word) +
                             "' has no decimal point: the control would take it for a number of increments");
      return false;
    }
    m.words.set(letter, quanta);
    if (m.column == 0) m.column = word.column;
    word.used = true;
    return true;
  }

  bool take_simple(Word& word, LineMotion& m) {
    const auto code = word.letter == 'G' || word.letter == 'M' ? code_of(word.number) : kCodes;
    if (code == kCodes) return false;
    switch ((word.letter == 'G' ? g_codes : m_codes)[code]) {
      case Simple::no:
        return false;
      case Simple::silent:
        break;
      case Simple::rapid:
        set_kind(MotionKind::rapid, m);
        break;
      case Simple::linear:
        set_kind(MotionKind::feed, m);
        break;
      case Simple::per_minute:
        set_feed_mode(FeedMode::per_minute);
        break;
      case Simple::inverse_time:
        set_feed_mode(FeedMode::inverse_time);
        break;
    }
    word.used = true;
    return true;
  }

  void set_kind(MotionKind kind, LineMotion& m) {
    motion_kind = kind;
    m.named = true;
  }

  void set_feed_mode(FeedMode mode) {
    if (mode == feed_mode) return;
    feed_mode = mode;
    feed = 0;
  }

  void take_feed(LineMotion& m) {
    if (!m.has_feed) {
      if (feed_mode == FeedMode::inverse_time && c.feed.inverse_time_every_block) feed = 0;
      return;
    }
    if (!to_rounded_quanta(m.feed, c.numbers.feed.decimals(feed_mode), feed)) feed = 0;
  }

  std::int64_t unwrapped(AxisLetter letter, std::int64_t value) const {
    if (!c.rotary.modulo || !is_rotary(letter) || !position.has(letter)) return value;
    const std::int64_t from = position[letter];
    std::int64_t way = (value - from) % turn;
    if (2 * way > turn) way -= turn;
    if (2 * way < -turn) way += turn;
    return from + way;
  }

  void run_motion(LineMotion& m) {
    take_feed(m);
    if (m.words.mask == 0) return;
    if (!c.motion.modal && !m.named) return error(m.column, "axis words without '" + c.motion.linear + "'");
    if (!motion_kind)
      return error(m.column, "axis words before any " + c.motion.rapid + " or " + c.motion.linear);
    auto& motion = std::get<Motion>(motion_block);
    motion.kind = m.rapid ? MotionKind::rapid : *motion_kind;
    if (motion.kind == MotionKind::feed) {
      if (feed <= 0) {
        return error(m.column, feed_mode == FeedMode::inverse_time
                                   ? "feed move without F, which inverse time needs in every block"
                                   : "feed move without feed");
      }
      motion.feed_mode = feed_mode;
      motion.feed = feed;
    } else {
      motion.feed_mode = FeedMode::per_minute;
      motion.feed = 0;
    }
    for (std::size_t i = 0; i < kAxisLetters; ++i) {
      if ((m.words.mask & (1U << i)) == 0) continue;
      const auto letter = static_cast<AxisLetter>(i);
      position.set(letter, c.rotary.modulo ? unwrapped(letter, m.words.quanta[i]) : m.words.quanta[i]);
    }
    motion.words = position;
    motion.source = {line, m.column};
    emit(motion_block);
  }

  // --- lines
  // -----------------------------------------------------------------------------------------------------------------

  void read_line(std::string_view text) {
    ++line;
    if (given_up) return;
    const char* const begin = text.data();
    const char* end = begin + text.size();
    while (end != begin && is_blank(end[-1])) --end;
    const char* p = scanner.skip_block_number(begin, end);
    if (p == end) return;
    if (!options.raw_lines.empty() && is_raw({p, static_cast<std::size_t>(end - p)})) {
      return emit(Raw{std::string(p, end)});
    }
    parsed.clear();
    scanner.scan(begin, p, end, parsed);
    if (!parsed.error.empty()) return error(parsed.error_column, parsed.error);
    for (auto& comment : parsed.comments) emit(Comment{std::move(comment)});
    run_line();
  }

  bool is_raw(std::string_view text) const {
    return std::find(options.raw_lines.begin(), options.raw_lines.end(), text) != options.raw_lines.end();
  }

  void run_line() {
    LineMotion m;
    // Almost every line of a program is a motion and nothing else.
    bool only_motion = parsed.phrases.empty();
    for (std::size_t i = 0; only_motion && i < parsed.word_count; ++i) {
      const Word& word = parsed.words[i];
      if (axis_of(word.letter) != kNoAxis || word.letter == 'F') continue;
      const auto code = word.letter == 'G' || word.letter == 'M' ? code_of(word.number) : kCodes;
      only_motion = code != kCodes && (word.letter == 'G' ? g_codes : m_codes)[code] != Simple::no;
    }
    std::vector<FoundEvent> events;
    if (!only_motion) events = find_events(m);
    if (!take_words(m)) return;
    if (ended && (m.words.mask != 0 || !events.empty())) {
      if (std::all_of(events.begin(), events.end(),
                      [](const auto& e) { return e.event.kind == EventKind::program_end; }) &&
          m.words.mask == 0) {
        return;
      }
      return error(1, "text after the end of the program");
    }
    if (events.empty()) return run_motion(m);
    run_events(events, m);
  }

  // What is left after patterns have taken their words: motion, or not understood.
  bool take_words(LineMotion& m) {
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

  // T before M6, S before M3: on lines of their own.
  bool keep(const Word& word) {
    const auto placeholder = kept_letters[static_cast<std::size_t>(word.letter - '@') & 31U];
    if (placeholder == 0) return false;
    kept.set(static_cast<Placeholder>(placeholder - 1), word.number);
    return true;
  }

  std::vector<FoundEvent> find_events(LineMotion& m) {
    std::vector<FoundEvent> events;
    for (auto& phrase : parsed.phrases) {
      switch (phrase.event.kind) {
        case EventKind::silent:
          break;
        case EventKind::motion:
          set_kind(static_cast<MotionKind>(phrase.event.argument), m);
          break;
        case EventKind::feed_mode:
          set_feed_mode(static_cast<FeedMode>(phrase.event.argument));
          break;
        case EventKind::rapid_suffix:
          m.rapid = true;
          break;
        default:
          events.push_back(std::move(phrase));
      }
    }
    for (const auto& pattern : patterns.words) {
      const auto kind = pattern.event.kind;
      if (kind == EventKind::motion || kind == EventKind::feed_mode) continue;  // left to take_simple
      FoundEvent found;
      if (!match_words(pattern, found)) continue;
      if (kind == EventKind::rapid_suffix) m.rapid = true;
      if (kind != EventKind::silent && kind != EventKind::rapid_suffix) events.push_back(std::move(found));
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const auto& a, const auto& b) { return a.event.kind < b.event.kind; });
    return events;
  }

  Word* find_word(const PatternWord& wanted) {
    for (std::size_t i = 0; i < parsed.word_count; ++i) {
      Word& word = parsed.words[i];
      if (word.letter != wanted.letter || word.used) continue;
      if (!wanted.is_fixed || equal(word.number, wanted.number)) return &word;
    }
    return nullptr;
  }

  // All words of the pattern in the line, in any order; tool and spindle speed may have come before.
  bool match_words(const Pattern& pattern, FoundEvent& found) {
    std::array<Word*, kMaxWords> taken{};
    std::size_t n = 0;
    bool any_fixed = false;
    for (const auto& wanted : pattern.words) {
      Word* word = find_word(wanted);
      if (word == nullptr) {
        const bool may_be_kept = !wanted.is_fixed && kept.has(wanted.placeholder) &&
                                 kept_letters[static_cast<std::size_t>(wanted.letter - '@') & 31U] != 0;
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

  // --- events
  // ----------------------------------------------------------------------------------------------------------------

  void run_events(const std::vector<FoundEvent>& events, LineMotion& m) {
    bool moved = false;
    for (const auto& found : events) {
      const auto kind = found.event.kind;
      if (m.words.mask != 0 && excludes_motion(kind)) {
        return error(m.column, "axis words stand in one block with words that exclude motion");
      }
      // Stops and the end take place when the motion of their block is done.
      if (!moved && kind >= EventKind::stop) {
        run_motion(m);
        moved = true;
      }
      run_event(found);
    }
    if (!moved) run_motion(m);
  }

  static bool excludes_motion(EventKind kind) {
    return kind == EventKind::tool || kind == EventKind::dwell || kind == EventKind::retract ||
           kind == EventKind::plane_on || kind == EventKind::plane_off || kind == EventKind::program_start;
  }

  std::int64_t whole(const FoundEvent& found, Placeholder p, std::int64_t fallback) {
    const Number* number = found.captures.has(p) ? &found.captures[p] : kept.has(p) ? &kept[p] : nullptr;
    std::int64_t out = fallback;
    if (number != nullptr && !to_rounded_quanta(*number, 0, out)) error(found.column, "number too large");
    return out;
  }

  std::int64_t scaled(const FoundEvent& found, Placeholder p, int decimals) {
    std::int64_t out = 0;
    if (found.captures.has(p) && !to_quanta(found.captures[p], decimals, out)) {
      error(found.column, std::string("{") + std::string(name_of(p)) + "} has more decimals than " +
                              std::to_string(decimals));
    }
    return out;
  }

  void forget(std::uint16_t axes) { position.mask = static_cast<std::uint16_t>(position.mask & ~axes); }

  void keep_captures(const Captures& captures) {
    for (const auto p : {Placeholder::tool, Placeholder::rpm}) {
      if (captures.has(p)) kept.set(p, captures[p]);
    }
  }

  void run_event(const FoundEvent& found) {
    keep_captures(found.captures);
    switch (found.event.kind) {
      case EventKind::program_start:
        return run_program_start(found);
      case EventKind::program_end:
        ended = true;
        return emit(ProgramEnd{});
      case EventKind::spindle:
        return run_spindle(found);
      case EventKind::coolant:
        return run_coolant(static_cast<CoolantKind>(found.event.argument));
      case EventKind::tool:
        return run_tool(found);
      case EventKind::length_on:
        return run_length(whole(found, Placeholder::length_offset, 0));
      case EventKind::length_off:
        return run_length(0);
      case EventKind::tcp_on:
        return run_tcp(true, whole(found, Placeholder::length_offset, 0));
      case EventKind::tcp_off:
        return run_tcp(false, 0);
      case EventKind::length_or_tcp_off:
        return tcp ? run_tcp(false, 0) : run_length(0);
      case EventKind::work_offset:
        return run_work_offset(found.event.argument);
      case EventKind::path_mode:
        return run_path_mode(found);
      case EventKind::plane_on:
        return run_plane(found);
      case EventKind::plane_off:
        if (!plane) return;
        plane = false;
        forget(static_cast<std::uint16_t>(~0U));
        return emit(TiltedPlane{});
      case EventKind::dwell:
        return run_dwell(found);
      case EventKind::retract:
        return run_retract(static_cast<AxisLetter>(found.event.argument));
      case EventKind::stop:
        return emit(Stop{found.event.argument == 1});
      default:
        return;
    }
  }

  void run_program_start(const FoundEvent& found) {
    if (started) return;
    ProgramStart start;
    start.name = found.captures.name;
    start.number = whole(found, Placeholder::number, 1);
    emit(start);
  }

  void run_spindle(const FoundEvent& found) {
    Spindle now;
    now.turn = static_cast<SpindleTurn>(found.event.argument);
    if (now.turn != SpindleTurn::off) {
      now.rpm = whole(found, Placeholder::rpm, 0);
      if (now.rpm <= 0) return error(found.column, "the spindle is to turn without a speed");
    }
    if (now.turn == spindle.turn && now.rpm == spindle.rpm) return;
    spindle = now;
    emit(now);
  }

  void run_coolant(CoolantKind kind) {
    const auto now = static_cast<std::uint8_t>(
        kind == CoolantKind::off ? 0 : coolant | (1U << static_cast<unsigned>(kind)));
    if (now == coolant) return;
    coolant = now;
    emit(Coolant{kind});
  }

  void run_tool(const FoundEvent& found) {
    ToolCall call;
    call.tool = whole(found, Placeholder::tool, kUnknown);
    if (call.tool < 0) return error(found.column, "a tool change without a tool");
    call.length_offset = whole(found, Placeholder::length_offset, call.tool);
    spindle = {};
    coolant = 0;
    length = kUnknown;
    forget(static_cast<std::uint16_t>(~0U));
    emit(call);
  }

  void run_length(std::int64_t number) {
    if (number == length) return;
    length = number;
    forget(kLinearAxes);
    emit(LengthCompensation{number});
  }

  void run_tcp(bool on, std::int64_t offset) {
    if (on == tcp && offset == tcp_offset) return;
    tcp = on;
    tcp_offset = offset;
    if (c.tcp.replaces_length) length = 0;
    forget(kLinearAxes);
    emit(TcpControl{on, offset});
  }

  void run_work_offset(std::int64_t index) {
    if (index == work_offset) return;
    work_offset = index;
    forget(static_cast<std::uint16_t>(~0U));
    emit(WorkOffset{index});
  }

  void run_path_mode(const FoundEvent& found) {
    PathMode now;
    now.kind = static_cast<PathModeKind>(found.event.argument);
    now.tolerance = scaled(found, Placeholder::tolerance, format.decimals(AxisLetter::X));
    if (path_mode && path_mode->kind == now.kind && path_mode->tolerance == now.tolerance) return;
    path_mode = now;
    emit(now);
  }

  void run_plane(const FoundEvent& found) {
    TiltedPlane now;
    now.on = true;
    static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
    static constexpr std::array kAngle = {Placeholder::a, Placeholder::b, Placeholder::c};
    for (std::size_t i = 0; i < 3; ++i) {
      now.origin[i] = scaled(found, kOrigin[i], format.decimals(AxisLetter::X));
      now.angles[i] = scaled(found, kAngle[i], format.decimals(AxisLetter::A));
    }
    plane = true;
    forget(static_cast<std::uint16_t>(~0U));
    emit(now);
  }

  void run_dwell(const FoundEvent& found) {
    Dwell now;
    now.milliseconds = found.captures.has(Placeholder::milliseconds)
                           ? whole(found, Placeholder::milliseconds, 0)
                           : scaled(found, Placeholder::seconds, 3);
    emit(now);
  }

  void run_retract(AxisLetter letter) {
    position.forget(letter);
    motion_kind.reset();
    emit(Retract{AxisWords::bit(letter)});
  }
};

Reader::Reader(const Controller& controller, std::string file, Diagnostics& diagnostics, Sink sink,
               ReaderOptions options)
    : state_(std::make_unique<State>(controller, std::move(file), diagnostics, std::move(sink),
                                     std::move(options))) {
  const AxisFormat& own = controller.numbers.axes;
  TRUNNION_EXPECTS(state_->format.decimals(AxisLetter::X) >= own.decimals(AxisLetter::X));
  TRUNNION_EXPECTS(state_->format.decimals(AxisLetter::A) >= own.decimals(AxisLetter::A));
}

Reader::~Reader() = default;

void Reader::feed(std::string_view text) {
  auto& carry = state_->carry;
  while (!text.empty()) {
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

Result<void> Reader::finish() {
  auto& s = *state_;
  if (!s.carry.empty()) s.read_line(s.carry);
  s.carry.clear();
  if (!s.ended && s.errors == 0) {
    ++s.line;
    s.error(0, "the program has no end (" + s.c.program.end.front() + ")");
  }
  if (s.first_error) return tl::unexpected(*s.first_error);
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
