#include "nc/patterns.hpp"

#include <algorithm>
#include <map>

namespace trunnion::nc {
namespace {

using Type = PatternToken::Type;

bool is_text(Placeholder p) {
  return p == Placeholder::name;
}

void tokenise(std::string_view text, std::vector<PatternToken>& out) {
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    PatternToken token;
    if (is_blank(*p)) {
      ++p;
      continue;
    }
    if (is_letter(*p)) {
      token.type = Type::letters;
      while (p != end && is_letter(*p)) token.text += upper(*p++);
    } else if (const char* q = p; begins_number(*p) && scan_number(q, end, token.number)) {
      token.type = Type::number;
      p = q;
    } else {
      token.text = *p++;
    }
    out.push_back(std::move(token));
  }
}

std::vector<PatternToken> tokens_of(std::string_view line) {
  constexpr std::size_t kUsual = 8;
  std::vector<PatternToken> out;
  out.reserve(kUsual);
  std::string fault;
  while (!line.empty()) {
    const auto piece = next_piece(line, fault);
    tokenise(piece.text, out);
    if (!piece.placeholder) continue;
    PatternToken token;
    token.type = Type::placeholder;
    token.placeholder = *piece.placeholder;
    out.push_back(std::move(token));
  }
  return out;
}

// Letter, number, letter, number, ...: a set of address words; anything else is a phrase.
std::vector<PatternWord> words_of(const std::vector<PatternToken>& tokens) {
  std::vector<PatternWord> out;
  if (tokens.size() % 2 != 0) return {};
  for (std::size_t i = 0; i < tokens.size(); i += 2) {
    const auto& letter = tokens[i];
    const auto& value = tokens[i + 1];
    const bool fixed = value.type == Type::number;
    const bool numeric = value.type == Type::placeholder && !is_text(value.placeholder);
    if (letter.type != Type::letters || letter.text.size() != 1 || (!fixed && !numeric)) return {};
    out.push_back({letter.text.front(), fixed, value.number, value.placeholder});
  }
  return out;
}

// One text for equal patterns, whatever blanks and zeros they are written with.
std::string key_of(const std::vector<PatternToken>& tokens) {
  std::string out;
  for (const auto& t : tokens) {
    if (t.type == Type::number) {
      std::int64_t quanta = 0;
      out += to_quanta(t.number, kMaxDigits / 2, quanta) ? std::to_string(quanta) : "?";
    } else if (t.type == Type::placeholder) {
      out += "{}";
    } else {
      out += t.text;
    }
    out += ' ';
  }
  return out;
}

bool is_symbols_only(const std::vector<PatternToken>& tokens) {
  return std::all_of(tokens.begin(), tokens.end(),
                     [](const PatternToken& t) { return t.type == Type::symbol; });
}

std::vector<Placeholder> placeholders_of(const std::vector<PatternToken>& tokens) {
  std::vector<Placeholder> out;
  for (const auto& t : tokens) {
    if (t.type == Type::placeholder) out.push_back(t.placeholder);
  }
  return out;
}

bool has_placeholder(const std::vector<PatternToken>& tokens) {
  return std::any_of(tokens.begin(), tokens.end(),
                     [](const PatternToken& t) { return t.type == Type::placeholder; });
}

class Compiler {
 public:
  Compiler(const Controller& controller, Diagnostics& diagnostics)
      : controller_(controller), diagnostics_(diagnostics) {}

  // The last line of a template with more than symbols means the event; lines before it hold values or mean
  // nothing.
  void add(const Template& lines, Event event, const std::string& origin) {
    std::vector<std::vector<PatternToken>> tokens;
    tokens.reserve(lines.size());
    for (const std::string& line : lines) tokens.push_back(tokens_of(line));
    std::size_t main = lines.size();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!is_symbols_only(tokens[i])) main = i;
    }
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (i == main) {
        put(std::move(tokens[i]), event, origin);
      } else {
        later_.push_back({std::move(tokens[i]), origin});
      }
    }
  }

  void add_word(const std::string& word, Event event, const std::string& origin) {
    if (!word.empty()) put(tokens_of(word), event, origin);
  }

  // Words that stand in a line of their own meaning only if nothing else claims them.
  void add_silent(const Template& lines, const std::string& origin) {
    for (const auto& line : lines) later_.push_back({tokens_of(line), origin});
  }

  PatternSet finish() {
    for (auto& [tokens, origin] : later_) add_later(std::move(tokens), origin);
    PatternSet out;
    for (auto& [key, pattern] : found_) {
      (pattern.words.empty() ? out.phrases : out.words).push_back(std::move(pattern));
    }
    const auto fixed_words = [](const Pattern& p) {
      return std::count_if(p.words.begin(), p.words.end(), [](const PatternWord& w) { return w.is_fixed; });
    };
    const auto longer = [&](const Pattern& a, const Pattern& b) {
      if (fixed_words(a) != fixed_words(b)) return fixed_words(a) > fixed_words(b);
      if (a.tokens.size() != b.tokens.size()) return a.tokens.size() > b.tokens.size();
      // A line that only stands beside others must not hide one that holds a value.
      return a.event.kind != EventKind::silent && b.event.kind == EventKind::silent;
    };
    std::stable_sort(out.words.begin(), out.words.end(), longer);
    std::stable_sort(out.phrases.begin(), out.phrases.end(), longer);
    return out;
  }

 private:
  struct Later {
    std::vector<PatternToken> tokens;
    std::string origin;
  };

  void put(std::vector<PatternToken> tokens, Event event, const std::string& origin) {
    if (tokens.empty()) return;
    const std::string key = key_of(tokens);
    const auto [it, is_new] = found_.try_emplace(key);
    if (is_new) {
      auto words = words_of(tokens);
      it->second = Pattern{event, origin, std::move(tokens), std::move(words)};
      return;
    }
    Event& there = it->second.event;
    // Cycles with the same words differ by the values in them.
    if (there == event || (there.kind == EventKind::cycle && event.kind == EventKind::cycle)) return;
    if (there.kind == EventKind::length_off && event.kind == EventKind::tcp_off) {
      there.kind = EventKind::length_or_tcp_off;
      return;
    }
    diagnostics_.error(controller_.file, {},
                       "'" + origin + "' and '" + it->second.origin + "' have the same words: '" + key + "'");
  }

  // A line of address words without values is taken word by word: people reorder and split such lines.
  void add_later(std::vector<PatternToken> tokens, const std::string& origin) {
    const bool remembers = has_placeholder(tokens);
    const auto words = words_of(tokens);
    if (remembers || words.empty()) {
      if (const auto same = found_.find(key_of(tokens)); same != found_.end()) {
        if (placeholders_of(tokens) != placeholders_of(same->second.tokens))
          diagnostics_.error(controller_.file, {},
                             "'" + origin + "' and '" + same->second.origin +
                                 "' have lines of the same shape for different values: '" + same->first +
                                 "'");
        return;
      }
      put(std::move(tokens), {remembers ? EventKind::remember : EventKind::silent}, origin);
      return;
    }
    for (std::size_t i = 0; i < tokens.size(); i += 2) {
      std::vector<PatternToken> word(tokens.begin() + static_cast<std::ptrdiff_t>(i),
                                     tokens.begin() + static_cast<std::ptrdiff_t>(i) + 2);
      if (!found_.contains(key_of(word))) put(std::move(word), {EventKind::silent}, origin);
    }
  }

  const Controller& controller_;
  Diagnostics& diagnostics_;
  std::map<std::string, Pattern> found_;
  std::vector<Later> later_;
};

void add_motion(Compiler& compiler, const Controller& c) {
  compiler.add_word(c.motion.linear, {EventKind::motion, static_cast<int>(MotionKind::feed)},
                    "[motion] linear");
  if (c.motion.rapid != c.motion.linear) {
    compiler.add_word(c.motion.rapid, {EventKind::motion, static_cast<int>(MotionKind::rapid)},
                      "[motion] rapid");
  }
  compiler.add_word(c.motion.rapid_suffix, {EventKind::rapid_suffix}, "[motion] rapid_suffix");
  compiler.add_word(c.feed.per_minute, {EventKind::feed_mode, static_cast<int>(FeedMode::per_minute)},
                    "[feed] per_minute");
  compiler.add_word(c.feed.inverse_time, {EventKind::feed_mode, static_cast<int>(FeedMode::inverse_time)},
                    "[feed] inverse_time");
}

void add_state(Compiler& compiler, const Controller& c) {
  const auto turn = [](SpindleTurn t) { return Event{EventKind::spindle, static_cast<int>(t)}; };
  compiler.add(c.spindle_clockwise, turn(SpindleTurn::clockwise), "[spindle] clockwise");
  compiler.add(c.spindle_counterclockwise, turn(SpindleTurn::counterclockwise), "[spindle] counterclockwise");
  compiler.add(c.spindle_off, turn(SpindleTurn::off), "[spindle] off");
  static constexpr std::array kCoolants = {"off", "flood", "mist", "through_tool", "air"};
  for (std::size_t i = 0; i < c.coolant.size(); ++i) {
    compiler.add(c.coolant[i], {EventKind::coolant, static_cast<int>(i)},
                 std::string("[coolant] ") + kCoolants[i]);
  }
  compiler.add(c.tool_change, {EventKind::tool}, "[tool] change");
  compiler.add(c.length.on, {EventKind::length_on}, "[length] on");
  compiler.add(c.length.off, {EventKind::length_off}, "[length] off");
  compiler.add(c.tcp.on, {EventKind::tcp_on}, "[tcp] on");
  compiler.add(c.tcp.off, {EventKind::tcp_off}, "[tcp] off");
  for (std::size_t i = 0; i < c.work_offsets.size(); ++i) {
    compiler.add(c.work_offsets[i], {EventKind::work_offset, static_cast<int>(i) + 1}, "[work_offset] words");
  }
  compiler.add(c.offset_shift.set, {EventKind::offset_shift, static_cast<int>(OffsetShift::Kind::set)},
               "[offset_shift] set");
  compiler.add(c.offset_shift.add, {EventKind::offset_shift, static_cast<int>(OffsetShift::Kind::add)},
               "[offset_shift] add");
  compiler.add(c.run_time.latch, {EventKind::latch}, "[run_time] latch");
  using Step = RunTimeStep::Kind;
  const auto step = [](Step kind) { return Event{EventKind::run_time_step, static_cast<int>(kind)}; };
  const auto& t = c.run_time_temperatures;
  compiler.add(t.reset, step(Step::reset), "[run_time_temperatures] reset");
  compiler.add(t.read, step(Step::read), "[run_time_temperatures] read");
  compiler.add(t.reference, step(Step::reference), "[run_time_temperatures] reference");
  compiler.add(t.start, step(Step::start), "[run_time_temperatures] start");
  compiler.add(t.add, step(Step::add), "[run_time_temperatures] add");
  compiler.add(t.subtract, {EventKind::run_time_step, kSubtract}, "[run_time_temperatures] subtract");
  for (std::size_t i = 0; i < c.path_modes.size(); ++i) {
    compiler.add(c.path_modes[i], {EventKind::path_mode, static_cast<int>(i)}, "[path_mode]");
  }
  compiler.add(c.continuous_within, {EventKind::path_mode, static_cast<int>(PathModeKind::continuous)},
               "[path_mode] continuous_within");
  compiler.add(c.tilted_plane.on, {EventKind::plane_on}, "[tilted_plane] on");
  compiler.add(c.tilted_plane.off, {EventKind::plane_off}, "[tilted_plane] off");
  static constexpr std::array kSides = {"off", "left", "right"};
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    compiler.add(c.cutter_compensation[i], {EventKind::cutter, static_cast<int>(i)},
                 std::string("[cutter_compensation] ") + kSides[i]);
  }
}

void add_shapes(Compiler& compiler, const Controller& c) {
  compiler.add(c.arcs.clockwise, {EventKind::arc, 1}, "[arcs] clockwise");
  compiler.add(c.arcs.counterclockwise, {EventKind::arc, 0}, "[arcs] counterclockwise");
  compiler.add(c.arcs.helix_clockwise, {EventKind::arc, 1}, "[arcs] helix_clockwise");
  compiler.add(c.arcs.helix_counterclockwise, {EventKind::arc, 0}, "[arcs] helix_counterclockwise");
  for (std::size_t i = 0; i < c.cycles.plain.size(); ++i) {
    const Event cycle{EventKind::cycle, static_cast<int>(i)};
    compiler.add(c.cycles.plain[i], cycle, "[cycles]");
    compiler.add(c.cycles.dwell[i], cycle, "[cycles] with dwell");
  }
  compiler.add(c.cycles.to_clear, {EventKind::cycle_return, 1}, "[cycles] to_clear");
  compiler.add(c.cycles.to_initial, {EventKind::cycle_return, 0}, "[cycles] to_initial");
  compiler.add(c.cycles.off, {EventKind::cycle_off}, "[cycles] off");
}

}  // namespace

PatternSet compile_patterns(const Controller& c, Diagnostics& diagnostics) {
  Compiler compiler(c, diagnostics);
  add_motion(compiler, c);
  add_state(compiler, c);
  add_shapes(compiler, c);
  compiler.add(c.program.begin, {EventKind::program_start}, "[program] begin");
  compiler.add(c.program.end, {EventKind::program_end}, "[program] end");
  for (const auto& word : c.also_end) compiler.add({word}, {EventKind::program_end}, "[read] end");
  compiler.add(c.dwell, {EventKind::dwell}, "[dwell] words");
  for (const AxisLetter letter : kAllAxisLetters) {
    compiler.add(c.retract[index(letter)], {EventKind::retract, static_cast<int>(letter)},
                 std::string("[retract] ") + letter_of(letter));
  }
  compiler.add(c.stop, {EventKind::stop, 0}, "[stop] program");
  compiler.add(c.optional_stop, {EventKind::stop, 1}, "[stop] optional");
  compiler.add_silent(c.run_time.begin, "[run_time] begin");
  compiler.add_silent(c.program.setup, "[program] setup");
  compiler.add_silent(c.silent, "[read] silent");
  return compiler.finish();
}

}  // namespace trunnion::nc
