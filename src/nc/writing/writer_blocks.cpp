#include <algorithm>
#include <cstdlib>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/control/comment_text.hpp"
#include "nc/writing/writer_state.hpp"

// All blocks but motion.
namespace trunnion::nc {

Result<void> Writer::State::flush_setup(bool with_default_path_mode) {
  due.setup = false;
  if (auto done = put_template(c.program.setup, {}); !done) return done;
  if (with_default_path_mode && c.default_path_mode) return write(PathMode{*c.default_path_mode, 0});
  return {};
}

Result<void> Writer::State::switch_tcp_off() {
  if (!modal.tcp || !c.tcp.off_for_tool_change) return {};
  return write(TcpControl{});
}

Result<void> Writer::State::suspend_tcp(bool must_be_off) {
  if (!modal.tcp || !must_be_off) return {};
  const TcpControl before{true, modal.tcp_offset};
  if (auto done = write(TcpControl{}); !done) return done;
  due.tcp = before;
  return {};
}

Result<void> Writer::State::step(AxisLetter axis, std::int64_t distance, std::int64_t feed_quanta) {
  TRUNNION_EXPECTS(started && !ended && feed_quanta > 0);
  if (due.setup) {
    if (auto done = flush_setup(true); !done) return done;
  }
  if (auto done = free_axes(AxisWords::bit(axis)); !done) return done;
  modal.position.forget(kAllAxes);
  modal.motion_kind.reset();
  modal.feed_mode = FeedMode::per_minute;
  feed = {kUnknown, kUnknown};
  const auto per_minute = static_cast<std::size_t>(FeedMode::per_minute);
  const auto values = Values()
                          .set(Placeholder::axis, std::string(1, letter_of(axis)))
                          .set(Placeholder::distance, number_text(distance, forms.of_axis(axis)))
                          .set(Placeholder::feed, number_text(feed_quanta, forms.feed[per_minute]));
  return put_words(c.incremental.move, values, "a motion from where the axis stands", "[incremental] move");
}

Result<void> Writer::State::write(const ProgramStart& b) {
  TRUNNION_EXPECTS(!started);
  for (const char ch : b.name) {
    const bool ok = (ch >= '0' && ch <= '9') || (ch >= 'A' && ch <= 'Z') || (ch >= 'a' && ch <= 'z') ||
                    ch == '_' || ch == '-';
    if (!ok) return refuse("the program name '" + b.name + "' may hold letters, digits, _ and - only");
  }
  if (b.number <= 0) return refuse("the program number must be positive, not " + std::to_string(b.number));
  started = true;
  due.setup = true;
  program_name = b.name.empty() ? "PROGRAM" : b.name;
  program_number = b.number;
  return put_template(c.program.begin, program_values());
}

Result<void> Writer::State::write(const ProgramEnd&) {
  if (auto done = switch_tcp_off(); !done) return done;
  if (modal.feed_mode == FeedMode::inverse_time && !c.feed.per_minute.empty()) {
    modal.feed_mode = FeedMode::per_minute;
    if (auto done = put_line(c.feed.per_minute); !done) return done;
  }
  if (modal.path_mode && modal.path_mode->kind == PathModeKind::continuous) {
    if (auto done = put_template(c.continuous_off, {}); !done) return done;
  }
  ended = true;
  return put_template(c.program.end, program_values());
}

Result<void> Writer::State::write(const Comment& b) {
  const std::string blank = c.comments.close.empty() ? " " : "";
  for (const std::string& line : comment_lines(c.comments, b.text, b.foreign)) {
    if (auto done = put_line(c.comments.open + blank + line + c.comments.close); !done) return done;
  }
  return {};
}

Result<void> Writer::State::write(const Raw& b) {
  if (b.text.find_first_of("\r\n") != std::string::npos) return refuse("a raw line must be one line");
  return put_line(b.text);
}

Result<void> Writer::State::write(const AllowedWord& b) {
  return put_line(b.text);
}

Result<void> Writer::State::write(const Dwell& b) {
  if (b.milliseconds <= 0) return {};
  NumberStyle style = forms.linear;
  style.plus_sign = false;
  style.decimals = c.dwell_decimals;
  const std::int64_t step = kPowersOfTen[static_cast<std::size_t>(3 - c.dwell_decimals)];
  Values values;
  values.set(Placeholder::seconds, number_text((b.milliseconds + step / 2) / step, style));
  values.set(Placeholder::milliseconds, std::to_string(b.milliseconds));
  return put_words(c.dwell, values, "a dwell", "[dwell] words");
}

Result<void> Writer::State::write(const Spindle& b) {
  const std::int64_t rpm = b.turn == SpindleTurn::off ? 0 : b.rpm;
  if (b.turn != SpindleTurn::off && rpm <= 0)
    return refuse("the spindle is to turn at " + std::to_string(b.rpm) + " rpm");
  if (!modal.turn_spindle({b.turn, rpm})) return {};
  const auto& words = b.turn == SpindleTurn::off         ? c.spindle_off
                      : b.turn == SpindleTurn::clockwise ? c.spindle_clockwise
                                                         : c.spindle_counterclockwise;
  return put_words(words, Values().set(Placeholder::rpm, std::to_string(rpm)), "this spindle command",
                   "[spindle]");
}

Result<void> Writer::State::write(const Coolant& b) {
  const auto kind = static_cast<std::size_t>(b.kind);
  if (!modal.switch_coolant(b.kind)) return {};
  static constexpr std::array kWhat = {"coolant off", "flood coolant", "mist coolant",
                                       "coolant through the tool", "air"};
  static constexpr std::array kKeys = {"off", "flood", "mist", "through_tool", "air"};
  return put_words(c.coolant[kind], {}, kWhat[kind], std::string("[coolant] ") + kKeys[kind]);
}

Result<void> Writer::State::write(const ToolSelect& b) {
  if (b.tool < 0) return refuse("a tool number must not be negative");
  return put_words(c.tool_preselect, Values().set(Placeholder::tool, std::to_string(b.tool)),
                   "getting a tool ready", "[tool] preselect");
}

Result<void> Writer::State::write(const Clamp& b) {
  for (const auto& clamp : c.clamps) {
    if (clamp.axes != b.axes) continue;
    const unsigned in_force = (b.on ? modal.clamped : freed) & clamp.axes;
    if (in_force != 0) return {};
    modal.clamp(clamp.axes, b.on);
    freed = static_cast<std::uint16_t>(b.on ? freed & ~clamp.axes : freed | clamp.axes);
    return put_template(b.on ? clamp.on : clamp.off, {});
  }
  return no_words("clamping these axes", "[clamp]");
}

// Whether they are clamped is not known where a program begins.
Result<void> Writer::State::free_axes(std::uint16_t axes) {
  for (const auto& clamp : c.clamps) {
    if ((clamp.axes & axes) == 0) continue;
    if (auto done = write(Clamp{clamp.axes, false}); !done) return done;
  }
  return {};
}

Result<void> Writer::State::write(const ToolCall& b) {
  if (b.tool < 0 || b.length_offset < 0) return refuse("tool and length offset numbers must not be negative");
  if (auto done = switch_tcp_off(); !done) return done;
  modal.change_tool();
  due.change_tool();
  const auto values = Values()
                          .set(Placeholder::tool, std::to_string(b.tool))
                          .set(Placeholder::length_offset, std::to_string(b.length_offset));
  return put_words(c.tool_change, values, "a tool change", "[tool] change");
}

Result<void> Writer::State::write(const LengthCompensation& b) {
  const std::int64_t number =
      holds(c.length.on, Placeholder::length_offset) ? b.number : std::min<std::int64_t>(b.number, 1);
  due.length.reset();
  if (c.length.automatic || modal.length == number) return {};
  modal.set_length(number);
  due.in_motion_is_tcp = false;
  due.in_motion.clear();
  if (number == 0) return put_words(c.length.off, {}, "the end of length compensation", "[length] off");
  const auto values = Values().set(Placeholder::length_offset, std::to_string(number));
  return c.length.with_motion ? put_with_motion(c.length.on, values, "length compensation", "[length] on")
                              : put_words(c.length.on, values, "length compensation", "[length] on");
}

Result<void> Writer::State::write(const CutterCompensation& b) {
  const std::int64_t number = b.side == CutterSide::off ? 0 : b.number;
  if (b.side == modal.cutter.side && number == modal.cutter.number) return {};
  if (b.side != CutterSide::off && modal.cutter.side != CutterSide::off)
    return refuse("cutter compensation must be off before it changes its side or register");
  const Template& words = c.cutter_compensation[static_cast<std::size_t>(b.side)];
  if (words.empty()) return no_words("cutter compensation", "[cutter_compensation]");
  modal.switch_cutter({b.side, number});
  due.cutter.clear();
  const auto values = Values().set(Placeholder::number, std::to_string(number));
  for (const auto& line : words) due.cutter += render(line, values) + c.line.separator;
  return {};
}

Result<void> Writer::State::end_cutter_compensation(const char* before) {
  if (modal.cutter.side != CutterSide::off)
    return refuse(std::string("cutter compensation must be off before ") + before);
  if (due.cutter.empty()) return {};
  due.cutter.clear();
  return put_template(c.cutter_compensation[0], {});
}

Result<void> Writer::State::write(const TcpControl& b) {
  const bool has_offset = b.on && holds(c.tcp.on, Placeholder::length_offset);
  const std::int64_t offset = has_offset ? b.length_offset : 0;
  due.tcp.reset();
  if (!modal.switch_tcp(b.on, offset, c.tcp.replaces_length)) return {};
  due.in_motion_is_tcp = b.on;
  due.in_motion.clear();
  if (!b.on) return put_words(c.tcp.off, {}, "the end of tool-centre-point control", "[tcp] off");
  const auto values = Values().set(Placeholder::length_offset, std::to_string(offset));
  return c.tcp.with_motion ? put_with_motion(c.tcp.on, values, "tool-centre-point control", "[tcp] on")
                           : put_words(c.tcp.on, values, "tool-centre-point control", "[tcp] on");
}

Result<void> Writer::State::write(const WorkOffset& b) {
  if (b.index == modal.work_offset) return {};
  if (b.index < 1 || static_cast<std::size_t>(b.index) > c.work_offsets.size()) {
    return refuse("work offset " + std::to_string(b.index) + ": the controller file has " +
                  std::to_string(c.work_offsets.size()));
  }
  modal.call_work_offset(b.index);
  return put_template(c.work_offsets[static_cast<std::size_t>(b.index) - 1], {});
}

// The same words again are written again: whether an operator has changed the offset in between is not known.
Result<void> Writer::State::write(const OffsetShift& b) {
  if (auto done = suspend_tcp(c.offset_shift.not_under_tcp); !done) return done;
  modal.position.forget(kLinearAxes);
  Values values;
  values.set(Placeholder::index, std::to_string(b.index));
  static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
  for (std::size_t i = 0; i < 3; ++i) values.set(kOrigin[i], number_text(b.offset[i], forms.linear));
  return b.kind == OffsetShift::Kind::set
             ? put_words(c.offset_shift.set, values, "setting a work offset", "[offset_shift] set")
             : put_words(c.offset_shift.add, values, "a shift beside the work offset", "[offset_shift] add");
}

Result<void> Writer::State::write(const LatchValues& b) {
  if (!c.has_run_time_values()) return no_words("values at run time", "[run_time]");
  if (b.first) {
    if (auto done = put_template(c.run_time.begin, {}); !done) return done;
  }
  NumberStyle style = forms.linear;
  style.plus_sign = false;
  const auto values = Values()
                          .set(Placeholder::clamp, number_text(b.clamp, style))
                          .set(Placeholder::step, number_text(b.step, style))
                          .set(Placeholder::dead_band, number_text(b.dead_band, style));
  return put_template(c.run_time.latch, values);
}

Result<void> Writer::State::write(const RunTimeStep& b) {
  using Kind = RunTimeStep::Kind;
  const auto& t = c.run_time_temperatures;
  if (!c.has_run_time_temperatures())
    return no_words("calculating with temperatures", "[run_time_temperatures]");
  TRUNNION_EXPECTS(b.axis < 3);
  const auto sensor = static_cast<std::int64_t>(b.sensor);
  if (sensor >= t.count)
    return refuse("the control has variables for " + std::to_string(t.count) + " temperatures only");
  NumberStyle style = forms.linear;
  style.plus_sign = false;
  style.decimals = kFactorDecimals;
  const auto values = Values()
                          .set(Placeholder::channel, std::to_string(sensor))
                          .set(Placeholder::target, std::to_string(c.run_time.source[b.axis]))
                          .set(Placeholder::measured, std::to_string(t.measured[b.axis]))
                          .set(Placeholder::temperature, std::to_string(t.first + sensor))
                          .set(Placeholder::reference, std::to_string(t.first_reference + sensor))
                          .set(Placeholder::factor, number_text(std::abs(b.factor), style));
  switch (b.kind) {
    case Kind::reset:
      return put_template(t.reset, values);
    case Kind::read:
      return t.read.empty() ? Result<void>{} : put_template(t.read, values);
    case Kind::reference:
      return put_template(t.reference, values);
    case Kind::start:
      return put_template(t.start, values);
    case Kind::add:
      return put_template(b.factor < 0 ? t.subtract : t.add, values);
  }
  TRUNNION_EXPECTS(false);
  return {};
}

std::string Writer::State::variable_word(AxisLetter letter, std::int64_t quanta,
                                         const std::array<std::int64_t, 3>& coefficient) const {
  NumberStyle style = forms.linear;
  style.plus_sign = false;
  NumberStyle factor = style;
  factor.decimals = kCoefficientDecimals;
  std::string word(1, letter_of(letter));
  word.append(c.run_time.open).append(number_text(quanta, style));
  for (std::size_t k = 0; k < coefficient.size(); ++k) {
    const std::int64_t value = coefficient[k];
    if (value == 0) continue;
    word.append(value < 0 ? "-" : "+").append(c.run_time.variable);
    word.append(std::to_string(c.run_time.latched[k]));
    if (std::abs(value) != kPowersOfTen[kCoefficientDecimals])
      word.append("*").append(number_text(std::abs(value), factor));
  }
  return word.append(c.run_time.close);
}

Result<void> Writer::State::write(const VariableMotion& b) {
  const Motion& m = b.motion;
  if (!c.has_run_time_values()) return no_words("values at run time", "[run_time]");
  if ((m.words.mask & kXyz) != kXyz) return refuse("a motion with run-time values must name X, Y and Z");
  if (auto done = restore_after_retract(kLinearAxes); !done) return done;
  if (auto done = free_axes(changed_axes(m.words)); !done) return done;
  if (m.kind == MotionKind::feed && !forms.may_feed(m.feed_mode, m.feed)) return refuse_feed(m);
  std::array<char, 1024> buffer;
  std::string line(buffer.data(), put_leading(buffer.data(), m, !due.in_motion.empty()));
  for (const AxisLetter letter : kAllAxisLetters) {
    const auto i = index(letter);
    if (!m.words.has(letter)) continue;
    if (i >= 3 && modal.position.has(letter) && modal.position[letter] == m.words[letter]) continue;
    if (i < 3)
      line += variable_word(letter, m.words[letter], b.coefficient[i]);
    else
      line.append(buffer.data(), put_axis(buffer.data(), i, m.words[letter]));
    modal.position.set(letter, m.words[letter]);
    line += c.line.separator;
  }
  if (m.kind == MotionKind::feed)
    line.append(buffer.data(), put_feed(buffer.data(), m));
  else
    line.append(c.motion.rapid_suffix).append(c.line.separator);
  while (!c.line.separator.empty() && line.ends_with(c.line.separator))
    line.resize(line.size() - c.line.separator.size());
  modal.position.forget(kLinearAxes);  // where they stand depends on the values
  ++motions;
  return put_line(line);
}

Result<void> Writer::State::write(const PathMode& b) {
  if (!modal.set_path_mode(b)) return {};
  if (b.tolerance > 0) {
    NumberStyle style = forms.linear;
    style.plus_sign = false;
    return put_words(c.continuous_within,
                     Values().set(Placeholder::tolerance, number_text(b.tolerance, style)),
                     "path blending within a tolerance", "[path_mode] continuous_within");
  }
  return put_words(c.path_modes[static_cast<std::size_t>(b.kind)], {}, "this path mode", "[path_mode]");
}

// Before the first motion that it matters to: a rotary axis that turns at the safe height must not make the
// linear axes follow.
Result<void> Writer::State::restore_after_retract(std::uint16_t changed) {
  const std::uint16_t waits_for = due.tcp ? kLinearAxes : AxisWords::bit(AxisLetter::Z);
  if ((changed & waits_for) == 0) return {};
  const auto tcp_before = std::exchange(due.tcp, std::nullopt);
  const auto length_before = std::exchange(due.length, std::nullopt);
  if (tcp_before && c.tcp.replaces_length) return write(*tcp_before);
  if (length_before) {
    if (auto done = write(*length_before); !done) return done;
  }
  return tcp_before ? write(*tcp_before) : Result<void>{};
}

Result<void> Writer::State::write(const Retract& b) {
  if (auto done = free_axes(b.axes); !done) return done;
  if (auto done = suspend_tcp(c.tcp.off_for_tool_change); !done) return done;
  if (c.retract_ends_length && modal.length > 0) {
    due.length = LengthCompensation{modal.length};
    modal.length = kUnknown;
  }
  for (const AxisLetter letter : {AxisLetter::Z, AxisLetter::W, AxisLetter::X, AxisLetter::Y, AxisLetter::A,
                                  AxisLetter::B, AxisLetter::C, AxisLetter::U, AxisLetter::V}) {
    if ((b.axes & AxisWords::bit(letter)) == 0) continue;
    const Template& words = c.retract[index(letter)];
    if (words.empty()) {
      return refuse(std::string("the program has to retract and [retract] ") + letter_of(letter) +
                    " has no words in " + c.file);
    }
    TRUNNION_EXPECTS(!c.names_position(letter) || b.to.has(letter));
    const auto values = Values().set(Placeholder::position, number_text(b.to[letter], forms.of_axis(letter)));
    if (auto done = put_template(words, values); !done) return done;
    modal.position.forget(letter);
  }
  modal.motion_kind.reset();
  return {};
}

Result<void> Writer::State::write(const TiltedPlane& b) {
  if (!b.on && !modal.plane) return {};
  modal.switch_plane(b.on);
  if (!b.on) return put_words(c.tilted_plane.off, {}, "the end of a tilted plane", "[tilted_plane] off");
  // The control may turn its rotary axes for it.
  if (auto done = free_axes(kAllAxes); !done) return done;
  Values values;
  static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
  static constexpr std::array kAngle = {Placeholder::a, Placeholder::b, Placeholder::c};
  for (std::size_t i = 0; i < 3; ++i) {
    values.set(kOrigin[i], number_text(b.origin[i], forms.linear));
    values.set(kAngle[i], number_text(b.angles[i], forms.rotary));
  }
  values.set(Placeholder::direction, b.direction < 0 ? "-1" : "1");
  return put_words(c.tilted_plane.on, values, "a tilted plane", "[tilted_plane] on");
}

Result<void> Writer::State::write(const Stop& b) {
  return put_words(b.optional ? c.optional_stop : c.stop, {}, b.optional ? "an optional stop" : "a stop",
                   b.optional ? "[stop] optional" : "[stop] program");
}

Values Writer::State::program_values() const {
  return Values()
      .set(Placeholder::name, program_name)
      .set(Placeholder::number, std::to_string(program_number));
}

Result<void> Writer::State::write_block(const Block& block) {
  const auto* log = std::get_if<ProbeLog>(&block);
  const bool heads = std::holds_alternative<ProgramStart>(block) || std::holds_alternative<Comment>(block) ||
                     (log != nullptr && log->kind == ProbeLog::Kind::declare);
  TRUNNION_EXPECTS(started || std::holds_alternative<ProgramStart>(block));
  TRUNNION_EXPECTS(!ended);
  if (due.setup && !heads) {
    if (auto done = flush_setup(!std::holds_alternative<PathMode>(block)); !done) return done;
  }
  if (modal.cutter.side != CutterSide::off || !due.cutter.empty()) {
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
  if (modal.cycle && !std::holds_alternative<Hole>(block) && !std::holds_alternative<Motion>(block)) {
    if (auto done = end_cycle(); !done) return done;
  }
  return std::visit(
      [this](const auto& b) -> Result<void> {
        if constexpr (std::is_same_v<std::decay_t<decltype(b)>, Motion>) {
          return write_motion(b);
        } else {
          return write(b);
        }
      },
      block);
}

}  // namespace trunnion::nc
