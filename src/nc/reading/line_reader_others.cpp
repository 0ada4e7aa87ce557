// Lines of programs that somebody else wrote.
#include <algorithm>
#include <utility>

#include "trunnion/base/printable.hpp"

#include "nc/reading/line_reader.hpp"

namespace trunnion::nc {

// M13 is M3 and M8 there.
bool LineReader::spell_out(std::string_view text, std::string& out) const {
  bool found = false;
  for (const std::string& line : s_.c.input.lines.stands_for) {
    const auto sign = line.find(" = ");
    const std::string_view word = std::string_view(line).substr(0, sign);
    const std::string_view of = found ? std::string_view(out) : text;
    const auto at = of.substr(0, of.find(s_.c.comments.open)).find(word);
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
bool LineReader::number_tool(std::string_view text, std::string& numbered) {
  const std::string begins = s_.c.input.lines.tool_name + "\"";
  const auto at = s_.c.input.lines.tool_name.empty() ? std::string_view::npos : text.find(begins);
  if (at == std::string_view::npos) return false;
  const auto name = at + begins.size();
  const auto quote = text.find('"', name);
  // Within a comment, or open: as any text.
  if (quote == std::string_view::npos ||
      text.substr(0, at).find(s_.c.comments.open) != std::string_view::npos)
    return false;
  const auto [number, is_new] = s_.language.others->number_of(std::string(text.substr(name, quote - name)));
  numbered.assign(text.substr(0, at))
      .append("T")
      .append(std::to_string(number))
      .append(text.substr(quote + 1));
  if (is_new) {
    s_.findings.diagnostics.warning(
        s_.findings.file, {s_.findings.line, 1},
        "tool '" + printable(text.substr(name, quote - name)) + "' has no number: it is T" +
            std::to_string(number) +
            " here and in the program that is written; its length is that of this number (--tools)");
  }
  return true;
}

// The words that [input] names first; what is left is as in any program.
void LineReader::run_line_of_others() {
  OtherWords& others = *s_.language.others;
  const auto refused = [&] {
    if (others.error.empty()) return false;
    s_.error(std::max(others.error_column, 1U), others.error);
    return true;
  };
  if (!others.has_each_once(parsed_) || !others.has_one_of_each_group(parsed_)) {
    refused();
    return;
  }
  const bool per_revolution = others.per_revolution();
  // Some keep the number of F, some the speed; these take an F beside the word in the unit before it.
  if (others.take_modes(parsed_)) {
    if (!s_.c.input.unit_keeps_speed)
      s_.feed = others.feed_of_turn() = 0;
    else if (const auto feed = std::find_if(parsed_.words.begin(), parsed_.words.begin() + parsed_.word_count,
                                            [](const Word& word) { return word.letter == 'F'; });
             feed != parsed_.words.begin() + parsed_.word_count)
      return s_.error(
          feed->column,
          "F in the line that changes the unit counts in the unit before: say it in a line behind");
  }
  if (others.per_revolution() && !per_revolution) {
    s_.set_feed_mode(FeedMode::per_minute);
    s_.feed = s_.language.others->feed_of_turn() = 0;
  }
  if (others.zero_follows() != s_.program.follows_part && !follow_part(others.zero_follows())) return;
  if (!others.take_frame(parsed_, s_.modal.position, against_frame(false))) {
    refused();
    return;
  }
  const auto home = others.take_machine_motion(parsed_);
  if (refused()) return;
  if (home && home->to_position && !others.is_rapid(parsed_, s_.modal.motion_kind == MotionKind::rapid))
    return s_.error(home->column, "no rapid to a place of the machine (" + s_.c.input.machine_position +
                                      "): where it cuts in the part is not followed");
  if (home && !run_by_way_of(*home)) return;
  if (home) run_machine_motion(*home);
  const auto shape =
      home ? std::nullopt
           : others.take_shape(parsed_, s_.language.patterns, s_.modal.position, s_.modal.cycle.has_value());
  if (refused()) return;
  if (shape) note_unit();
  LineMotion m;
  std::vector<FoundEvent> events = find_events(m);
  if (shape) events.push_back(*shape);
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.event.kind < b.event.kind; });
  leave_feed_of_tcp(events);
  if (contradict(events) || !take_words(m)) return;
  if (!s_.c.motion.modal && m.words.mask != 0 && s_.modal.tcp &&
      std::any_of(events.begin(), events.end(),
                  [](const FoundEvent& found) { return found.event.kind == EventKind::tcp_off; }))
    return s_.error(
        std::max(m.column, 1U),
        "'" + s_.c.tcp.off.back() + "' beside a motion: it holds from the end of its block on there");
  if (events.empty()) return run_motion(m);
  run_events(events, m);
}

// 'L X+0 Y+38.5 IB-15 RL F125 M128 F1000' of Heidenhain's manuals: the second F is how fast the axes make up
// for the rotary ones, and no feed of the cut.
void LineReader::leave_feed_of_tcp(const std::vector<FoundEvent>& events) {
  if (s_.c.motion.modal) return;
  for (const FoundEvent& found : events) {
    if (found.event.kind != EventKind::tcp_on) continue;
    for (std::size_t i = 0; i < parsed_.word_count; ++i) {
      Word& word = parsed_.words[i];
      if (word.letter == 'F' && word.column > found.column) word.used = true;
    }
  }
}

bool LineReader::follow_part(bool on) {
  if (on && (s_.modal.tcp || s_.modal.plane || s_.modal.cycle || !s_.language.others->frame().is_idle())) {
    s_.error(1,
             "'" + s_.c.input.places.zero_follows +
                 "' under tool-centre-point control, in a tilted plane, a shift, a turn or a drilling cycle");
    return false;
  }
  s_.program.follows_part = on;
  s_.modal.plane = on;  // what is not read in one is not read here
  s_.modal.position.forget(kLinearAxes);
  TiltedPlane now;
  now.on = now.follows_part = on;
  s_.emit(now);
  return true;
}

const char* LineReader::against_frame(bool turns) const {
  if (s_.modal.cycle) return "under a drilling cycle is not read: end that first";
  if (s_.modal.plane) return "in a tilted plane is not read: it is unknown in which coordinates it counts";
  if (s_.modal.tcp && (turns || s_.c.offset_shift.not_under_tcp))
    return "under tool-centre-point control is not read: the control refuses it, or turns more than X Y Z";
  return nullptr;
}

void LineReader::run_frame_line(std::string_view text, std::size_t name) {
  text.remove_prefix(s_.c.input.places.frames[name].size());
  const char* const begin = text.data() - s_.c.input.places.frames[name].size();
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end && is_blank(*p)) ++p;
  std::optional<Number> angle;
  constexpr std::string_view kAngle = "RPL";
  if (std::string_view(p, static_cast<std::size_t>(end - p)).starts_with(kAngle)) {
    const char* s = p + kAngle.size();
    while (s != end && (is_blank(*s) || *s == '=')) ++s;
    Number number;
    if (s == end || !scan_number(s, end, number)) return s_.error(1, "RPL without a number");
    angle = number;
    p = s;
  }
  parsed_.clear();
  s_.language.scanner.scan(begin, p, end, parsed_);
  if (!parsed_.error.empty()) return s_.error(parsed_.error_column, parsed_.error);
  if (!parsed_.phrases.empty())
    return s_.error(1, "'" + s_.c.input.places.frames[name] + "' stands in a line of its own");
  if (!s_.language.others->has_each_once(parsed_) ||
      !s_.language.others->take_named_frame(parsed_, name, angle, against_frame(name >= 2)))
    s_.error(std::max(s_.language.others->error_column, 1U), s_.language.others->error);
}

void LineReader::run_past_offsets(const std::string& line, std::size_t from) {
  parsed_.clear();
  s_.language.scanner.scan(line.data(), line.data() + from, line.data() + line.size(), parsed_);
  if (!parsed_.error.empty()) return s_.error(parsed_.error_column, parsed_.error);
  parsed_.past_offsets = true;
  run_line_of_others();
}

bool LineReader::run_datum_shift(std::string_view text) {
  auto rest = s_.language.others->datum_shift_in(text);
  if (!rest) return false;
  const bool names = rest->front() == '0';  // the name of the cycle, and no value
  while (!rest->empty() && is_digit(rest->front())) rest->remove_prefix(1);
  if (names) return true;
  parsed_.clear();
  s_.language.scanner.scan(rest->data(), rest->data(), rest->data() + rest->size(), parsed_);
  if (!parsed_.error.empty() || !parsed_.phrases.empty() || parsed_.word_count == 0) {
    s_.error(1, "a datum shift is read with X, Y and Z, and nothing else in its lines");
  } else if (s_.program.shift_added) {
    s_.error(1, "a datum shift, and another one of the program's own is in force: end that first");
  } else if (!s_.language.others->has_each_once(parsed_) ||
             !s_.language.others->take_datum_shift(
                 parsed_, s_.modal.cycle || (s_.modal.tcp && s_.c.offset_shift.not_under_tcp)
                              ? against_frame(false)
                              : nullptr)) {
    s_.error(1, s_.language.others->error);
  }
  return true;
}

bool LineReader::run_pole_line(const char* begin, const char* p, const char* end) {
  OtherWords& others = *s_.language.others;
  OtherWords::PoleLine said;
  said.word = others.pole_word({p, static_cast<std::size_t>(end - p)});
  if (said.word == OtherWords::PoleWord::none) return false;
  std::string line(begin, end);
  const auto refused = [&] {
    s_.error(std::max(others.error_column, 1U), others.error);
    return true;
  };
  others.error_column = 1;
  // A remark may hold the same words.
  if (const auto remark = line.find(s_.c.comments.open, static_cast<std::size_t>(p - begin));
      remark != std::string::npos && s_.c.comments.close.empty())
    line.resize(remark);
  if (!others.take_pole_words(line, static_cast<std::size_t>(p - begin), said)) return refused();
  parsed_.clear();
  s_.language.scanner.scan(line.data(), line.data() + (p - begin), line.data() + line.size(), parsed_);
  if (!parsed_.error.empty()) return s_.error(parsed_.error_column, parsed_.error), true;
  if (!others.has_each_once(parsed_)) return refused();
  for (auto& comment : parsed_.comments) s_.emit(Comment{std::move(comment), false});
  LineMotion m;
  std::vector<FoundEvent> events = find_events(m);
  if (!take_words(m)) return true;
  if (!others.resolve(m.words, m.means, s_.modal.position, std::max(m.column, 1U))) return refused();
  said.end = m.words;
  if (!others.take_pole_line(said, s_.modal.position)) return refused();
  if (said.word == OtherWords::PoleWord::set) {
    if (!events.empty() || m.has_feed) s_.error(1, "other words in the line of a pole");
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

void LineReader::note_unit() {
  if (!s_.language.others->wants_unit()) return;
  if (s_.options.inches) {
    s_.language.others->set_inches(*s_.options.inches);
    return;
  }
  s_.findings.diagnostics.warning(s_.findings.file, {s_.findings.line, 1},
                                  "the program moves and has not said its unit ('" + s_.c.input.inch.front() +
                                      "' or '" + s_.c.input.millimetre.front() +
                                      "'): taken as mm (--cl-units)");
}

// A reference point is gone to over the place that the line names, at rapid rate.
bool LineReader::run_by_way_of(const OtherWords::MachineMotion& motion) {
  if (motion.by_way_of.mask == 0) return true;
  const std::size_t errors = s_.findings.errors;
  const auto kind = s_.modal.motion_kind;
  LineMotion over;
  over.words = motion.by_way_of;
  over.kind = MotionKind::rapid;
  over.named = true;
  over.column = motion.column;
  run_motion(over);
  s_.modal.motion_kind = kind;
  return s_.findings.errors == errors;
}

// Past all offsets: where a rotary axis then stands its word says.
void LineReader::run_machine_motion(const OtherWords::MachineMotion& motion) {
  Retract now{0, {}};
  for (const AxisLetter letter : kAllAxisLetters) {
    if (!motion.axes.has(letter)) continue;
    if (motion.to_position && is_rotary(letter)) {
      s_.modal.position.set(letter, s_.unwrapped(letter, motion.axes[letter]));
      continue;
    }
    s_.modal.position.forget(letter);
    now.axes = static_cast<std::uint16_t>(now.axes | AxisWords::bit(letter));
    if (motion.to_position) now.to.set(letter, motion.axes[letter]);
  }
  if (s_.modal.cycle) s_.modal.motion_kind.reset();  // of what it was before the cycle nothing is kept
  s_.modal.cycle.reset();
  if (now.axes != 0) s_.emit(now);
}

// Lines that say nothing of the path, and the mark at both ends of a tape.
bool LineReader::is_no_block_of_others(std::string_view text) {
  // A call that is all of its line.
  const auto is_all = [&](const std::string& begin) {
    return !begin.ends_with('(') || text.find(')') + 1 == text.size();
  };
  for (const std::string& begin : s_.c.input.lines.skipped)
    if (text.starts_with(begin) && is_all(begin)) return true;
  if (std::find(s_.c.input.lines.away.begin(), s_.c.input.lines.away.end(), text) !=
      s_.c.input.lines.away.end()) {
    OtherWords::MachineMotion away;
    away.axes.mask = AxisWords::bit(AxisLetter::Z);
    run_machine_motion(away);
    return true;
  }
  // A comment may stand behind it.
  const auto& comments = s_.c.comments;
  if (text.size() > 1 && text.front() == '%' && !comments.close.empty()) {
    std::string_view rest = text.substr(1);
    while (is_blank(rest.front())) rest.remove_prefix(1);
    if (rest.starts_with(comments.open) && rest.find(comments.close) + comments.close.size() == rest.size())
      text = "%";
  }
  if (text != "%") return false;
  if (s_.program.begun_by_tape) {
    if (!std::exchange(s_.program.ended, true)) s_.emit(ProgramEnd{});
  } else if (!s_.program.said_anything && s_.modal.position.mask == 0) {
    s_.program.begun_by_tape = true;
  } else {
    s_.program.tape_line = s_.findings.line;  // it may be all that is left of a pair
  }
  return true;
}

}  // namespace trunnion::nc
