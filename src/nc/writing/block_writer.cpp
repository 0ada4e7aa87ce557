// All blocks but motion.
#include "nc/writing/block_writer.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/control/comment_text.hpp"

namespace trunnion::nc {

Result<void> BlockWriter::flush_setup(bool with_default_path_mode) {
  s_.due.setup = false;
  if (auto done = s_.put_template(s_.c.program.setup, {}); !done) return done;
  if (auto done = s_.put_template(s_.c.program.ends_earlier, {}); !done) return done;
  if (with_default_path_mode && s_.c.default_path_mode) return write(PathMode{*s_.c.default_path_mode, 0});
  return {};
}

Result<void> BlockWriter::switch_tcp_off() {
  if (!s_.modal.tcp || !s_.c.tcp.off_for_tool_change) return {};
  return write(TcpControl{});
}

Result<void> BlockWriter::suspend_tcp(bool must_be_off) {
  if (!s_.modal.tcp || !must_be_off) return {};
  const TcpControl before{true, s_.modal.tcp_offset};
  if (auto done = write(TcpControl{}); !done) return done;
  s_.due.tcp = before;
  return {};
}

Result<void> BlockWriter::step(AxisLetter axis, std::int64_t distance, std::int64_t feed_quanta) {
  TRUNNION_EXPECTS(s_.started && !s_.ended && feed_quanta > 0);
  if (s_.due.setup) {
    if (auto done = flush_setup(true); !done) return done;
  }
  if (auto done = free_axes(AxisWords::bit(axis)); !done) return done;
  s_.modal.position.forget(kAllAxes);
  s_.modal.motion_kind.reset();
  s_.modal.feed_mode = FeedMode::per_minute;
  s_.feed = {kUnknown, kUnknown};
  const auto per_minute = static_cast<std::size_t>(FeedMode::per_minute);
  const auto values = Values()
                          .set(Placeholder::axis, std::string(1, letter_of(axis)))
                          .set(Placeholder::distance, s_.number_text(distance, s_.forms.of_axis(axis)))
                          .set(Placeholder::feed, s_.number_text(feed_quanta, s_.forms.feed[per_minute]));
  return s_.put_words(s_.c.incremental.move, values, "a motion from where the axis stands",
                      "[incremental] move");
}

Result<void> BlockWriter::write(const ProgramStart& b) {
  TRUNNION_EXPECTS(!s_.started);
  for (const char ch : b.name) {
    const bool ok = (ch >= '0' && ch <= '9') || (ch >= 'A' && ch <= 'Z') || (ch >= 'a' && ch <= 'z') ||
                    ch == '_' || ch == '-';
    if (!ok) return s_.refuse("the program name '" + b.name + "' may hold letters, digits, _ and - only");
  }
  if (b.number <= 0) return s_.refuse("the program number must be positive, not " + std::to_string(b.number));
  s_.started = true;
  s_.due.setup = true;
  program_name_ = b.name.empty() ? "PROGRAM" : b.name;
  program_number_ = b.number;
  return s_.put_template(s_.c.program.begin, program_values());
}

Result<void> BlockWriter::write(const ProgramEnd&) {
  if (auto done = switch_tcp_off(); !done) return done;
  if (s_.modal.feed_mode == FeedMode::inverse_time && !s_.c.feed.per_minute.empty()) {
    s_.modal.feed_mode = FeedMode::per_minute;
    if (auto done = s_.put_line(s_.c.feed.per_minute); !done) return done;
  }
  if (s_.modal.path_mode && s_.modal.path_mode->kind == PathModeKind::continuous) {
    if (auto done = s_.put_template(s_.c.continuous_off, {}); !done) return done;
  }
  s_.ended = true;
  return s_.put_template(s_.c.program.end, program_values());
}

Result<void> BlockWriter::write(const Comment& b) {
  const std::string blank = s_.c.comments.close.empty() ? " " : "";
  for (const std::string& line : comment_lines(s_.c.comments, b.text, b.foreign)) {
    if (auto done = s_.put_line(s_.c.comments.open + blank + line + s_.c.comments.close); !done) return done;
  }
  return {};
}

Result<void> BlockWriter::write(const Raw& b) {
  if (b.text.find_first_of("\r\n") != std::string::npos) return s_.refuse("a raw line must be one line");
  return s_.put_line(b.text);
}

Result<void> BlockWriter::write(const AllowedWord& b) {
  return s_.put_line(b.text);
}

Result<void> BlockWriter::write(const Dwell& b) {
  if (b.milliseconds <= 0) return {};
  const NumberStyle style = s_.forms.unsigned_of(s_.c.dwell_decimals);
  const std::int64_t step = kPowersOfTen[static_cast<std::size_t>(3 - s_.c.dwell_decimals)];
  Values values;
  values.set(Placeholder::seconds, s_.number_text((b.milliseconds + step / 2) / step, style));
  values.set(Placeholder::milliseconds, std::to_string(b.milliseconds));
  return s_.put_words(s_.c.dwell, values, "a dwell", "[dwell] words");
}

Result<void> BlockWriter::write(const Spindle& b) {
  const std::int64_t rpm = b.turn == SpindleTurn::off ? 0 : b.rpm;
  if (b.turn != SpindleTurn::off && rpm <= 0)
    return s_.refuse("the spindle is to turn at " + std::to_string(b.rpm) + " rpm");
  if (!s_.modal.turn_spindle({b.turn, rpm})) return {};
  if (rpm > 0 && s_.modal.tcp && s_.c.speed_not_under_tcp)
    return s_.refuse("the control takes no speed of the spindle under tool-centre-point control");
  const auto& words = b.turn == SpindleTurn::off         ? s_.c.spindle_off
                      : b.turn == SpindleTurn::clockwise ? s_.c.spindle_clockwise
                                                         : s_.c.spindle_counterclockwise;
  return s_.put_words(words, Values().set(Placeholder::rpm, std::to_string(rpm)), "this spindle command",
                      "[spindle]");
}

Result<void> BlockWriter::write(const Coolant& b) {
  const auto kind = static_cast<std::size_t>(b.kind);
  if (!s_.modal.switch_coolant(b.kind)) return {};
  static constexpr std::array kWhat = {"coolant off", "flood coolant", "mist coolant",
                                       "coolant through the tool", "air"};
  return s_.put_words(s_.c.coolant[kind], {}, kWhat[kind], std::string("[coolant] ") + kCoolantNames[kind]);
}

Result<void> BlockWriter::write(const ToolSelect& b) {
  if (b.tool < 0) return s_.refuse("a tool number must not be negative");
  return s_.put_words(s_.c.tool_preselect, Values().set(Placeholder::tool, std::to_string(b.tool)),
                      "getting a tool ready", "[tool] preselect");
}

Result<void> BlockWriter::write(const Clamp& b) {
  for (const auto& clamp : s_.c.clamps) {
    if (clamp.axes != b.axes) continue;
    const unsigned in_force = (b.on ? s_.modal.clamped : freed_) & clamp.axes;
    if (in_force != 0) return {};
    s_.modal.clamp(clamp.axes, b.on);
    freed_ = static_cast<std::uint16_t>(b.on ? freed_ & ~clamp.axes : freed_ | clamp.axes);
    return s_.put_template(b.on ? clamp.on : clamp.off, {});
  }
  return s_.no_words("clamping these axes", "[clamp]");
}

// Whether they are clamped is not known where a program begins.
Result<void> BlockWriter::free_axes(std::uint16_t axes) {
  for (const auto& clamp : s_.c.clamps) {
    if ((clamp.axes & axes) == 0) continue;
    if (auto done = write(Clamp{clamp.axes, false}); !done) return done;
  }
  return {};
}

Result<void> BlockWriter::write(const ToolCall& b) {
  if (b.tool < 0 || b.length_offset < 0)
    return s_.refuse("tool and length offset numbers must not be negative");
  if (auto done = switch_tcp_off(); !done) return done;
  s_.modal.change_tool();
  s_.due.change_tool();
  const auto values = Values()
                          .set(Placeholder::tool, std::to_string(b.tool))
                          .set(Placeholder::length_offset, std::to_string(b.length_offset));
  if (auto done = s_.put_words(s_.c.tool_change, values, "a tool change", "[tool] change"); !done)
    return done;
  return s_.motions > 0 ? restate_modes() : Result<void>{};
}

// An operator who begins at a tool change, behind a reset, has the modes that the control starts with: it
// counts in its first work offset and takes F per minute.
Result<void> BlockWriter::restate_modes() {
  if (auto done = s_.put_template(s_.c.program.modes, {}); !done) return done;
  s_.modal.feed_mode = FeedMode::per_minute;
  s_.modal.motion_kind.reset();
  s_.feed = {kUnknown, kUnknown};
  freed_ = 0;
  if (const auto mode = std::exchange(s_.modal.path_mode, {})) {
    if (auto done = write(*mode); !done) return done;
  }
  // A preset takes back all shifts, on controls that have cycles for both, and outlasts a reset; so does the
  // end of a plane there.
  const bool ends_shift = !s_.c.input.places.datum_shift.empty();
  if (shift_ && ends_shift) return {};
  if (!s_.modal.plane) {
    if (auto done = s_.put_template(s_.c.program.ends_earlier, {}); !done) return done;
  }
  if (s_.c.tcp.unknown_at_start) {
    if (auto done = s_.put_template(s_.c.tcp.off, {}); !done) return done;
  }
  if (s_.modal.work_offset > 0) {
    const std::int64_t offset = std::exchange(s_.modal.work_offset, 0);
    if (auto done = write(WorkOffset{offset}); !done) return done;
  }
  return shift_ ? write(OffsetShift(*shift_)) : Result<void>{};
}

Result<void> BlockWriter::write(const LengthCompensation& b) {
  const std::int64_t number =
      holds(s_.c.length.on, Placeholder::length_offset) ? b.number : std::min<std::int64_t>(b.number, 1);
  s_.due.length.reset();
  if (s_.c.length.automatic || s_.modal.length == number) return {};
  s_.modal.set_length(number);
  s_.due.in_motion_is_tcp = false;
  s_.due.in_motion.clear();
  if (number == 0) return s_.put_words(s_.c.length.off, {}, "the end of length compensation", "[length] off");
  const auto values = Values().set(Placeholder::length_offset, std::to_string(number));
  return s_.c.length.with_motion
             ? put_with_motion(s_.c.length.on, values, "length compensation", "[length] on")
             : s_.put_words(s_.c.length.on, values, "length compensation", "[length] on");
}

Result<void> BlockWriter::write(const CutterCompensation& b) {
  const std::int64_t number = b.side == CutterSide::off ? 0 : b.number;
  if (b.side == s_.modal.cutter.side && number == s_.modal.cutter.number) return {};
  if (b.side != CutterSide::off && s_.modal.cutter.side != CutterSide::off)
    return s_.refuse("cutter compensation must be off before it changes its side or register");
  const Template& words = s_.c.cutter_compensation[static_cast<std::size_t>(b.side)];
  if (words.empty()) return s_.no_words("cutter compensation", "[cutter_compensation]");
  s_.modal.switch_cutter({b.side, number});
  s_.due.cutter.clear();
  const auto values = Values().set(Placeholder::number, std::to_string(number));
  for (const auto& line : words) s_.due.cutter += render(line, values) + s_.c.line.separator;
  return {};
}

Result<void> BlockWriter::end_cutter_compensation(const char* before) {
  if (s_.modal.cutter.side != CutterSide::off)
    return s_.refuse(std::string("cutter compensation must be off before ") + before);
  if (s_.due.cutter.empty()) return {};
  s_.due.cutter.clear();
  return s_.put_template(s_.c.cutter_compensation[0], {});
}

Result<void> BlockWriter::write(const TcpControl& b) {
  const bool has_offset = b.on && holds(s_.c.tcp.on, Placeholder::length_offset);
  const std::int64_t offset = has_offset ? b.length_offset : 0;
  s_.due.tcp.reset();
  if (!s_.modal.switch_tcp(b.on, offset, s_.c.tcp.replaces_length)) return {};
  s_.due.in_motion_is_tcp = b.on;
  s_.due.in_motion.clear();
  if (!b.on) return s_.put_words(s_.c.tcp.off, {}, "the end of tool-centre-point control", "[tcp] off");
  const auto values = Values().set(Placeholder::length_offset, std::to_string(offset));
  return s_.c.tcp.with_motion ? put_with_motion(s_.c.tcp.on, values, "tool-centre-point control", "[tcp] on")
                              : s_.put_words(s_.c.tcp.on, values, "tool-centre-point control", "[tcp] on");
}

Result<void> BlockWriter::write(const WorkOffset& b) {
  if (b.index == s_.modal.work_offset) return {};
  if (b.index < 1 || static_cast<std::size_t>(b.index) > s_.c.work_offsets.size()) {
    return s_.refuse("work offset " + std::to_string(b.index) + ": the controller file has " +
                     std::to_string(s_.c.work_offsets.size()));
  }
  s_.modal.call_work_offset(b.index);
  return s_.put_template(s_.c.work_offsets[static_cast<std::size_t>(b.index) - 1], {});
}

// The same words again are written again: whether an operator has changed the offset in between is not known.
Result<void> BlockWriter::write(const OffsetShift& b) {
  if (auto done = suspend_tcp(s_.c.offset_shift.not_under_tcp); !done) return done;
  s_.modal.position.forget(kLinearAxes);
  if (b.kind == OffsetShift::Kind::add)
    shift_ = b.offset != std::array<std::int64_t, 3>{} ? std::optional(b) : std::nullopt;
  Values values;
  values.set(Placeholder::index, std::to_string(b.index));
  for (std::size_t i = 0; i < 3; ++i) values.set(kPlaceXyz[i], s_.number_text(b.offset[i], s_.forms.linear));
  return b.kind == OffsetShift::Kind::set
             ? s_.put_words(s_.c.offset_shift.set, values, "setting a work offset", "[offset_shift] set")
             : s_.put_words(s_.c.offset_shift.add, values, "a shift beside the work offset",
                            "[offset_shift] add");
}

Result<void> BlockWriter::write(const LatchValues& b) {
  if (!s_.c.has_run_time_values()) return s_.no_words("values at run time", "[run_time]");
  if (b.first) {
    if (auto done = s_.put_template(s_.c.run_time.begin, {}); !done) return done;
  }
  const NumberStyle style = s_.forms.unsigned_length();
  const auto values = Values()
                          .set(Placeholder::clamp, s_.number_text(b.clamp, style))
                          .set(Placeholder::step, s_.number_text(b.step, style))
                          .set(Placeholder::dead_band, s_.number_text(b.dead_band, style));
  return s_.put_template(s_.c.run_time.latch, values);
}

Result<void> BlockWriter::write(const RunTimeStep& b) {
  using Kind = RunTimeStep::Kind;
  const auto& t = s_.c.run_time_temperatures;
  if (!s_.c.has_run_time_temperatures())
    return s_.no_words("calculating with temperatures", "[run_time_temperatures]");
  TRUNNION_EXPECTS(b.axis < 3);
  const auto sensor = static_cast<std::int64_t>(b.sensor);
  if (sensor >= t.count)
    return s_.refuse("the control has variables for " + std::to_string(t.count) + " temperatures only");
  const NumberStyle style = s_.forms.unsigned_of(kFactorDecimals);
  const auto values = Values()
                          .set(Placeholder::channel, std::to_string(sensor))
                          .set(Placeholder::target, std::to_string(s_.c.run_time.source[b.axis]))
                          .set(Placeholder::measured, std::to_string(t.measured[b.axis]))
                          .set(Placeholder::temperature, std::to_string(t.first + sensor))
                          .set(Placeholder::reference, std::to_string(t.first_reference + sensor))
                          .set(Placeholder::factor, s_.number_text(std::abs(b.factor), style));
  switch (b.kind) {
    case Kind::reset:
      return s_.put_template(t.reset, values);
    case Kind::read:
      return t.read.empty() ? Result<void>{} : s_.put_template(t.read, values);
    case Kind::reference:
      return s_.put_template(t.reference, values);
    case Kind::start:
      return s_.put_template(t.start, values);
    case Kind::add:
      return s_.put_template(b.factor < 0 ? t.subtract : t.add, values);
  }
  TRUNNION_EXPECTS(false);
  return {};
}

std::string BlockWriter::variable_word(AxisLetter letter, std::int64_t quanta,
                                       const std::array<std::int64_t, 3>& coefficient) const {
  const NumberStyle factor = s_.forms.unsigned_of(kCoefficientDecimals);
  std::string word(1, letter_of(letter));
  word.append(s_.c.run_time.open).append(s_.number_text(quanta, s_.forms.unsigned_length()));
  for (std::size_t k = 0; k < coefficient.size(); ++k) {
    const std::int64_t value = coefficient[k];
    if (value == 0) continue;
    word.append(value < 0 ? "-" : "+").append(s_.c.run_time.variable);
    word.append(std::to_string(s_.c.run_time.latched[k]));
    if (std::abs(value) != kPowersOfTen[kCoefficientDecimals])
      word.append("*").append(s_.number_text(std::abs(value), factor));
  }
  return word.append(s_.c.run_time.close);
}

Result<void> BlockWriter::write(const VariableMotion& b) {
  const Motion& m = b.motion;
  if (!s_.c.has_run_time_values()) return s_.no_words("values at run time", "[run_time]");
  if ((m.words.mask & kXyz) != kXyz) return s_.refuse("a motion with run-time values must name X, Y and Z");
  if (auto done = restore_after_retract(kLinearAxes); !done) return done;
  if (auto done = free_axes(s_.changed_axes(m.words)); !done) return done;
  if (m.kind == MotionKind::feed && !s_.forms.may_feed(m.feed_mode, m.feed)) return s_.refuse_feed(m);
  std::array<char, 1024> buffer;
  std::string line(buffer.data(), s_.put_leading(buffer.data(), m, !s_.due.in_motion.empty()));
  for (const AxisLetter letter : kAllAxisLetters) {
    const auto i = index(letter);
    if (!m.words.has(letter)) continue;
    if (i >= 3 && s_.modal.position.has(letter) && s_.modal.position[letter] == m.words[letter]) continue;
    if (i < 3)
      line += variable_word(letter, m.words[letter], b.coefficient[i]);
    else
      line.append(buffer.data(), s_.put_axis(buffer.data(), i, m.words[letter]));
    s_.modal.position.set(letter, m.words[letter]);
    line += s_.c.line.separator;
  }
  if (m.kind == MotionKind::feed)
    line.append(buffer.data(), s_.put_feed(buffer.data(), m));
  else
    line.append(s_.c.motion.rapid_suffix).append(s_.c.line.separator);
  while (!s_.c.line.separator.empty() && line.ends_with(s_.c.line.separator))
    line.resize(line.size() - s_.c.line.separator.size());
  s_.modal.position.forget(kLinearAxes);  // where they stand depends on the values
  ++s_.motions;
  return s_.put_line(line);
}

Result<void> BlockWriter::write(const PathMode& b) {
  if (!s_.modal.set_path_mode(b)) return {};
  if (b.tolerance > 0)
    return s_.put_words(
        s_.c.continuous_within,
        Values().set(Placeholder::tolerance, s_.number_text(b.tolerance, s_.forms.unsigned_length())),
        "path blending within a tolerance", "[path_mode] continuous_within");
  return s_.put_words(s_.c.path_modes[static_cast<std::size_t>(b.kind)], {}, "this path mode", "[path_mode]");
}

// Before the first motion that it matters to: a rotary axis that turns at the safe height must not make the
// linear axes follow.
Result<void> BlockWriter::restore_after_retract(std::uint16_t changed) {
  const std::uint16_t waits_for = s_.due.tcp ? kLinearAxes : AxisWords::bit(AxisLetter::Z);
  if ((changed & waits_for) == 0) return {};
  const auto tcp_before = std::exchange(s_.due.tcp, std::nullopt);
  const auto length_before = std::exchange(s_.due.length, std::nullopt);
  if (tcp_before && s_.c.tcp.replaces_length) return write(*tcp_before);
  if (length_before) {
    if (auto done = write(*length_before); !done) return done;
  }
  return tcp_before ? write(*tcp_before) : Result<void>{};
}

Result<void> BlockWriter::write(const Retract& b) {
  if (auto done = free_axes(b.axes); !done) return done;
  if (auto done = suspend_tcp(s_.c.tcp.off_for_tool_change); !done) return done;
  if (s_.c.retract_ends_length && s_.modal.length > 0) {
    s_.due.length = LengthCompensation{s_.modal.length};
    s_.modal.length = kUnknown;
  }
  for (const AxisLetter letter : {AxisLetter::Z, AxisLetter::W, AxisLetter::X, AxisLetter::Y, AxisLetter::A,
                                  AxisLetter::B, AxisLetter::C, AxisLetter::U, AxisLetter::V}) {
    if ((b.axes & AxisWords::bit(letter)) == 0) continue;
    const Template& words = s_.c.retract[index(letter)];
    if (words.empty()) {
      return s_.refuse(std::string("the program has to retract and [retract] ") + letter_of(letter) +
                       " has no words in " + s_.c.file);
    }
    TRUNNION_EXPECTS(!s_.c.names_position(letter) || b.to.has(letter));
    const auto values =
        Values().set(Placeholder::position, s_.number_text(b.to[letter], s_.forms.of_axis(letter)));
    if (auto done = s_.put_template(words, values); !done) return done;
    s_.modal.position.forget(letter);
  }
  s_.modal.motion_kind.reset();
  return {};
}

Result<void> BlockWriter::write(const TiltedPlane& b) {
  if (!b.on && !s_.modal.plane) return {};
  s_.modal.switch_plane(b.on);
  if (!b.on)
    return s_.put_words(s_.c.tilted_plane.off, {}, "the end of a tilted plane", "[tilted_plane] off");
  // What a retract switched off.
  if (s_.c.tilted_plane.needs_length && s_.due.length) {
    if (auto done = write(LengthCompensation(*s_.due.length)); !done) return done;
  }
  // The control may turn its rotary axes for it.
  if (auto done = free_axes(kAllAxes); !done) return done;
  Values values;
  for (std::size_t i = 0; i < 3; ++i) {
    values.set(kPlaceXyz[i], s_.number_text(b.origin[i], s_.forms.linear));
    values.set(kAnglesAbc[i], s_.number_text(b.angles[i], s_.forms.rotary));
  }
  values.set(Placeholder::direction, b.direction < 0 ? "-1" : "1");
  return s_.put_words(s_.c.tilted_plane.on, values, "a tilted plane", "[tilted_plane] on");
}

Result<void> BlockWriter::write(const Stop& b) {
  if (s_.c.stops.end_spindle) s_.modal.stop();
  if (b.axes_again) {
    s_.modal.position.forget(kAllAxes);
    s_.modal.motion_kind.reset();
  }
  return s_.put_words(b.optional ? s_.c.stops.optional : s_.c.stops.program, {},
                      b.optional ? "an optional stop" : "a stop",
                      b.optional ? "[stop] optional" : "[stop] program");
}

Values BlockWriter::program_values() const {
  return Values()
      .set(Placeholder::name, program_name_)
      .set(Placeholder::number, std::to_string(program_number_));
}

Result<void> BlockWriter::write_block(const Block& block) {
  const auto* log = std::get_if<ProbeLog>(&block);
  const bool heads = std::holds_alternative<ProgramStart>(block) || std::holds_alternative<Comment>(block) ||
                     (log != nullptr && log->kind == ProbeLog::Kind::declare);
  TRUNNION_EXPECTS(s_.started || std::holds_alternative<ProgramStart>(block));
  TRUNNION_EXPECTS(!s_.ended);
  if (s_.due.setup && !heads) {
    if (auto done = flush_setup(!std::holds_alternative<PathMode>(block)); !done) return done;
  }
  if (s_.modal.cutter.side != CutterSide::off || !s_.due.cutter.empty()) {
    const char* before = std::holds_alternative<ToolCall>(block)             ? "a tool change"
                         : std::holds_alternative<Retract>(block)            ? "a safe position"
                         : std::holds_alternative<ProgramEnd>(block)         ? "the end of the program"
                         : std::holds_alternative<WorkOffset>(block)         ? "a work offset"
                         : std::holds_alternative<OffsetShift>(block)        ? "an offset shift"
                         : std::holds_alternative<TiltedPlane>(block)        ? "a tilted plane"
                         : std::holds_alternative<TcpControl>(block)         ? "tool-centre-point control"
                         : std::holds_alternative<LengthCompensation>(block) ? "length compensation"
                         : std::holds_alternative<Hole>(block)               ? "a drilling cycle"
                         : std::holds_alternative<Probe>(block)              ? "a touch of a probe"
                         : std::holds_alternative<VariableMotion>(block)     ? "values at run time"
                                                                             : nullptr;
    if (before != nullptr) {
      if (auto done = end_cutter_compensation(before); !done) return done;
    }
  }
  if (s_.modal.cycle && !std::holds_alternative<Hole>(block) && !std::holds_alternative<Motion>(block)) {
    if (auto done = shapes_.end_cycle(); !done) return done;
  }
  return std::visit(
      [this](const auto& b) -> Result<void> {
        using Of = std::decay_t<decltype(b)>;
        if constexpr (std::is_same_v<Of, Arc> || std::is_same_v<Of, Hole> || std::is_same_v<Of, Probe> ||
                      std::is_same_v<Of, ProbeLog>) {
          return shapes_.write(b);
        } else {
          return write(b);
        }
      },
      block);
}

}  // namespace trunnion::nc
