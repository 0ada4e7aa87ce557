#include "nc/control/patterns.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "nc/control/pattern_tokens.hpp"

namespace trunnion::nc {
std::string pattern_key(std::string_view line) {
  return key_of(tokens_of(line));
}

std::vector<std::string> setup_words(std::string_view line) {
  const auto tokens = tokens_of(line);
  if (words_of(tokens).empty() || has_placeholder(tokens)) return {std::string(line)};
  std::vector<std::string> out;
  std::string word;
  for (const char c : line) {
    if (is_letter(c) && !word.empty()) out.push_back(std::exchange(word, {}));
    if (!is_blank(c)) word += c;
  }
  out.push_back(word);
  return out;
}

namespace {

// The list of words that are taken and change nothing; other lines of a controller file are split and
// reordered.
constexpr const char* kReadSilent = "[read] silent";

using Type = PatternToken::Type;

class Compiler {
 public:
  Compiler(const Controller& controller, Diagnostics& diagnostics)
      : controller_(controller), diagnostics_(diagnostics) {
    for (const std::string& word : controller.silent) silent_.insert(key_of(tokens_of(word)));
    if (!controller.incremental.off.empty())
      counts_absolutely_ = key_of(tokens_of(controller.incremental.off));
  }

  // The last line of a template with more than symbols and words that are known to change nothing means the
  // event; the others hold values or mean nothing.
  void add(const Template& lines, Event event, const std::string& origin) {
    add(lines, event, origin, [](const auto& tokens) { return !is_symbols_only(tokens); });
  }

  // Of a retract it is the line that names the axis. Words that programs may not have (G91) hold in that line
  // only.
  void add_retract(const Template& lines, AxisLetter letter) {
    const std::string origin = std::string("[retract] ") + letter_of(letter);
    const auto names_axis = [&](const std::vector<PatternToken>& tokens) {
      return std::any_of(tokens.begin(), tokens.end(), [&](const PatternToken& t) {
        return t.type == Type::letters && t.text.size() == 1 && t.text.front() == letter_of(letter);
      });
    };
    const auto count = std::count_if(lines.begin(), lines.end(),
                                     [&](const std::string& line) { return names_axis(tokens_of(line)); });
    if (!lines.empty() && count != 1) {
      diagnostics_.error(
          controller_.file, {},
          "'" + origin + "' must name the axis in one of its lines; it does in " + std::to_string(count));
      return;
    }
    bool is_incremental = false;
    for (const std::string& line : lines) {
      const auto tokens = tokens_of(line);
      for (const auto& word : words_in(tokens)) {
        if (!names_axis(tokens) && controller_.refused.contains(word)) {
          diagnostics_.error(controller_.file, {},
                             "'" + origin + "': '" + word + "' must stand in the line that names the axis");
        }
        if (word == "G91") is_incremental = true;
        if (word == "G90") is_incremental = false;
      }
    }
    if (is_incremental) {
      diagnostics_.error(controller_.file, {},
                         "'" + origin + "': G91 stays in force after it: a line G90 must follow");
    }
    add(lines, {EventKind::retract, static_cast<int>(letter)}, origin, names_axis);
  }

  template <class IsMain>
  void add(const Template& lines, Event event, const std::string& origin, const IsMain& is_main) {
    std::vector<std::vector<PatternToken>> tokens;
    tokens.reserve(lines.size());
    for (const std::string& line : lines) tokens.push_back(tokens_of(line));
    std::size_t main = lines.size();
    bool says_more = false;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!is_main(tokens[i])) continue;
      const bool more = !is_silent(tokens[i]);
      if (more || !says_more) main = i;
      says_more = says_more || more;
    }
    if (lines.size() > 1 && main < lines.size()) note_others(tokens, main);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (i == main) {
        put(std::move(tokens[i]), event, origin);
      } else {
        later_.push_back({std::move(tokens[i]), origin});
      }
    }
  }

  // A phrase without values.
  void add_name(const std::string& line, Event event, const std::string& origin) {
    const auto tokens = tokens_of(line);
    if (words_of(tokens).empty() && !has_placeholder(tokens)) put(tokens, event, origin);
  }

  void add_word(const std::string& word, Event event, const std::string& origin) {
    if (!word.empty()) put(tokens_of(word), event, origin);
  }

  // Words that stand in a line of their own meaning only if nothing else claims them.
  void add_silent(const Template& lines, const std::string& origin) {
    for (const auto& line : lines) later_.push_back({tokens_of(line), origin});
  }

  // Words that mean something, or nothing, by themselves.
  static std::set<std::string> alone_of(const Controller& controller) {
    std::set<std::string> out;
    for (const Template* lines :
         {&controller.silent, &controller.program.setup, &controller.program.also_end,
          &controller.program.begin, &controller.program.end, &controller.tool_preselect}) {
      for (const std::string& line : *lines) {
        const auto tokens = tokens_of(line);
        out.insert(key_of(tokens));
        if (words_of(tokens).empty()) continue;
        for (std::size_t k = 0; k + 1 < tokens.size(); k += 2) out.insert(key_of({&tokens[k], 2}));
      }
    }
    return out;
  }

  PatternSet finish() {
    for (auto& [tokens, origin] : later_) add_later(std::move(tokens), origin);
    for (auto& [key, others] : others_) {
      const auto main = found_.find(key);
      if (main == found_.end()) continue;
      for (Pattern::Others& of_one : others) {
        for (auto* keys : {&of_one.before, &of_one.after}) {
          for (std::string& part : *keys) {
            part = key_as_read(part);
            const auto it = found_.find(part);
            if (it == found_.end()) continue;
            it->second.is_other = true;
            it->second.is_part = !alone_.contains(part);
          }
        }
      }
      main->second.others = std::move(others);
    }
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
  // A line that holds a value is read before one that is the same with this value.
  std::string key_as_read(const std::string& key) const {
    const auto literal = found_.find(key);
    if (literal == found_.end()) return key;
    const auto holds = [&](const Pattern& pattern) {
      const auto& a = pattern.tokens;
      const auto& b = literal->second.tokens;
      if (pattern.event.kind != EventKind::remember || a.size() != b.size()) return false;
      for (std::size_t i = 0; i < a.size(); ++i) {
        const bool any = a[i].type == Type::placeholder && b[i].type == Type::number;
        if (!any && key_of({&a[i], 1}) != key_of({&b[i], 1})) return false;
      }
      return true;
    };
    for (const auto& [other, pattern] : found_) {
      if (holds(pattern)) return other;
    }
    return key;
  }

  // The lines beside the one that means the event; words that stand alone, too, one by one. That positions
  // count absolutely again is asked for by what counted otherwise, and read as part of a motion.
  void note_others(const std::vector<std::vector<PatternToken>>& lines, std::size_t main) {
    Pattern::Others others;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (i == main || is_symbols_only(lines[i])) continue;
      auto& keys = i < main ? others.before : others.after;
      if (has_placeholder(lines[i]) || words_of(lines[i]).empty()) {
        keys.push_back(key_of(lines[i]));
        continue;
      }
      for (std::size_t k = 0; k + 1 < lines[i].size(); k += 2)
        if (const std::string key = key_of({&lines[i][k], 2}); key != counts_absolutely_) keys.push_back(key);
    }
    others_[key_of(lines[main])].push_back(std::move(others));
  }

  struct Later {
    std::vector<PatternToken> tokens;
    std::string origin;
  };

  // Word by word, or as a whole.
  bool is_silent(const std::vector<PatternToken>& tokens) const {
    if (silent_.contains(key_of(tokens))) return true;
    const auto words = words_of(tokens);
    for (std::size_t i = 0; i < words.size(); ++i)
      if (!silent_.contains(key_of({&tokens[2 * i], 2}))) return false;
    return !words.empty();
  }

  void put(std::vector<PatternToken> tokens, Event event, const std::string& origin) {
    if (tokens.empty()) return;
    const std::string key = key_of(tokens);
    const auto [it, is_new] = found_.try_emplace(key);
    if (is_new) {
      auto words = words_of(tokens);
      const auto& increments = controller_.incremental;
      Counts counts = Counts::as_before;
      if (!increments.on.empty() && holds_word(tokens, increments.on)) counts = Counts::increments;
      if (!increments.off.empty() && holds_word(tokens, increments.off)) counts = Counts::absolute;
      it->second = Pattern{event, origin, std::move(tokens), std::move(words), counts, key, false, false, {}};
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
    if (is_symbols_only(tokens)) return put(std::move(tokens), {EventKind::tape}, origin);
    const bool remembers = has_placeholder(tokens);
    const auto words = words_of(tokens);
    // `G187 P2`: P2 by itself, in a line with an arc, is not silent.
    const bool has_argument =
        origin == kReadSilent && std::any_of(words.begin(), words.end(), [](const PatternWord& word) {
          return word.letter != 'G' && word.letter != 'M';
        });
    if (remembers || words.empty() || (has_argument && words.size() > 1)) {
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
      const std::span<const PatternToken> word(&tokens[i], 2);
      if (!found_.contains(key_of(word))) put({word.begin(), word.end()}, {EventKind::silent}, origin);
    }
  }

  const Controller& controller_;
  Diagnostics& diagnostics_;
  std::set<std::string> silent_;
  std::set<std::string> alone_ = alone_of(controller_);
  std::map<std::string, Pattern> found_;
  std::vector<Later> later_;
  std::map<std::string, std::vector<Pattern::Others>> others_;
  std::string counts_absolutely_;  // key of [incremental] off; empty: none
};

void add_motion(Compiler& compiler, const Controller& c) {
  compiler.add_word(c.motion.linear, {EventKind::motion, static_cast<int>(MotionKind::feed)},
                    "[motion] linear");
  if (c.motion.rapid != c.motion.linear) {
    compiler.add_word(c.motion.rapid, {EventKind::motion, static_cast<int>(MotionKind::rapid)},
                      "[motion] rapid");
  }
  compiler.add_word(c.motion.rapid_suffix, {EventKind::rapid_suffix}, "[motion] rapid_suffix");
  compiler.add_word(c.input.lines.rapid_suffix, {EventKind::rapid_suffix}, "[input] rapid_suffix");
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
  for (std::size_t i = 0; i < c.coolant.size(); ++i) {
    compiler.add(c.coolant[i], {EventKind::coolant, static_cast<int>(i)},
                 std::string("[coolant] ") + kCoolantNames[i]);
  }
  compiler.add(c.tool_change, {EventKind::tool}, "[tool] change");
  compiler.add(c.tool_preselect, {EventKind::remember}, "[tool] preselect");
  for (std::size_t i = 0; i < c.clamps.size(); ++i) {
    const int at = 2 * static_cast<int>(i);
    compiler.add(c.clamps[i].on, {EventKind::clamp, at + 1}, "[clamp] on");
    compiler.add(c.clamps[i].off, {EventKind::clamp, at}, "[clamp] off");
  }
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
  compiler.add_silent(c.continuous_off, "[path_mode] continuous_off");
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
  // Several cycles may end in one call (`CYCL CALL`): the line that begins a tap tells it from the others.
  const auto name = [&](const Template& lines, int kind) {
    if (lines.size() > 1) compiler.add_name(lines.front(), {EventKind::cycle_name, kind}, "[cycles]");
  };
  name(c.cycles.tap, static_cast<int>(Hole::Kind::tap));
  name(c.cycles.tap_left, kTapLeft);
  for (const auto* cycles : {&c.cycles.plain, &c.cycles.dwell}) {
    for (const Template& lines : *cycles) name(lines, static_cast<int>(Hole::Kind::drill));
  }
  for (std::size_t i = 0; i < c.cycles.plain.size(); ++i) {
    const Event cycle{EventKind::cycle, static_cast<int>(i)};
    compiler.add(c.cycles.plain[i], cycle, "[cycles]");
    compiler.add(c.cycles.dwell[i], cycle, "[cycles] with dwell");
  }
  compiler.add(c.cycles.tap, {EventKind::cycle, static_cast<int>(Hole::Kind::tap)}, "[cycles] tap");
  compiler.add(c.cycles.tap_left, {EventKind::cycle, kTapLeft}, "[cycles] tap_left");
  compiler.add(c.cycles.to_clear, {EventKind::cycle_return, 1}, "[cycles] to_clear");
  compiler.add(c.cycles.to_initial, {EventKind::cycle_return, 0}, "[cycles] to_initial");
  compiler.add(c.cycles.off, {EventKind::cycle_off}, "[cycles] off");
  const auto log = [](ProbeLog::Kind kind) { return Event{EventKind::probe_log, static_cast<int>(kind)}; };
  compiler.add(c.probing.touch, {EventKind::probe, kTouches}, "[probing] touch");
  compiler.add(c.probing.guarded, {EventKind::probe, kGuards}, "[probing] guarded");
  compiler.add(c.probing.first, {EventKind::probe, kGuardsFirst}, "[probing] first");
  compiler.add(c.probing.declare, log(ProbeLog::Kind::declare), "[probing] declare");
  compiler.add(c.probing.open, log(ProbeLog::Kind::open), "[probing] open");
  compiler.add(c.probing.record, log(ProbeLog::Kind::record), "[probing] record");
  compiler.add(c.probing.close, log(ProbeLog::Kind::close), "[probing] close");
}

}  // namespace

PatternSet compile_patterns(const Controller& c, Diagnostics& diagnostics) {
  Compiler compiler(c, diagnostics);
  add_motion(compiler, c);
  add_state(compiler, c);
  add_shapes(compiler, c);
  compiler.add(c.program.begin, {EventKind::program_start}, "[program] begin");
  compiler.add(c.program.end, {EventKind::program_end}, "[program] end");
  for (const auto& word : c.program.also_end) compiler.add({word}, {EventKind::program_end}, "[read] end");
  compiler.add(c.dwell, {EventKind::dwell}, "[dwell] words");
  compiler.add(c.input.lines.dwell, {EventKind::dwell}, "[input] dwell");
  for (const AxisLetter letter : kAllAxisLetters) {
    compiler.add_retract(c.retract[index(letter)], letter);
  }
  compiler.add(c.stops.program, {EventKind::stop, 0}, "[stop] program");
  compiler.add(c.stops.optional, {EventKind::stop, 1}, "[stop] optional");
  for (std::size_t i = 0; i < c.run_time.begin.size(); ++i)
    compiler.add({c.run_time.begin[i]}, {EventKind::latch_begin, static_cast<int>(i)}, "[run_time] begin");
  compiler.add_silent(c.program.setup, kSetup);
  compiler.add_silent(c.silent, kReadSilent);
  for (std::size_t i = 0; i < c.allowed.size(); ++i)
    compiler.add({c.allowed[i]}, {EventKind::allowed, static_cast<int>(i)}, "[read] allowed");
  return compiler.finish();
}

}  // namespace trunnion::nc
