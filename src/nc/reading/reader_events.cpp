#include <algorithm>
#include <bit>
#include <utility>

#include "nc/reading/reader_state.hpp"

// All words but motion.
namespace trunnion::nc {
namespace {

// It holds a length, in the unit of the program.
bool is_length(Placeholder p) {
  switch (p) {
    case Placeholder::x:
    case Placeholder::y:
    case Placeholder::z:
    case Placeholder::i:
    case Placeholder::j:
    case Placeholder::bottom:
    case Placeholder::clear:
    case Placeholder::depth:
    case Placeholder::back:
    case Placeholder::rise:
    case Placeholder::step:
    case Placeholder::position:
    case Placeholder::pitch:
    case Placeholder::lead:
      return true;
    default:
      return false;
  }
}

// Without a point it is a number of the control's smallest increments.
bool counts_increments(Placeholder p) {
  return is_length(p) || p == Placeholder::a || p == Placeholder::b || p == Placeholder::c ||
         p == Placeholder::seconds;
}

}  // namespace

bool Reader::State::keep(const Word& word) {
  auto placeholder = language.simple.kept[static_cast<std::size_t>(word.letter - '@') & 31U];
  if (placeholder == 0 && language.others && word.letter == 'S')
    placeholder = static_cast<std::uint8_t>(Placeholder::rpm) + 1;
  if (placeholder == 0) return false;
  kept.set(static_cast<Placeholder>(placeholder - 1), word.number);
  // A speed alone changes that of a spindle that turns; whether it does behind a tap is not known.
  Spindle now = modal.spindle.value_or(Spindle{});
  if (static_cast<Placeholder>(placeholder - 1) == Placeholder::rpm && now.turn != SpindleTurn::off &&
      to_rounded_quanta(word.number, 0, now.rpm) && now.rpm != modal.spindle->rpm) {
    modal.spindle = now;
    emit(now);
  }
  return true;
}

std::vector<FoundEvent> Reader::State::find_events(LineMotion& m) {
  std::vector<FoundEvent> events;
  for (auto& phrase : parsed.phrases) {
    note_pattern(phrase);
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
  for (const auto& pattern : language.patterns.words) {
    const auto kind = pattern.event.kind;
    if (kind == EventKind::motion || kind == EventKind::feed_mode) continue;  // left to take_simple
    FoundEvent found;
    if (!match_words(pattern, found)) continue;
    found.pattern = &pattern;
    note_pattern(found);
    if (kind == EventKind::rapid_suffix) m.rapid = true;
    if (pattern.counts == Counts::increments) program.increments_since = findings.line;
    m.absolute = m.absolute || pattern.counts == Counts::absolute;
    if (kind != EventKind::silent && kind != EventKind::rapid_suffix) events.push_back(std::move(found));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.event.kind < b.event.kind; });
  return events;
}

void Reader::State::note_head() {
  for (std::size_t i = 0; i < parsed.word_count; ++i)
    program.frame->head(pattern_key(text_of(parsed.words[i])));
  for (const FoundEvent& phrase : parsed.phrases) program.frame->head(phrase.pattern->key);
}

void Reader::State::note_pattern(const FoundEvent& found) {
  if (!program.frame) return;
  const std::string message = program.frame->take(*found.pattern, findings.line);
  if (!message.empty()) error(std::max(found.column, 1U), message);
}

bool Reader::State::may_move(std::uint32_t column) {
  if (!program.frame) return true;
  program.said_anything = true;
  const std::string message = program.frame->moves();
  if (!message.empty()) error(column, message);
  return message.empty();
}

// At the ends of a program only.
void Reader::State::run_tape(const FoundEvent& found) {
  if (!program.frame || program.ended || !program.said_anything) return;
  error(std::max(found.column, 1U),
        "the program ends here for the control, which does not run what stands behind it");
}

Word* Reader::State::find_word(const PatternWord& wanted) {
  for (std::size_t i = 0; i < parsed.word_count; ++i) {
    Word& word = parsed.words[i];
    if (word.letter != wanted.letter || word.used || word.by_name || word.means == Word::Means::way) continue;
    if (!wanted.is_fixed || equal(word.number, wanted.number)) return &word;
  }
  return nullptr;
}

bool Reader::State::match_words(const Pattern& pattern, FoundEvent& found) {
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

void Reader::State::run_events(const std::vector<FoundEvent>& events, LineMotion& m) {
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
    const bool is_shape = kind == EventKind::arc || kind == EventKind::cycle || kind == EventKind::probe;
    if (is_shape && m.named) return error(std::max(found.column, 1U), "two motion words in one block");
    if (is_shape) take_modes(m);
    run_event(found);
  }
  if (!moved) run_motion(m);
}

bool Reader::State::excludes_motion(EventKind kind) {
  return kind == EventKind::tool || kind == EventKind::dwell || kind == EventKind::retract ||
         kind == EventKind::offset_shift || kind == EventKind::latch || kind == EventKind::run_time_step ||
         kind == EventKind::arc || kind == EventKind::cycle || kind == EventKind::probe ||
         kind == EventKind::plane_on || kind == EventKind::plane_off || kind == EventKind::program_start;
}

std::int64_t Reader::State::whole(const FoundEvent& found, Placeholder p, std::int64_t fallback) {
  const Number* number = found.captures.has(p) ? &found.captures[p] : kept.has(p) ? &kept[p] : nullptr;
  std::int64_t out = fallback;
  if (number == nullptr) return out;
  if (p == Placeholder::tool || p == Placeholder::length_offset || p == Placeholder::index) {
    if (!to_quanta(*number, 0, out))
      error(found.column, "a number that counts things is not whole, or too large");
  } else if (!to_rounded_quanta(*number, 0, out)) {
    error(found.column, "number too large");
  } else if (language.others && p == Placeholder::milliseconds && number->has_point) {
    error(found.column, "a dwell in milliseconds with a decimal point: controls differ in its unit");
  }
  return out;
}

std::int64_t Reader::State::scaled(const FoundEvent& found, Placeholder p, int decimals) {
  const Number* number = found.captures.has(p) ? &found.captures[p] : kept.has(p) ? &kept[p] : nullptr;
  std::int64_t out = 0;
  if (number != nullptr && !to_quanta(*number, decimals, out)) {
    error(found.column, std::string("{") + std::string(name_of(p)) + "} has more decimals than " +
                            std::to_string(decimals));
  }
  if (number != nullptr && language.others && c.numbers.point_required && !number->has_point && out != 0 &&
      counts_increments(p)) {
    error(found.column, std::string("{") + std::string(name_of(p)) +
                            "} has no decimal point: the control would take it for a number of increments");
  }
  return language.others && is_length(p) ? language.others->length(out) : out;
}

void Reader::State::keep_captures(const FoundEvent& found) {
  for (std::size_t i = 0; i < kPlaceholders; ++i) {
    const auto p = static_cast<Placeholder>(i);
    const bool lasts =
        found.event.kind == EventKind::remember || p == Placeholder::tool || p == Placeholder::rpm;
    if (lasts && found.captures.has(p)) kept.set(p, found.captures[p]);
  }
}

void Reader::State::run_event(const FoundEvent& found) {
  keep_captures(found);
  if (language.others && found.event.kind == EventKind::remember &&
      found.pattern->origin.starts_with("[tilted_plane] on"))
    program.plane_since = findings.line;
  if (found.event.kind == EventKind::plane_off) program.plane_since = 0;
  if (found.event.kind == EventKind::tape && language.others)
    return error(std::max(found.column, 1U),
                 "words in the line of '%', at which the control begins or stops reading");
  if (found.event.kind == EventKind::tape) return run_tape(found);
  if (found.event.kind != EventKind::program_start) program.said_anything = true;
  switch (found.event.kind) {
    case EventKind::program_start:
      return run_program_start(found);
    case EventKind::allowed:
      return emit(AllowedWord{c.allowed[static_cast<std::size_t>(found.event.argument)]});
    case EventKind::program_end:
      program.ended = true;
      return emit(ProgramEnd{});
    case EventKind::spindle:
      return run_spindle(found);
    case EventKind::clamp:
      return run_clamp(found.event.argument);
    case EventKind::coolant:
      return run_coolant(static_cast<CoolantKind>(found.event.argument));
    case EventKind::tool:
      return run_tool(found);
    case EventKind::length_on:
      return run_length(whole(found, Placeholder::length_offset, 1));
    case EventKind::length_off:
      return run_length(0);
    case EventKind::tcp_on:
      return run_tcp(true, whole(found, Placeholder::length_offset, 0));
    case EventKind::tcp_off:
      return run_tcp(false, 0);
    case EventKind::length_or_tcp_off:
      return modal.tcp ? run_tcp(false, 0) : run_length(0);
    case EventKind::work_offset:
      return run_work_offset(found.event.argument);
    case EventKind::offset_shift:
      return run_offset_shift(found);
    case EventKind::latch:
      return run_latch(found);
    case EventKind::run_time_step:
      return run_run_time_step(found);
    case EventKind::path_mode:
      return run_path_mode(found);
    case EventKind::plane_on:
      return run_plane(found);
    case EventKind::plane_off:
      check_origin(found);
      if (!modal.plane) return;
      if (language.others) language.others->take_frame_back();
      modal.switch_plane(false);
      return emit(TiltedPlane{});
    case EventKind::cutter:
      return run_cutter(found);
    case EventKind::cycle_name:
      cycle_return.named = found.event.argument;
      return;
    case EventKind::cycle_return:
      cycle_return.to_clear = found.event.argument == 1;
      // Said between two holes, it is about the next one.
      if (modal.cycle) modal.cycle->words.set(AxisLetter::Z, cycle_return.of(modal.cycle->clear));
      return;
    case EventKind::cycle_off:
      if (modal.cycle) modal.motion_kind.reset();
      modal.cycle.reset();
      return;
    case EventKind::arc:
      return run_arc(found);
    case EventKind::cycle: {
      FoundEvent called = found;
      if (cycle_return.named && (*cycle_return.named >= static_cast<int>(Hole::Kind::tap) ||
                                 found.event.argument >= static_cast<int>(Hole::Kind::tap)))
        called.event.argument = *cycle_return.named;
      return run_cycle(called);
    }
    case EventKind::probe:
      return run_probe(found);
    case EventKind::probe_log:
      return emit(ProbeLog{static_cast<ProbeLog::Kind>(found.event.argument), found.captures.name});
    case EventKind::dwell:
      return run_dwell(found);
    case EventKind::retract:
      return run_retract(found);
    case EventKind::stop:
      return emit(Stop{found.event.argument == 1});
    default:
      return;
  }
}

void Reader::State::run_program_start(const FoundEvent& found) {
  if ((program.frame || language.others) && (program.said_anything || modal.position.mask != 0))
    return error(std::max(found.column, 1U), "another program begins here");
  if (program.started) return;
  ProgramStart start;
  start.name = found.captures.name;
  start.number = whole(found, Placeholder::number, 1);
  emit(start);
}

void Reader::State::run_spindle(const FoundEvent& found) {
  Spindle now;
  now.turn = static_cast<SpindleTurn>(found.event.argument);
  if (now.turn != SpindleTurn::off) {
    now.rpm = whole(found, Placeholder::rpm, 0);
    if (now.rpm <= 0) return error(found.column, "the spindle is to turn without a speed");
  }
  if (modal.turn_spindle(now)) emit(now);
}

void Reader::State::run_coolant(CoolantKind kind) {
  if (modal.switch_coolant(kind)) emit(Coolant{kind});
}

void Reader::State::run_clamp(int argument) {
  const auto& clamp = c.clamps[static_cast<std::size_t>(argument / 2)];
  const bool on = argument % 2 == 1;
  modal.clamp(clamp.axes, on);
  emit(Clamp{clamp.axes, on});
}

// The drive would work against the brake.
bool Reader::State::turns_clamped(const LineMotion& m) {
  for (unsigned rest = m.words.mask & modal.clamped; rest != 0; rest &= rest - 1) {
    const auto letter = static_cast<AxisLetter>(std::countr_zero(rest));
    const auto to = c.rotary.modulo_axes != 0 ? unwrapped(letter, m.words[letter]) : m.words[letter];
    if (modal.position.has(letter) && modal.position[letter] == to) continue;
    error(m.column, std::string("axis ") + letter_of(letter) + " turns while it is clamped");
    return true;
  }
  return false;
}

void Reader::State::run_tool(const FoundEvent& found) {
  ToolCall call;
  call.tool = whole(found, Placeholder::tool, -1);
  if (call.tool < 0) return error(found.column, "a tool change without a tool");
  call.length_offset = whole(found, Placeholder::length_offset, call.tool);
  if (language.others && modal.tcp && c.tcp.off_for_tool_change && !c.tcp.switches_kinematics)
    return error(std::max(found.column, 1U), "a tool change under tool-centre-point control: end that first");
  modal.change_tool();
  emit(call);
}

void Reader::State::run_length(std::int64_t number) {
  if (number == modal.length && !(modal.tcp && c.tcp.replaces_length)) return;
  if (modal.tcp && c.tcp.replaces_length) run_tcp(false, 0);
  const AxisWords before = modal.position;
  modal.set_length(number);
  // The length counts along Z; X and Y that stood before it are as good as before.
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) {
    if (language.others && !modal.tcp && !modal.plane && before.has(letter))
      modal.position.set(letter, before[letter]);
  }
  emit(LengthCompensation{number});
}

void Reader::State::run_tcp(bool on, std::int64_t offset) {
  if (on && language.others && !language.others->frame().is_idle() &&
      (language.others->frame().turns() || c.offset_shift.not_under_tcp))
    return error(
        1, "tool-centre-point control, and the program's own shift or turn is in force: end that first");
  if (!modal.switch_tcp(on, offset, c.tcp.replaces_length)) return;
  if (language.others) language.others->forget_pole();
  emit(TcpControl{on, offset});
}

// A motion under kinematics that are not known may go anywhere.
bool Reader::State::kinematics_unknown(std::uint32_t column) {
  if (modal.tcp_known) return false;
  error(column, "the program has not said which kinematics are active: '" + c.tcp.off.back() + "' or '" +
                    c.tcp.on.back() + "' must stand before the first motion");
  modal.tcp_known = true;  // said once
  return true;
}

void Reader::State::run_work_offset(std::int64_t index) {
  // A preset takes back all shifts, on controls that have cycles for both.
  const bool ends_shift = !c.input.places.datum_shift.empty();
  if (language.others && ends_shift && program.shift_added)
    return error(1, "a preset, and the program's own shift is in force: end that first");
  if (language.others && !language.others->frame().is_idle() &&
      (ends_shift || (modal.work_offset != 0 && modal.work_offset != index)))
    return error(1, "another work offset, and the program's own shift or turn is in force: end that first");
  const AxisWords before = modal.position;
  if (!modal.call_work_offset(index)) return;
  if (language.others) language.others->forget_pole();
  // Rotary axes have no offset here, nor in a place of the machine.
  for (const AxisLetter letter : kAllAxisLetters)
    if (language.others && is_rotary(letter) && before.has(letter))
      modal.position.set(letter, before[letter]);
  emit(WorkOffset{index});
}

void Reader::State::run_offset_shift(const FoundEvent& found) {
  if (language.others && language.others->in_increments())
    return error(std::max(found.column, 1U), "an offset that is set under '" + c.incremental.on +
                                                 "': controls differ in whether it is added");
  OffsetShift now;
  now.kind = static_cast<OffsetShift::Kind>(found.event.argument);
  if (now.kind == OffsetShift::Kind::add && language.others && !language.others->frame().is_idle())
    return error(std::max(found.column, 1U),
                 "a shift, and another one of the program's own is in force: end that first");
  if (now.kind == OffsetShift::Kind::set) now.index = whole(found, Placeholder::index, 1);
  if (now.kind == OffsetShift::Kind::set && c.offset_shift.last_set > 0 &&
      now.index > c.offset_shift.last_set)
    return error(std::max(found.column, 1U), "an offset of number " + std::to_string(now.index) +
                                                 " is set: these words set the first " +
                                                 std::to_string(c.offset_shift.last_set));
  if (now.kind == OffsetShift::Kind::set && language.others && now.index < 1)
    return error(std::max(found.column, 1U), "an offset of number " + std::to_string(now.index) +
                                                 " is set: what it counts for differs between controls");
  static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
  for (std::size_t i = 0; i < 3; ++i)
    now.offset[i] = scaled(found, kOrigin[i], language.format.decimals(AxisLetter::X));
  if (language.others) language.others->forget_pole();
  if (now.kind == OffsetShift::Kind::add) program.shift_added = now.offset != std::array<std::int64_t, 3>{};
  modal.position.forget(kLinearAxes);
  emit(now);
}

void Reader::State::run_latch(const FoundEvent& found) {
  const int decimals = language.format.decimals(AxisLetter::X);
  LatchValues now;
  now.first = !std::exchange(latched, true);
  now.clamp = scaled(found, Placeholder::clamp, decimals);
  now.step = scaled(found, Placeholder::step, decimals);
  now.dead_band = scaled(found, Placeholder::dead_band, decimals);
  emit(now);
}

void Reader::State::run_run_time_step(const FoundEvent& found) {
  using Kind = RunTimeStep::Kind;
  const auto& t = c.run_time_temperatures;
  RunTimeStep step;
  const bool subtracts = found.event.argument == kSubtract;
  step.kind = subtracts ? Kind::add : static_cast<Kind>(found.event.argument);
  const auto fault = [&] { error(found.column, "a variable that the controller file does not name"); };
  const auto axis_of = [&](const std::array<std::int64_t, 3>& known, Placeholder p) {
    return static_cast<std::size_t>(std::find(known.begin(), known.end(), whole(found, p, 0)) -
                                    known.begin());
  };
  if (step.kind == Kind::start || step.kind == Kind::add) {
    step.axis = axis_of(c.run_time.source, Placeholder::target);
    if (step.axis > 2) return fault();
  }
  if (step.kind == Kind::start && axis_of(t.measured, Placeholder::measured) != step.axis) return fault();
  if (step.kind == Kind::read || step.kind == Kind::reference || step.kind == Kind::add) {
    const std::int64_t sensor = whole(found, Placeholder::temperature, 0) - t.first;
    if (sensor < 0 || sensor >= t.count) return fault();
    step.sensor = static_cast<std::size_t>(sensor);
    if (step.kind == Kind::read && whole(found, Placeholder::channel, sensor) != sensor) return fault();
    if (step.kind != Kind::read && whole(found, Placeholder::reference, 0) != t.first_reference + sensor)
      return fault();
  }
  if (step.kind == Kind::add)
    step.factor = (subtracts ? -1 : 1) * scaled(found, Placeholder::factor, kFactorDecimals);
  emit(step);
}

void Reader::State::run_path_mode(const FoundEvent& found) {
  PathMode now;
  now.kind = static_cast<PathModeKind>(found.event.argument);
  now.tolerance = scaled(found, Placeholder::tolerance, language.format.decimals(AxisLetter::X));
  if (modal.set_path_mode(now)) emit(now);
}

void Reader::State::run_cutter(const FoundEvent& found) {
  CutterCompensation now;
  now.side = static_cast<CutterSide>(found.event.argument);
  if (now.side != CutterSide::off) now.number = whole(found, Placeholder::number, 0);
  if (modal.switch_cutter(now)) emit(now);
}

void Reader::State::run_plane(const FoundEvent& found) {
  // Its words may stand in a line of their own.
  if (std::exchange(program.plane_since, 0) == 0 && language.others && !found.captures.has(Placeholder::a))
    return error(std::max(found.column, 1U),
                 "'" + c.tilted_plane.on.back() + "', and no tilted plane is said");
  const bool counts_from_shift = language.others && !c.input.places.datum_shift.empty();
  if (language.others && !counts_from_shift && !language.others->frame().is_idle())
    return error(std::max(found.column, 1U),
                 "a tilted plane, and the program's own shift or turn is in force: end that first");
  TiltedPlane now;
  now.on = true;
  static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
  static constexpr std::array kAngle = {Placeholder::a, Placeholder::b, Placeholder::c};
  for (std::size_t i = 0; i < 3; ++i) {
    now.origin[i] = scaled(found, kOrigin[i], language.format.decimals(AxisLetter::X));
    now.angles[i] = scaled(found, kAngle[i], language.format.decimals(AxisLetter::A));
  }
  if (counts_from_shift && modal.plane) language.others->take_frame_back();
  if (counts_from_shift) now.origin = language.others->set_frame_aside();
  const std::int64_t direction = whole(found, Placeholder::direction, 1);
  if (language.others && direction == 0)
    return error(
        std::max(found.column, 1U),
        "a tilted plane that leaves the rotary axes where they are (direction 0): where they stand to "
        "it is not said");
  now.direction = direction < 0 ? -1 : 1;
  modal.switch_plane(true);
  emit(now);
}

// Where an end of several lines takes the origin back, all of it.
void Reader::State::check_origin(const FoundEvent& found) {
  if (!program.frame || c.tilted_plane.off.size() < 2) return;
  for (const Placeholder p : {Placeholder::x, Placeholder::y, Placeholder::z}) {
    if (kept.has(p) && kept[p].mantissa != 0)
      return error(std::max(found.column, 1U), "the tilted plane ends and its shift of the origin stays");
  }
}

void Reader::State::run_dwell(const FoundEvent& found) {
  Dwell now;
  const bool in_seconds = found.captures.has(Placeholder::seconds);
  const bool counts_thousandths = language.others && c.input.lines.dwell_without_point_ms && in_seconds &&
                                  !found.captures[Placeholder::seconds].has_point;
  if (in_seconds && !counts_thousandths)
    now.milliseconds = scaled(found, Placeholder::seconds, 3);
  else
    now.milliseconds = whole(found, in_seconds ? Placeholder::seconds : Placeholder::milliseconds, 0);
  emit(now);
}

void Reader::State::run_retract(const FoundEvent& found) {
  const auto letter = static_cast<AxisLetter>(found.event.argument);
  Retract now{AxisWords::bit(letter), {}};
  if (c.names_position(letter)) {
    now.to.set(letter, scaled(found, Placeholder::position, language.format.decimals(letter)));
    const Number& number = found.captures[Placeholder::position];
    if (c.numbers.point_required && !number.has_point && now.to[letter] != 0) {
      return error(found.column,
                   std::string("the position of ") + letter_of(letter) +
                       " has no decimal point: the control would take it for a number of increments");
    }
  }
  if (!may_move(found.column) || kinematics_unknown(found.column)) return;
  modal.position.forget(letter);
  modal.motion_kind.reset();
  modal.cycle.reset();
  if (c.retract_ends_length && modal.length > 0) modal.length = kUnknown;
  emit(now);
}

}  // namespace trunnion::nc
