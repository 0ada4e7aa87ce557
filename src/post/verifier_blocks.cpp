// The blocks of the program read back, one after the other: where the axes stand, within their limits, how
// fast.
#include <algorithm>
#include <utility>

#include "post/verifier_state.hpp"

namespace trunnion::post {

void Verifier::State::take(const nc::Motion& motion, const nc::VariableMotion* terms) {
  ++report.points_out;
  if (tools.unknown && shared.leader == nullptr) {
    findings.error(file, motion.source,
                   "the program moves with tool " + std::to_string(*std::exchange(tools.unknown, {})) +
                       ", whose gauge length is not known: neither the CL file nor a tool file "
                       "(--tools) has it");
  }
  if (program_judge) program_judge->take_axes(motion.words.mask, motion.source.line);
  const bool rapid = motion.kind == nc::MotionKind::rapid;
  ++(rapid ? report.rapid_blocks : report.feed_blocks);
  shared.begin_motion();
  // Who reads the same text has just found the same.
  if (terms == nullptr && shared.leader != nullptr && shared.leader->shared.last_end &&
      !in_force.compensates) {
    in_force.rotary = shared.leader->in_force.rotary;
    progress.from_unknown = false;
    const BlockEnd& end = *shared.leader->shared.last_end;
    walk.wholly(end.q, end.rapid, end.tcp, in_force.kinematics, end.nc_line);
    return take(end);
  }
  const JointVector words = axis_words.internal(motion.words);
  in_force.take_rotary(motion.words, words);
  if (in_force.compensates && (rapid || !(*in_force.compensates == in_force.rotary))) {
    findings.error(file, motion.source, "a rapid, or a turn of a rotary axis, under cutter compensation");
    in_force.compensates.reset();
  }
  // Positions are not all known at the start of a program and after a retract to machine coordinates.
  if ((motion.words.mask & in_force.wanted()) != in_force.wanted() || in_force.leaves_plane(motion.words)) {
    progress.from_unknown = true;
    return take_partly(motion);
  }
  BlockEnd v = in_force.end_at(words);
  v.nc_line = motion.source.line;
  const bool walks = walk.wholly(v.q, rapid, v.tcp, in_force.kinematics, v.nc_line);
  v.from_unknown = std::exchange(progress.from_unknown, false) || walks;
  v.up = walks && walk.is_up();
  v.feed_mode = motion.feed_mode;
  v.feed = motion.feed;
  v.rapid = rapid;
  if (terms != nullptr) {
    waiting.add(std::make_unique<WithTerms>(WithTerms{v, *terms}));
    return work();
  }
  if (shared.follower != nullptr) shared.last_end = v;
  take(v);
}

void Verifier::State::take(const nc::ToolCall& call) {
  tools.any = true;
  if (controller.tool_change_s > 0.0) waiting.add(nc::Dwell{std::llround(controller.tool_change_s * 1000.0)});
  const auto number = static_cast<std::uint32_t>(call.tool);
  const auto length_mm = tools.length_mm(number, options.tools.table);
  tools.unknown = length_mm ? std::nullopt : std::optional(call.tool);
  in_force.set_length(length_mm.value_or(in_force.tool.length_mm));
  // The tool comes without its length, which is added by words of its own.
  in_force.add_length(controller.length.automatic);
  if (in_force.tool.length_mm != judged_with.length_mm || !waiting.blocks.empty())
    waiting.add(InSpindle{in_force.tool.length_mm});
}

// The machine may have gone anywhere for the change. What comes next is judged as if it had come from where
// the tool before stood on the path.
void Verifier::State::put_in_spindle(double length_mm) {
  trail.clear();
  const bool is_first = !judged_with.meter;
  if (!is_first && length_mm == judged_with.length_mm) return;
  const TableKinematics kinematics(machine, {0.0, 0.0, -length_mm});
  if (have_previous) {
    JointVector& q = previous->q;
    kinematics.solve_linear(previous->station.tip_P, kinematics.sines(q), q);
  }
  judged_with.length_mm = length_mm;
  judged_with.meter.emplace(machine, Vec3(0.0, 0.0, -length_mm), options.truth,
                            as_run.offsets ? &*as_run.offsets : nullptr, options.certify,
                            options.tolerance_mm, options.axis_tolerance);
  at_once.begin(meter().kinematics());
  last_block.bows.reset();
  if (!have_previous) return;
  path::put_station(meter().kinematics(), previous->q, previous->station);
  meter().place_at_station(*previous, previous->q, as_run.state);
}

void Verifier::State::take_other(const nc::Block& block) {
  if (!std::holds_alternative<nc::Arc>(block) && !std::holds_alternative<nc::Hole>(block) &&
      !std::holds_alternative<nc::VariableMotion>(block) && !std::holds_alternative<nc::Comment>(block))
    mark(block);
  if (const auto* motion = std::get_if<nc::VariableMotion>(&block)) take(motion->motion, motion);
  if (const auto* arc = std::get_if<nc::Arc>(&block)) take(*arc);
  if (const auto* hole = std::get_if<nc::Hole>(&block)) take(*hole);
  if (const auto* latch = std::get_if<nc::LatchValues>(&block)) waiting.add(*latch);
  if (const auto* run_time = std::get_if<nc::RunTimeStep>(&block)) waiting.add(*run_time);
  if (const auto* control = std::get_if<nc::TcpControl>(&block)) {
    in_force.tcp = control->on;
    if (controller.tcp.replaces_length) in_force.add_length(false);
  }
  if (const auto* retract = std::get_if<nc::Retract>(&block)) take(*retract);
  if (std::holds_alternative<nc::ToolCall>(block)) walk.forget(nc_line());
  if (const auto* spindle = std::get_if<nc::Spindle>(&block); spindle != nullptr && spindle->rpm == 0)
    walk.needs_height("the spindle stops", nc_line());
  if (std::holds_alternative<nc::ProgramEnd>(block)) walk.needs_height("the program ends", nc_line());
  if (const auto* cutter = std::get_if<nc::CutterCompensation>(&block)) in_force.switch_cutter(cutter->side);
  if (const auto* offset = std::get_if<nc::WorkOffset>(&block)) in_force.shift.read(*offset);
  if (const auto* offset = std::get_if<nc::OffsetShift>(&block)) in_force.shift.read(*offset);
  // What the machine does takes its turn among the motions, which may have to wait for theirs.
  if (const auto* comment = std::get_if<nc::Comment>(&block); comment != nullptr && as_run.offsets)
    waiting.add(*comment);
  if (const auto* dwell = std::get_if<nc::Dwell>(&block)) waiting.add(*dwell);
  if (const auto* call = std::get_if<nc::ToolCall>(&block)) take(*call);
  if (const auto* length = std::get_if<nc::LengthCompensation>(&block))
    in_force.add_length(length->number > 0);
  if (const auto* spindle = std::get_if<nc::Spindle>(&block)) waiting.add(*spindle);
  if (const auto* tilted = std::get_if<nc::TiltedPlane>(&block)) take(*tilted);
}

void Verifier::State::take(const nc::Retract& retract) {
  for (AxisId id = 0; id < axis_words.count; ++id) {
    if ((retract.axes & nc::AxisWords::bit(axis_words.letters[id])) == 0) continue;
    std::optional<double> to;
    if (retract.to.has(axis_words.letters[id]))
      to = controller.numbers.axes.internal(axis_words.letters[id], retract.to[axis_words.letters[id]]);
    walk.retract(id, to, nc_line());
  }
  waiting.add(retract);
}

void Verifier::State::take_partly(const nc::Motion& motion) {
  mark(motion);
  JointVector words;
  SafeWalk::Known known{};
  const bool in_part = in_force.in_part();
  for (AxisId id = 0; id < axis_words.count; ++id) {
    const bool is_linear = machine.axes[id].kind == AxisKind::linear;
    known[id] =
        (motion.words.mask & nc::AxisWords::bit(axis_words.letters[id])) != 0 && !(is_linear && in_part);
    words[id] = axis_words.of[id].internal(motion.words);
  }
  if (in_part && (motion.words.mask & axis_words.linear) != 0)
    walk.sideways(in_force.tcp && !in_force.plane, motion.source.line);
  JointVector q = in_force.joints_of(words);
  if (!in_force.shift.is_idle()) q = in_force.shift.joints(q, false);
  walk.partly(q, known, in_force.tcp, motion.source.line);
}

void Verifier::State::take(const BlockEnd& end) {
  if (!waiting.is_empty()) work();
  // Where the leader could be judged its follower can: that asks for twice the way.
  const bool led = shared.leader != nullptr && shared.leader->shared.stepped && shared.same_words;
  shared.stepped = waiting.is_empty() && (led || may_step() || is_within_known(end));
  if (!shared.stepped) {
    waiting.add(end);
    return;
  }
  step(end);
  forget_passed();
}

bool Verifier::State::is_within_known(const BlockEnd& end) const {
  if (!progress.started || progress.away || end.rapid || end.in_cycle || end.tcp ||
      at.segment + 1 >= targets().size())
    return false;
  double way_mm = 0.0;
  double turn = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double d = std::abs(end.q[id] - previous->q[id]);
    way_mm += axis_words.of[id].linear_share * d;
    turn += axis_words.of[id].rotary_share * d;
  }
  // The tip is no farther from a rotary axis than the chain is long; twice that, for what `find` takes for
  // its reach and for the errors of the machine.
  const double reach_mm = 2.0 * (way_mm + turn * (previous->station.size_mm + way_mm) + hit_tolerance());
  return targets().back().along_mm - targets()[at.segment + 1].along_mm > reach_mm;
}

void Verifier::State::work() {
  // What is no motion waits for those before it only.
  const auto may = [&] {
    if (may_step()) return true;
    const auto& what = waiting.blocks[waiting.next];
    if (const auto* end = std::get_if<BlockEnd>(&what)) return is_within_known(*end);
    return !std::holds_alternative<std::unique_ptr<WithTerms>>(what);
  };
  while (!waiting.is_empty() && may()) {
    std::visit([this](const auto& what) { step(what); }, waiting.blocks[waiting.next++]);
  }
  waiting.drop_judged();
  forget_passed();
}

// Whose points they are, for whoever follows it, too.
void Verifier::State::forget_passed() {
  if (shared.leader != nullptr) return;
  const auto settled = [](const State& s) {
    return s.trail.marks.empty() ? s.at.segment : s.trail.marks.front().at.segment;
  };
  std::size_t passed =
      shared.follower != nullptr ? std::min(settled(*this), settled(*shared.follower)) : settled(*this);
  if (passed <= std::max(4 * kLookAhead, targets().size() / 2)) return;
  --passed;  // the segment before the one at hand may be asked for (flute_about)
  points->forget(passed);
  if (program_judge) program_judge->asked().forget(points->gone());
  for (State* s : {this, shared.follower}) {
    if (s == nullptr) continue;
    s->at.segment -= passed;
    for (TrailMark& mark : s->trail.marks) mark.at.segment -= passed;
  }
}

void Verifier::State::step(const BlockEnd& end) {
  Vertex& v = *present;
  static_cast<BlockEnd&>(v) = end;
  if (program_judge) program_judge->check_offset(v.nc_line);
  v.placed = false;
  // Who reads the same text has mostly been at the same place just before.
  const bool is_leaders = shared.leader != nullptr && shared.leader->have_previous &&
                          shared.leader->previous->q == v.q &&
                          shared.leader->judged_with.length_mm == judged_with.length_mm;
  if (is_leaders)
    v.station = shared.leader->previous->station;
  else
    path::put_station(meter().kinematics(), v.q, v.station);
  shared.same_block = is_leaders && is_block_of_leader(v);
  last_block.bows.reset();
  if (!(is_leaders && shared.same_words && shared.leader->travel.is_within())) check_limits(v);
  meter().place_at_station(v, v.q, as_run.state);
  if (options.collect && have_previous) path_mm += (v.tip_P - previous->tip_P).norm();
  if (!progress.started) {
    start(v);
  } else if (v.rapid) {
    rapid(v);
  } else {
    feed(v);
  }
  const double seconds = shared.same_block ? seconds_of_leader(v) : block_seconds(v);
  if (!report.blocks.empty()) report.blocks.back().seconds = seconds;
  if (!trail.blocks.empty()) trail.blocks.back().seconds = seconds;
  if (options.truth != nullptr && !meter().is_fixed())
    as_run.state.move_to(v.q, seconds);  // nothing else asks for it
  elapse(seconds);
  if (program_judge) {
    const bool is_known = have_previous && !v.from_unknown;
    program_judge->lasts(is_known
                             ? pace_of(*previous, v, seconds, last_block.speed_ratio * last_block.seconds)
                             : Pace{0.0, 0.0, 0.0, 0.0, v.feed_mode, v.feed},
                         v.nc_line);
  }
  std::swap(previous, present);
  have_previous = true;
}

Pace Verifier::State::pace_of(const Vertex& from, const Vertex& v, double seconds, double slowest_s) const {
  Pace out{(v.station.tip_P - from.station.tip_P).norm(), 0.0, seconds, slowest_s, v.feed_mode, v.feed};
  for (AxisId id = 0; id < axis_words.count; ++id)
    out.turn_rad = std::max(out.turn_rad, axis_words.of[id].rotary_share * std::abs(v.q[id] - from.q[id]));
  return out;
}

bool Verifier::State::is_block_of_leader(const Vertex& v) const {
  return shared.same_words && have_previous && shared.leader->previous->nc_line == v.nc_line &&
         shared.leader->present->q == previous->q;
}

double Verifier::State::seconds_of_leader(const Vertex& v) {
  last_block.seconds = shared.leader->last_block.seconds;
  if (shared.leader->last_block.speed_ratio > 1.0)
    check_speed(v, last_block.seconds);
  else
    report.max_speed_ratio = std::max(report.max_speed_ratio, shared.leader->last_block.speed_ratio);
  return last_block.seconds;
}

double Verifier::State::block_seconds(const Vertex& v) {
  last_block.speed_ratio = 0.0;
  last_block.seconds = seconds_of(v);
  // Where it came from is not known: neither is its speed.
  if (!v.rapid && last_block.seconds > 0.0 && !v.from_unknown && v.tcp == previous->tcp)
    check_speed(v, last_block.seconds);
  return last_block.seconds;
}

double Verifier::State::seconds_of(const Vertex& v) const {
  if (!have_previous) return 0.0;
  if (v.rapid) return planner.rapid_seconds(previous->q, v.q);
  const bool under_tcp = v.tcp && previous->tcp;
  const auto way = under_tcp ? std::optional((v.word_tip_P - previous->word_tip_P).norm()) : std::nullopt;
  return planner.seconds_of(previous->q, v.q, way, v.feed_mode, v.feed);
}

void Verifier::State::check_speed(const Vertex& v, double seconds) {
  const double needed_s =
      v.tcp ? planner.slowest_along_s([&](double t) { return meter().between(*previous, v, t); })
            : planner.slowest_axis_s(previous->q, v.q);
  const double ratio = needed_s / seconds;
  last_block.speed_ratio = ratio;
  report.max_speed_ratio = std::max(report.max_speed_ratio, ratio);
  if (ratio <= 1.0 + kSpeedRounding) return;
  ++report.too_fast_count;
  if (report.too_fast.size() >= options.worst_count) return;
  const std::size_t next = std::min(at.segment + 1, targets().size() - 1);
  report.too_fast.push_back({v.nc_line, targets().empty() ? 0 : targets()[next].line,
                             machine.axes[planner.slowest_axis(previous->q, v.q)].name, ratio});
}

void Verifier::State::check_limits(const Vertex& v) {
  if (travel.take(v.q, !have_previous)) return;
  for (const LimitViolation& violation : limit_violations(machine, v.q)) {
    // Half a quantum beyond is the rounding of a position at the limit.
    if (violation.by <= 0.5 * controller.numbers.axes.quantum(axis_words.letters[violation.axis]) + 1e-12)
      continue;
    ++report.beyond_limits_count;
    if (report.beyond_limits.size() >= options.worst_count) continue;
    const std::size_t next = std::min(at.segment + 1, targets().size() - 1);
    report.beyond_limits.push_back({v.nc_line, targets().empty() ? 0 : targets()[next].line,
                                    machine.axes[violation.axis].name, machine.axes[violation.axis].kind,
                                    violation.value, violation.by});
  }
}

void Verifier::State::report_travel() {
  const State& s = shared.same_words ? *shared.leader : *this;
  if (!s.have_previous) return;
  report.travel.reserve(axis_words.count);
  for (AxisId id = 0; id < axis_words.count; ++id)
    report.travel.push_back({machine.axes[id], s.travel.smallest(id), s.travel.largest(id)});
}

}  // namespace trunnion::post
