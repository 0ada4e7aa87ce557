#include "nc/reading/event_reader.hpp"

#include <algorithm>
#include <utility>

namespace trunnion::nc {

// At the ends of a program only.
void EventReader::run_tape(const FoundEvent& found) {
  if (!s_.program.frame || s_.program.ended || !s_.program.said_anything) return;
  s_.error(found, "the program ends here: the control does not run the lines after it");
}

void EventReader::keep_captures(const FoundEvent& found) {
  for (std::size_t i = 0; i < kPlaceholders; ++i) {
    const auto p = static_cast<Placeholder>(i);
    const bool lasts =
        found.event.kind == EventKind::remember || p == Placeholder::tool || p == Placeholder::rpm;
    if (lasts && found.captures.has(p)) s_.kept.set(p, found.captures[p]);
  }
}

// Three axes and several lines say the same limit; each counts where it stands.
void EventReader::check_limits_of_latch(const FoundEvent& found) {
  for (const Placeholder p : {Placeholder::clamp, Placeholder::step, Placeholder::dead_band}) {
    if (!found.captures.has(p)) continue;
    const std::int64_t now = s_.scaled(found, p, s_.language.format.decimals(AxisLetter::X));
    const auto [before, is_new] = limits_.emplace(p, now);
    if (!is_new && before->second != now)
      return s_.error(found, "another limit than in the lines before it, which belong to the same values");
  }
  if (found.event.kind == EventKind::latch) limits_.clear();
}

void EventReader::run(const FoundEvent& found) {
  keep_captures(found);
  if (found.pattern != nullptr && found.pattern->origin.starts_with("[run_time] latch"))
    check_limits_of_latch(found);
  if (s_.language.others && found.event.kind == EventKind::remember &&
      found.pattern->origin.starts_with("[tilted_plane] on"))
    s_.program.plane_since = s_.findings.line;
  // 'TOOL CALL Z S3000', a line of its own. Of our programs the lines of a template stand together.
  if (s_.language.others && found.event.kind == EventKind::remember && found.captures.has(Placeholder::rpm))
    s_.change_speed(found.captures[Placeholder::rpm]);
  if (found.event.kind == EventKind::plane_off) s_.program.plane_since = 0;
  if (found.event.kind == EventKind::tape && s_.language.others)
    return s_.error(found, "words in the line of '%', at which the control begins or stops reading");
  if (found.event.kind == EventKind::tape) return run_tape(found);
  if (found.event.kind != EventKind::program_start) s_.program.said_anything = true;
  switch (found.event.kind) {
    case EventKind::program_start:
      return run_program_start(found);
    case EventKind::allowed:
      return s_.emit(AllowedWord{s_.c.allowed[static_cast<std::size_t>(found.event.argument)]});
    case EventKind::program_end:
      return run_program_end(found);
    case EventKind::spindle:
      return run_spindle(found);
    case EventKind::clamp:
      return run_clamp(found.event.argument);
    case EventKind::coolant:
      return run_coolant(static_cast<CoolantKind>(found.event.argument));
    case EventKind::tool:
      return run_tool(found);
    case EventKind::length_on:
      return run_length(s_.whole(found, Placeholder::length_offset, 1));
    case EventKind::length_off:
      return run_length(0);
    case EventKind::tcp_on:
      return run_tcp(true, s_.whole(found, Placeholder::length_offset, 0));
    case EventKind::tcp_off:
      return run_tcp(false, 0);
    case EventKind::length_or_tcp_off:
      return s_.modal.tcp ? run_tcp(false, 0) : run_length(0);
    case EventKind::work_offset:
      return run_work_offset(found.event.argument);
    case EventKind::offset_shift:
      return run_offset_shift(found);
    case EventKind::latch_begin:
      return run_latch_begin(found);
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
      // Frames change under the tool: no program of ours says it there, and a control may stop.
      if (!s_.language.others && forbids_tcp(found, "the end of a tilted plane", true)) return;
      // Its words set a datum shift to 0, on controls that have one cycle for both.
      if (!s_.modal.plane && !s_.language.others && s_.program.shift_added &&
          !s_.c.input.places.datum_shift.empty())
        return s_.error(found, "the end of a tilted plane, which takes back the shift that is in force");
      if (!s_.modal.plane) return;
      if (s_.language.others) s_.language.others->take_frame_back();
      s_.modal.switch_plane(false);
      return s_.emit(TiltedPlane{});
    case EventKind::cutter:
      return run_cutter(found);
    case EventKind::cycle_name:
      s_.cycle_return.named = found.event.argument;
      return;
    case EventKind::cycle_return:
      s_.cycle_return.to_clear = found.event.argument == 1;
      // Said between two holes, it is about the next one.
      if (s_.modal.cycle) s_.modal.cycle->words.set(AxisLetter::Z, s_.cycle_return.of(s_.modal.cycle->clear));
      return;
    case EventKind::cycle_off:
      // Whether G0 or G1 holds behind it is another thing on each control; our programs say it again.
      if (s_.modal.cycle || !s_.language.others) s_.modal.motion_kind.reset();
      s_.modal.cycle.reset();
      return;
    case EventKind::arc:
      return shapes_.run_arc(found);
    case EventKind::cycle: {
      FoundEvent called = found;
      if (s_.cycle_return.named && (*s_.cycle_return.named >= static_cast<int>(Hole::Kind::tap) ||
                                    found.event.argument >= static_cast<int>(Hole::Kind::tap)))
        called.event.argument = *s_.cycle_return.named;
      return shapes_.run_cycle(called);
    }
    case EventKind::probe:
      return shapes_.run_probe(found);
    case EventKind::probe_log:
      return s_.emit(ProbeLog{static_cast<ProbeLog::Kind>(found.event.argument), found.captures.name});
    case EventKind::dwell:
      return run_dwell(found);
    case EventKind::retract:
      return run_retract(found);
    case EventKind::stop:
      if (s_.c.stops.end_spindle) s_.modal.stop();
      return s_.emit(Stop{found.event.argument == 1});
    default:
      return;
  }
}

void EventReader::run_program_start(const FoundEvent& found) {
  if ((s_.program.frame || s_.language.others) && (s_.program.said_anything || s_.modal.position.mask != 0))
    return s_.error(found, "another program begins here");
  if (s_.program.started) return;
  ProgramStart start;
  start.name = found.captures.name;
  start.number = s_.whole(found, Placeholder::number, 1);
  s_.emit(start);
}

void EventReader::run_spindle(const FoundEvent& found) {
  Spindle now;
  now.turn = static_cast<SpindleTurn>(found.event.argument);
  if (now.turn != SpindleTurn::off) {
    now.rpm = s_.whole(found, Placeholder::rpm, 0);
    if (now.rpm <= 0) return s_.error(found.column, "the spindle is to turn without a speed");
    // Programs of others may start the spindle without the words of a speed.
    if (!s_.language.others && forbids_tcp(found, "a speed of the spindle", s_.c.speed_not_under_tcp)) return;
  }
  if (s_.modal.turn_spindle(now)) s_.emit(now);
}

void EventReader::run_coolant(CoolantKind kind) {
  if (s_.modal.switch_coolant(kind)) s_.emit(Coolant{kind});
}

void EventReader::run_clamp(int argument) {
  const auto& clamp = s_.c.clamps[static_cast<std::size_t>(argument / 2)];
  const bool on = argument % 2 == 1;
  s_.modal.clamp(clamp.axes, on);
  s_.emit(Clamp{clamp.axes, on});
}

// What the control wants to be ended before.
bool EventReader::forbids_tcp(const FoundEvent& found, const char* what, bool wants_it_off) {
  if (!s_.modal.tcp || !wants_it_off) return false;
  s_.error(found, std::string(what) + " under tool-centre-point control: end that first" +
                      (s_.c.tcp.off.empty() ? "" : " ('" + s_.c.tcp.off.back() + "')"));
  return true;
}

void EventReader::run_program_end(const FoundEvent& found) {
  if (s_.program.frame && s_.modal.plane)
    s_.error(found, "the program ends in a tilted plane: end that first" +
                        (s_.c.tilted_plane.off.empty() ? "" : " ('" + s_.c.tilted_plane.off.back() + "')"));
  if (s_.program.frame) forbids_tcp(found, "the end of the program", s_.c.tcp.off_for_tool_change);
  s_.program.ended = true;
  s_.emit(ProgramEnd{});
}

void EventReader::run_tool(const FoundEvent& found) {
  ToolCall call;
  call.tool = s_.whole(found, Placeholder::tool, -1);
  if (call.tool < 0) return s_.error(found.column, "a tool change without a tool");
  call.length_offset = s_.whole(found, Placeholder::length_offset, call.tool);
  if (!(s_.language.others && s_.c.tcp.switches_kinematics) &&
      forbids_tcp(found, "a tool change", s_.c.tcp.off_for_tool_change))
    return;
  s_.modal.change_tool();
  s_.emit(call);
}

void EventReader::run_length(std::int64_t number) {
  if (number == s_.modal.length && !(s_.modal.tcp && s_.c.tcp.replaces_length)) return;
  if (s_.modal.tcp && s_.c.tcp.replaces_length) run_tcp(false, 0);
  const AxisWords before = s_.modal.position;
  s_.modal.set_length(number);
  // The length counts along Z, of a tilted plane the tool stands along; X and Y that stood before it are as
  // good as before.
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) {
    if (s_.language.others && !s_.modal.tcp && !s_.program.follows_part && before.has(letter))
      s_.modal.position.set(letter, before[letter]);
  }
  s_.emit(LengthCompensation{number});
}

void EventReader::run_tcp(bool on, std::int64_t offset) {
  if (on && s_.language.others && !s_.language.others->frame().is_idle() &&
      (s_.language.others->frame().turns() || s_.c.offset_shift.not_under_tcp))
    return s_.error(
        1, "tool-centre-point control, and the program's own shift or turn is in force: end that first");
  if (!s_.modal.switch_tcp(on, offset, s_.c.tcp.replaces_length)) return;
  if (s_.language.others) s_.language.others->forget_pole();
  s_.emit(TcpControl{on, offset});
}

void EventReader::run_work_offset(std::int64_t index) {
  // A preset takes back all shifts, on controls that have cycles for both.
  const bool ends_shift = !s_.c.input.places.datum_shift.empty();
  const bool again = s_.modal.work_offset == index;
  if (ends_shift && s_.program.shift_added && (again || s_.language.others))
    return s_.error(1, "a preset, and the program's own shift is in force: end that first");
  if (s_.language.others && !s_.language.others->frame().is_idle() &&
      (ends_shift || (s_.modal.work_offset != 0 && s_.modal.work_offset != index)))
    return s_.error(1,
                    "another work offset, and the program's own shift or turn is in force: end that first");
  const AxisWords before = s_.modal.position;
  if (!s_.modal.call_work_offset(index)) return;
  if (s_.language.others) s_.language.others->forget_pole();
  // Rotary axes have no offset here, nor in a place of the machine.
  for (const AxisLetter letter : kAllAxisLetters)
    if (s_.language.others && is_rotary(letter) && before.has(letter))
      s_.modal.position.set(letter, before[letter]);
  s_.emit(WorkOffset{index});
}

void EventReader::run_offset_shift(const FoundEvent& found) {
  if (s_.language.others && s_.language.others->in_increments())
    return s_.error(found, "an offset that is set under '" + s_.c.incremental.on +
                               "': controls differ in whether it is added");
  OffsetShift now;
  now.kind = static_cast<OffsetShift::Kind>(found.event.argument);
  if (now.kind == OffsetShift::Kind::add && s_.language.others && !s_.language.others->frame().is_idle())
    return s_.error(found, "a shift, and another one of the program's own is in force: end that first");
  if (now.kind == OffsetShift::Kind::set) now.index = s_.whole(found, Placeholder::index, 1);
  if (now.kind == OffsetShift::Kind::set && s_.c.offset_shift.last_set > 0 &&
      now.index > s_.c.offset_shift.last_set)
    return s_.error(found, "an offset of number " + std::to_string(now.index) +
                               " is set: these words set the first " +
                               std::to_string(s_.c.offset_shift.last_set));
  if (now.kind == OffsetShift::Kind::set && s_.language.others && now.index < 1)
    return s_.error(found, "an offset of number " + std::to_string(now.index) +
                               " is set: what it counts for differs between controls");
  for (std::size_t i = 0; i < 3; ++i)
    now.offset[i] = s_.scaled(found, kPlaceXyz[i], s_.language.format.decimals(AxisLetter::X));
  if (s_.language.others) s_.language.others->forget_pole();
  s_.modal.position.forget(kLinearAxes);
  if (now.kind == OffsetShift::Kind::add) {
    s_.program.shift_added = now.offset != std::array<std::int64_t, 3>{};
    // Said again behind a tool change.
    if (!s_.language.others && std::exchange(shift_, now.offset) == now.offset) return;
  }
  s_.emit(now);
}

// The control keeps its variables when it is switched off: what an earlier program left in them is no drift.
void EventReader::run_latch_begin(const FoundEvent& found) {
  const Template& lines = s_.c.run_time.begin;
  if (latched_)
    return s_.error(found, "'" + lines[static_cast<std::size_t>(found.event.argument)] +
                               "' sets a value back that motions use already: they would jump by all of it");
  begun_.insert(found.event.argument);
}

void EventReader::run_latch(const FoundEvent& found) {
  const Template& lines = s_.c.run_time.begin;
  for (std::size_t i = 0; !latched_ && i < lines.size(); ++i)
    if (!begun_.contains(static_cast<int>(i)))
      return s_.error(found,
                      "the values of the run are taken here for the first time, and '" + lines[i] +
                          "' is missing before it: motions would begin with what an earlier program left");
  const int decimals = s_.language.format.decimals(AxisLetter::X);
  LatchValues now;
  now.first = !std::exchange(latched_, true);
  now.clamp = s_.scaled(found, Placeholder::clamp, decimals);
  now.step = s_.scaled(found, Placeholder::step, decimals);
  now.dead_band = s_.scaled(found, Placeholder::dead_band, decimals);
  s_.emit(now);
}

void EventReader::run_run_time_step(const FoundEvent& found) {
  using Kind = RunTimeStep::Kind;
  const auto& t = s_.c.run_time_temperatures;
  RunTimeStep step;
  const bool subtracts = found.event.argument == kSubtract;
  step.kind = subtracts ? Kind::add : static_cast<Kind>(found.event.argument);
  const auto fault = [&] { s_.error(found.column, "a variable that the controller file does not name"); };
  const auto axis_of = [&](const std::array<std::int64_t, 3>& known, Placeholder p) {
    return static_cast<std::size_t>(std::find(known.begin(), known.end(), s_.whole(found, p, 0)) -
                                    known.begin());
  };
  if (step.kind == Kind::start || step.kind == Kind::add) {
    step.axis = axis_of(s_.c.run_time.source, Placeholder::target);
    if (step.axis > 2) return fault();
  }
  if (step.kind == Kind::start && axis_of(t.measured, Placeholder::measured) != step.axis) return fault();
  if (step.kind == Kind::read || step.kind == Kind::reference || step.kind == Kind::add) {
    const std::int64_t sensor = s_.whole(found, Placeholder::temperature, 0) - t.first;
    if (sensor < 0 || sensor >= t.count) return fault();
    step.sensor = static_cast<std::size_t>(sensor);
    if (step.kind == Kind::read && s_.whole(found, Placeholder::channel, sensor) != sensor) return fault();
    if (step.kind != Kind::read && s_.whole(found, Placeholder::reference, 0) != t.first_reference + sensor)
      return fault();
  }
  if (step.kind == Kind::add)
    step.factor = (subtracts ? -1 : 1) * s_.scaled(found, Placeholder::factor, kFactorDecimals);
  s_.emit(step);
}

void EventReader::run_path_mode(const FoundEvent& found) {
  PathMode now;
  now.kind = static_cast<PathModeKind>(found.event.argument);
  now.tolerance = s_.scaled(found, Placeholder::tolerance, s_.language.format.decimals(AxisLetter::X));
  if (s_.modal.set_path_mode(now)) s_.emit(now);
}

void EventReader::run_cutter(const FoundEvent& found) {
  CutterCompensation now;
  now.side = static_cast<CutterSide>(found.event.argument);
  if (now.side != CutterSide::off) now.number = s_.whole(found, Placeholder::number, 0);
  if (s_.modal.switch_cutter(now)) s_.emit(now);
}

void EventReader::run_plane(const FoundEvent& found) {
  // Its words may stand in a line of their own.
  if (std::exchange(s_.program.plane_since, 0) == 0 && s_.language.others &&
      !found.captures.has(Placeholder::a))
    return s_.error(found, "'" + s_.c.tilted_plane.on.back() + "', and no tilted plane is said");
  const bool counts_from_shift = s_.language.others && !s_.c.input.places.datum_shift.empty();
  if (s_.language.others && !counts_from_shift && !s_.language.others->frame().is_idle())
    return s_.error(found, "a tilted plane, and the program's own shift or turn is in force: end that first");
  if (s_.program.frame && s_.c.tilted_plane.off_before_next && s_.modal.plane)
    return s_.error(found, "a tilted plane, and the one before it is still in force: '" +
                               s_.c.tilted_plane.off.back() + "' is missing");
  TiltedPlane now;
  now.on = true;
  for (std::size_t i = 0; i < 3; ++i) {
    now.origin[i] = s_.scaled(found, kPlaceXyz[i], s_.language.format.decimals(AxisLetter::X));
    now.angles[i] = s_.scaled(found, kAnglesAbc[i], s_.language.format.decimals(AxisLetter::A));
  }
  if (counts_from_shift && s_.modal.plane) s_.language.others->take_frame_back();
  if (counts_from_shift) now.origin = s_.language.others->set_frame_aside();
  const std::int64_t direction = s_.whole(found, Placeholder::direction, 1);
  if (s_.language.others && direction == 0)
    return s_.error(found,
                    "a tilted plane that leaves the rotary axes where they are (direction 0): the program "
                    "does not give their positions for it");
  now.direction = direction < 0 ? -1 : 1;
  s_.modal.switch_plane(true);
  s_.emit(now);
}

// Where an end of several lines takes the origin back, all of it.
void EventReader::check_origin(const FoundEvent& found) {
  if (!s_.program.frame || s_.c.tilted_plane.off.size() < 2) return;
  for (const Placeholder p : {Placeholder::x, Placeholder::y, Placeholder::z}) {
    if (s_.kept.has(p) && s_.kept[p].mantissa != 0)
      return s_.error(found, "the tilted plane ends and its shift of the origin stays");
  }
}

void EventReader::run_dwell(const FoundEvent& found) {
  Dwell now;
  const bool in_seconds = found.captures.has(Placeholder::seconds);
  const bool counts_thousandths = s_.c.input.lines.dwell_without_point_ms && in_seconds &&
                                  !found.captures[Placeholder::seconds].has_point;
  if (in_seconds && !counts_thousandths)
    now.milliseconds = s_.scaled(found, Placeholder::seconds, 3);
  else
    now.milliseconds = s_.whole(found, in_seconds ? Placeholder::seconds : Placeholder::milliseconds, 0);
  s_.emit(now);
}

void EventReader::run_retract(const FoundEvent& found) {
  const auto letter = static_cast<AxisLetter>(found.event.argument);
  Retract now{AxisWords::bit(letter), {}};
  if (s_.c.names_position(letter)) {
    now.to.set(letter, s_.scaled(found, Placeholder::position, s_.language.format.decimals(letter)));
    const Number& number = found.captures[Placeholder::position];
    if (s_.c.numbers.point_required && !number.has_point && now.to[letter] != 0) {
      return s_.error(found.column,
                      std::string("the position of ") + letter_of(letter) +
                          " has no decimal point: the control would take it for a number of increments");
    }
  }
  if (!s_.language.others && forbids_tcp(found, "a retract", s_.c.tcp.off_for_tool_change)) return;
  if (!s_.may_move(found.column) || s_.kinematics_unknown(found.column)) return;
  s_.modal.position.forget(letter);
  s_.modal.motion_kind.reset();
  s_.modal.cycle.reset();
  if (s_.c.retract_ends_length && s_.modal.length > 0) s_.modal.length = kUnknown;
  s_.emit(now);
}

}  // namespace trunnion::nc
