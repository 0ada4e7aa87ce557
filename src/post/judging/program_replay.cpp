#include "post/judging/program_replay.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/nc/expand.hpp"

namespace trunnion::post {
namespace {

// Share of the tolerance that the chords of an arc may bow by: it counts as deviation.
constexpr double kBowShare = 0.05;

nc::ReaderOptions reader_options(const VerifyOptions& o) {
  nc::ReaderOptions r;
  r.raw_lines = o.raw_lines;
  r.whole_program = true;
  return r;
}

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace

ProgramReplay::ProgramReplay(const Machine& machine, const nc::Controller& controller,
                             const VerifyOptions& options, const std::string& nc_file,
                             Diagnostics& diagnostics)
    : machine_(machine),
      controller_(controller),
      options_(options),
      file_(nc_file),
      findings_(diagnostics),
      axis_words_(machine, controller.numbers.axes),
      in_force_(machine, controller, axis_words_,
                {options.tools.length_mm.value_or(machine.tool_length_mm),
                 machine.output_point == OutputPoint::tip}),
      walk_(machine, controller.numbers.axes.quantum(nc::AxisLetter::Z), 2.0 * options.offset_limits.clamp_mm,
            options.worst_count, figures_),
      reader_(
          controller, nc_file, diagnostics, [this](const nc::Block& block) { take(block); },
          reader_options(options)) {
  reader_.give_runs_to([this](const nc::MotionRun& run) { take(run); });
}

void ProgramReplay::take(const nc::Block& block) {
  // Motions, and what is told of as the motions it is made of, are no marks.
  const bool is_motion = std::holds_alternative<nc::Motion>(block) ||
                         std::holds_alternative<nc::VariableMotion>(block) ||
                         std::holds_alternative<nc::Arc>(block) || std::holds_alternative<nc::Hole>(block);
  if (!is_motion && !std::holds_alternative<nc::Comment>(block)) mark(block);
  std::visit(
      Overloaded{[&](const nc::Motion& b) { take(b, nullptr, {}); },
                 [&](const nc::VariableMotion& b) { take(b.motion, &b, {}); },
                 [&](const nc::Arc& b) { take(b); }, [&](const nc::Hole& b) { take(b); },
                 [&](const nc::TcpControl& b) { take(b); }, [&](const nc::Retract& b) { take(b); },
                 [&](const nc::ToolCall& b) { take(b); }, [&](const nc::Spindle& b) { take(b); },
                 [&](const nc::TiltedPlane& b) { take(b); }, [&](const nc::ProgramEnd&) { end(); },
                 [&](const nc::CutterCompensation& b) { in_force_.switch_cutter(b.side); },
                 [&](const nc::LengthCompensation& b) { take(b); },
                 [&](const nc::WorkOffset& b) { in_force_.shift.read(b); },
                 [&](const nc::OffsetShift& b) { in_force_.shift.read(b); },
                 [&](const nc::LatchValues& b) { take(b); }, [&](const nc::RunTimeStep& b) { hand_on(b); },
                 [&](const nc::Comment& b) { hand_on(b); }, [&](const nc::Dwell& b) { hand_on(b); },
                 [](const auto&) {}},
      block);
}

void ProgramReplay::take(const nc::LatchValues& latch) {
  if (options_.offsets == nullptr)
    findings_.warning_once(
        "run time", file_, {line(), 1},
        "the program adds values that it reads while it runs: they are taken for 0 here. With "
        "--offsets they are judged");
  hand_on(latch);
}

void ProgramReplay::end() {
  walk_.needs_height("the program ends", line());
  const std::string left = in_force_.shift.left_behind(in_force_.had_tcp);
  if (!left.empty())
    judges_.front()->find_offset("the program ends, and " + left + ": the next one would run with it",
                                 line());
}

void ProgramReplay::take(const nc::Motion& motion, const nc::VariableMotion* terms, const Done& done) {
  ++figures_.points_out;
  if (unknown_tool_) {
    findings_.error(file_, motion.source,
                    "the program moves with tool " + std::to_string(*std::exchange(unknown_tool_, {})) +
                        ", whose gauge length is not known: neither the CL file nor a tool file "
                        "(--tools) has it");
  }
  judges_.front()->take_axes(motion.words.mask, motion.source.line);
  const bool rapid = motion.kind == nc::MotionKind::rapid;
  ++(rapid ? figures_.rapid_blocks : figures_.feed_blocks);
  const JointVector words = axis_words_.internal(motion.words);
  in_force_.take_rotary(motion.words, words);
  if (in_force_.compensates && (rapid || !(*in_force_.compensates == in_force_.rotary))) {
    findings_.error(file_, motion.source, "a rapid, or a turn of a rotary axis, under cutter compensation");
    in_force_.compensates.reset();
  }
  // Positions are not all known at the start of a program and after a retract to machine coordinates.
  if ((motion.words.mask & in_force_.wanted()) != in_force_.wanted() ||
      in_force_.leaves_plane(motion.words)) {
    from_unknown_ = true;
    return take_partly(motion);
  }
  in_force_.leaves_contour = false;
  BlockEnd v = in_force_.end_at(words);
  v.nc_line = motion.source.line;
  const bool walks = walk_.wholly(v.q, rapid, v.tcp, in_force_.kinematics, v.nc_line);
  v.from_unknown = std::exchange(from_unknown_, false) || walks;
  v.up = walks && walk_.is_up();
  v.feed_mode = motion.feed_mode;
  v.feed = motion.feed;
  v.rapid = rapid;
  for (std::size_t i = 0; i < judges_.size(); ++i) {
    if (done.has(i)) continue;
    if (terms != nullptr)
      judges_[i]->add(WithTerms{v, *terms});
    else
      judges_[i]->take(v);
  }
}

void ProgramReplay::take(const nc::MotionRun& run) {
  const bool may = !from_unknown_ && !walk_.goes_on() && in_force_.are_joints() && !in_force_.compensates &&
                   !in_force_.leaves_contour && (run.mask & axis_words_.all) == axis_words_.all;
  Done done;
  std::size_t first = run.count;
  for (std::size_t i = 0; i < judges_.size(); ++i) {
    done.rows[i] = judges_[i]->take(run, may);
    first = std::min(first, done.rows[i]);
  }
  if (run.count == 0) return;
  judges_.front()->take_axes(run.mask, run.source[0].line);
  if (first > 0) {
    figures_.points_out += first;
    figures_.feed_blocks += first;
    const nc::AxisWords last = run.motion(first - 1).words;
    const JointVector words = axis_words_.internal(last);
    in_force_.take_rotary(last, words);
    walk_.stands(in_force_.end_at(words).q);
  }
  for (done.row = first; done.row < run.count; ++done.row) take(run.motion(done.row), nullptr, done);
}

std::optional<double> ProgramReplay::length_of(std::uint32_t tool) const {
  if (const auto loaded = length_of_.find(tool); loaded != length_of_.end()) return loaded->second;
  const Tool* known = options_.tools.find(tool);
  return known != nullptr ? std::optional(known->length_mm) : std::nullopt;
}

void ProgramReplay::take(const nc::ToolCall& call) {
  if (in_force_.plane) walk_.find_plane(line());
  walk_.forget(line());
  tool_was_called_ = true;
  if (controller_.tool_change_s > 0.0) hand_on(nc::Dwell{std::llround(controller_.tool_change_s * 1000.0)});
  const auto length_mm = length_of(static_cast<std::uint32_t>(call.tool));
  unknown_tool_ = length_mm ? std::nullopt : std::optional(call.tool);
  in_force_.set_length(length_mm.value_or(in_force_.tool.length_mm));
  // The tool comes without its length, which is added by words of its own.
  in_force_.add_length(controller_.length.automatic);
  hand_on(InSpindle{in_force_.tool.length_mm});
}

void ProgramReplay::take(const nc::LengthCompensation& length) {
  if (controller_.length.moves_at_once) walk_.changes_length(line());
  in_force_.add_length(length.number > 0);
}

void ProgramReplay::take(const nc::TcpControl& control) {
  if (controller_.tcp.replaces_length && controller_.length.moves_at_once) walk_.changes_length(line());
  in_force_.tcp = control.on;
  in_force_.had_tcp = in_force_.had_tcp || control.on;
  if (controller_.tcp.replaces_length) in_force_.add_length(false);
}

void ProgramReplay::take(const nc::Spindle& spindle) {
  walk_.spindle(spindle, line());
  hand_on(spindle);
}

void ProgramReplay::take(const nc::TiltedPlane& plane) {
  const bool turns = in_force_.enter(plane);
  from_unknown_ = true;
  if (turns) walk_.turns_to(in_force_.plane_q, line());
}

void ProgramReplay::take(const nc::Retract& retract) {
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    if ((retract.axes & nc::AxisWords::bit(axis_words_.letters[id])) == 0) continue;
    std::optional<double> to;
    if (retract.to.has(axis_words_.letters[id]))
      to = controller_.numbers.axes.internal(axis_words_.letters[id], retract.to[axis_words_.letters[id]]);
    walk_.retract(id, to, line());
  }
  hand_on(retract);
}

void ProgramReplay::take_partly(const nc::Motion& motion) {
  mark(motion);
  JointVector words;
  SafeWalk::Known known{};
  const bool in_part = in_force_.in_part();
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    const bool is_linear = machine_.axes[id].kind == AxisKind::linear;
    known[id] =
        (motion.words.mask & nc::AxisWords::bit(axis_words_.letters[id])) != 0 && !(is_linear && in_part);
    words[id] = axis_words_.of[id].internal(motion.words);
  }
  const std::uint16_t z_word = nc::AxisWords::bit(nc::AxisLetter::Z);
  const bool says_z = (motion.words.mask & axis_words_.linear & z_word) != 0;
  // The tool stands along machine Z in the plane, so that Z of its words alone says how high.
  const bool z_of_plane = in_force_.plane && says_z && !in_force_.leaves_plane(motion.words);
  // So do X and Y of its words say where those of the machine stand, whatever Z is.
  const std::uint16_t xy = nc::AxisWords::bit(nc::AxisLetter::X) | nc::AxisWords::bit(nc::AxisLetter::Y);
  const bool xy_of_plane =
      in_force_.plane && !in_force_.leaves_plane(motion.words) && (motion.words.mask & xy) == xy;
  auto moved = static_cast<std::uint16_t>(motion.words.mask & axis_words_.linear);
  if (z_of_plane) moved = static_cast<std::uint16_t>(moved & ~z_word);
  if (xy_of_plane) moved = static_cast<std::uint16_t>(moved & ~xy);
  if (in_part && moved != 0)
    walk_.sideways(in_force_.tcp && !in_force_.plane, (motion.words.mask & xy) == xy, motion.source.line);
  if (in_part && says_z && !z_of_plane) walk_.loses_height();
  JointVector q = in_force_.joints_of(words);
  if (!in_force_.shift.is_idle()) q = in_force_.shift.joints(q, false);
  const auto take_of_plane = [&](const char* name, bool says) {
    const auto axis = machine_.axis(name);
    if (!axis || !says) return;
    q[*axis] = in_force_.end_at(words).q[*axis];
    known[*axis] = true;
  };
  take_of_plane("X", xy_of_plane);
  take_of_plane("Y", xy_of_plane);
  take_of_plane("Z", z_of_plane);
  walk_.partly(q, known, in_force_.tcp, motion.source.line);
}

bool ProgramReplay::words_of_shape(const nc::AxisWords& words, SourceRef source, JointVector& out) {
  ++figures_.points_out;
  ++figures_.feed_blocks;
  const std::uint16_t wanted = in_force_.wanted();
  if ((words.mask & wanted) != wanted || from_unknown_) {
    findings_.error(file_, source, "an arc or a drilling cycle before all axes have been positioned");
    from_unknown_ = true;
    return false;
  }
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    out[id] = controller_.numbers.axes.internal(axis_words_.letters[id], words[axis_words_.letters[id]]);
  return true;
}

void ProgramReplay::put(BlockEnd end) {
  end.up = walk_.wholly(end.q, end.rapid, end.tcp, in_force_.kinematics, end.nc_line) && walk_.is_up();
  for (MachineJudge* judge : judges_) judge->put(end);
}

void ProgramReplay::take(const nc::Arc& arc) {
  JointVector words;
  if (!words_of_shape(arc.words, arc.source, words)) return;
  const nc::ArcCourse course =
      nc::course_of(arc, controller_.numbers.axes, kBowShare * options_.tolerance_mm);
  for (const auto& xyz : course.xyz_mm) {
    BlockEnd v = in_force_.end_at(axis_words_.with_xyz(words, xyz));
    v.nc_line = arc.source.line;
    v.feed = arc.feed;
    v.off_chord_mm = static_cast<float>(course.off_chord_mm);
    put(v);
  }
}

void ProgramReplay::take(const nc::Hole& hole) {
  JointVector words;
  if (!words_of_shape(hole.words, hole.source, words)) return;
  const bool is_tap = hole.kind == nc::Hole::Kind::tap;
  if (is_tap) mark(hole);
  const auto strokes = nc::strokes_of(hole, controller_.cycles, controller_.numbers.axes);
  const auto deepest =
      std::min_element(strokes.rbegin(), strokes.rend(),
                       [](const nc::Stroke& a, const nc::Stroke& b) { return a.xyz_mm[2] < b.xyz_mm[2]; });
  for (const nc::Stroke& stroke : strokes) {
    BlockEnd v = in_force_.end_at(axis_words_.with_xyz(words, stroke.xyz_mm));
    v.nc_line = hole.source.line;
    v.rapid = stroke.rapid;
    v.feed = hole.feed;
    v.in_cycle = true;
    v.to_bottom = &stroke == &*deepest;
    put(v);
    if (!(stroke.dwell_s > 0.0)) continue;
    const nc::Dwell dwell{std::llround(stroke.dwell_s * 1000.0)};
    mark(dwell);
    hand_on(dwell);
  }
  if (is_tap) mark(nc::Hole{});  // the thread is cut
}

}  // namespace trunnion::post
