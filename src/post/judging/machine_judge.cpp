#include "post/judging/machine_judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/plan_of_control.hpp"

namespace trunnion::post {
namespace {

constexpr double kSameAxis_rad = 1e-5;  // the rounding of the angles

FollowLimits follow_limits(const JudgedMachine& judged, const TableKinematics& kinematics) {
  const VerifyOptions& o = judged.options;
  return {o.tolerance_mm,
          o.axis_tolerance.rad(),
          o.pole.tolerance.rad(),
          o.truth != nullptr || o.offsets != nullptr,
          o.pole.tolerance.rad() > 0.0 && kinematics.rotary_count() >= 2,
          kinematics.direction(1),
          std::cos(o.pole.cone.rad())};
}

// Every rotary axis goes no farther than to where the tool stands at `target`, one after the other, say: to
// the nearest position, or one that is about as near.
bool turns_towards(const Machine& machine, const JointVector& from, const JointVector& to,
                   const Target& target) {
  constexpr double kRounding_rad = 1e-4;
  constexpr double kAboutAsNear = 1.5;
  std::optional<double> nearest_rad;
  for (const JointSolution& there : inverse(machine, {target.tip_P, target.axis_P}, from)) {
    double turn_rad = 0.0;
    bool is_between = true;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      if (machine.axes[id].kind != AxisKind::rotary) continue;
      const double begin = from[id], end = there.q[id];
      turn_rad += std::abs(end - begin);
      is_between = is_between && to[id] >= std::min(begin, end) - kRounding_rad &&
                   to[id] <= std::max(begin, end) + kRounding_rad;
    }
    if (!nearest_rad) nearest_rad = turn_rad;
    if (is_between && turn_rad <= kAboutAsNear * *nearest_rad + kRounding_rad) return true;
  }
  return false;
}

}  // namespace

MachineJudge::MachineJudge(JudgedMachine judged, const WordsInForce& words, PathPoints& points)
    : judged_(std::move(judged)),
      words_(words),
      expected_(points),
      path_(points, follow_limits(judged_, words.kinematics)),
      axes_{ControlTimes(judged_.machine, judged_.controller), TravelSeen(judged_.machine)},
      as_run_(judged_.machine, judged_.controller, options()),
      record_(options()) {
  put_in_spindle(words.tool.length_mm);
  if (auto plan = plan_of_control(judged_.machine, judged_.controller, options().smoothing_mm,
                                  PlanOf::paces_and_seconds))
    as_run_.feeds.emplace(std::move(*plan), record_.report);
  at_once_.quiet = QuietRun(path_.limits());
}

void MachineJudge::lead(MachineJudge& other) {
  sharing_.follower = &other;
  other.sharing_.leader = this;
  // Nothing that only one of them knows of changes where its words lead.
  other.sharing_.same_words = words_are_positions() && other.words_are_positions();
}

void MachineJudge::judge_program() {
  program_judge_.emplace(judged_.machine, judged_.controller, options(), points());
  if (as_run_.feeds) as_run_.feeds->tell(*program_judge_);
}

// --- blocks, in their turn ---

void MachineJudge::take(const BlockEnd& end) {
  sharing_.stepped = false;
  if (!waiting_.is_empty()) work();
  // Where the leader could be judged its follower can: that asks for twice the way.
  const bool led = sharing_.leader != nullptr && sharing_.leader->sharing_.stepped && sharing_.same_words;
  sharing_.stepped = waiting_.is_empty() && (led || may_step() || is_within_known(end));
  if (!sharing_.stepped) {
    waiting_.add(end);
    return;
  }
  step(end);
  forget_passed();
}

void MachineJudge::put(const BlockEnd& end) {
  sharing_.stepped = false;
  waiting_.add(end);
  work();
}

void MachineJudge::add(WithTerms motion) {
  sharing_.stepped = false;
  waiting_.add(std::make_unique<WithTerms>(std::move(motion)));
  work();
}

// What the machine does takes its turn among the motions, which may have to wait for theirs.
void MachineJudge::add(const nc::Comment& comment) {
  if (as_run_.offsets) waiting_.add(comment);
}

void MachineJudge::add(const InSpindle& tool) {
  if (tool.length_mm != tool_.length_mm || !waiting_.holds_none()) waiting_.add(tool);
}

void MachineJudge::mark(const nc::Block& block, std::uint32_t nc_line) {
  if (program_judge_) waiting_.add(std::make_unique<Mark>(Mark{block, nc_line}));
}

void MachineJudge::take_axes(std::uint16_t mask, std::uint32_t nc_line) {
  if (program_judge_) program_judge_->take_axes(mask, nc_line);
}

void MachineJudge::find_offset(const std::string& what, std::uint32_t nc_line) {
  if (program_judge_) program_judge_->find(CheckOf::offsets, nc_line, [&] { return what; });
}

bool MachineJudge::is_within_known(const BlockEnd& end) const {
  if (!progress_.started || progress_.away || end.rapid || end.in_cycle || end.tcp ||
      path_.target() == nullptr)
    return false;
  double way_mm = 0.0;
  double turn = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double d = std::abs(end.q[id] - ends_.previous->q[id]);
    way_mm += axis_words().of[id].linear_share * d;
    turn += axis_words().of[id].rotary_share * d;
  }
  // The tip is no farther from a rotary axis than the chain is long; twice that, for what `find` takes for
  // its reach and for the errors of the machine.
  const double reach_mm =
      2.0 * (way_mm + turn * (ends_.previous->station.size_mm + way_mm) + path_.hit_tolerance_mm());
  return points().back().along_mm - points()[path_.next()].along_mm > reach_mm;
}

void MachineJudge::work() {
  // What is no motion waits for those before it only.
  const auto may = [&] {
    if (may_step()) return true;
    if (const auto* end = std::get_if<BlockEnd>(&waiting_.next())) return is_within_known(*end);
    return !std::holds_alternative<std::unique_ptr<WithTerms>>(waiting_.next());
  };
  while (!waiting_.is_empty() && may()) {
    std::visit([this](const auto& what) { step(what); }, waiting_.take_next());
  }
  waiting_.drop_taken();
  forget_passed();
}

// The points are dropped by the leader, when both have passed them.
void MachineJudge::forget_passed() {
  if (sharing_.leader != nullptr) return;
  MachineJudge* const follower = sharing_.follower;
  std::size_t passed = follower != nullptr ? std::min(settled(), follower->settled()) : settled();
  // So seldom that the rows which are moved cost little; more points would not stay in the cache.
  constexpr std::size_t kPassed = 256;
  if (passed <= std::max(kPassed, points().size() / 2)) return;
  --passed;  // the segment before the one at hand may be asked for (FluteAbout)
  expected_.forget(passed);
  if (program_judge_) program_judge_->asked().forget(points().gone());
  forget(passed);
  if (follower != nullptr) follower->forget(passed);
}

void MachineJudge::forget(std::size_t count) {
  path_.forget(count);
  for (TrailMark& mark : trail_.marks()) mark.at.segment -= count;
}

void MachineJudge::step(const std::unique_ptr<WithTerms>& motion) {
  BlockEnd end = motion->end;
  end.q = words_.shift.moved(end.q, as_run_.values.change(motion->terms), end.tcp);
  step(end);
}

// The control holds the drift as it is.
void MachineJudge::step(const nc::LatchValues& latch) {
  as_run_.values.latch(latch, as_run_.offsets ? as_run_.offsets->now() : Vec3::Zero());
}

void MachineJudge::step(const nc::RunTimeStep& line) {
  const auto* temperatures = options().temperatures.of_program;
  if (temperatures == nullptr) return as_run_.values.take(line, {}, {});
  as_run_.values.take(line, temperatures->at(record_.report.duration_s), temperatures->temperature_K.front());
}

void MachineJudge::step(const nc::Comment& comment) {
  end_trail();
  as_run_.offsets->comment(comment.text);
}

void MachineJudge::step(const nc::Dwell& dwell) {
  end_trail();
  as_run_.late.rest();
  const double seconds = static_cast<double>(dwell.milliseconds) / 1000.0;
  as_run_.state.wait(seconds);
  if (!record_.report.blocks.empty()) record_.report.blocks.back().dwell_s += seconds;
  if (as_run_.feeds) as_run_.feeds->wait(seconds);
  elapse(seconds);
}

// Straight up is along the tool axis.
void MachineJudge::step(const nc::Retract&) {
  end_trail();
  as_run_.late.rest();
  progress_.away = progress_.started;
  progress_.stopped_away = false;
}

void MachineJudge::step(const nc::Spindle& spindle) {
  end_trail();
  if (as_run_.feeds) as_run_.feeds->wait(0.0);
  as_run_.state.spindle(static_cast<double>(spindle.rpm));
}

void MachineJudge::step(const std::unique_ptr<Mark>& mark) {
  end_trail();
  progress_.stopped_away = true;
  program_judge_->take(mark->block, at(), mark->nc_line);
  const auto* latch = std::get_if<nc::LatchValues>(&mark->block);
  if (latch == nullptr) return;
  const double now_s = record_.report.duration_s;
  program_judge_->check_limits(*latch, now_s - std::exchange(progress_.latched_s, now_s), mark->nc_line);
}

// The machine may have gone anywhere for the change. What comes next is judged as if it had come from where
// the tool before stood on the path.
void MachineJudge::put_in_spindle(double length_mm) {
  end_trail();
  const bool is_first = !tool_.meter;
  if (!is_first && length_mm == tool_.length_mm) return;
  const TableKinematics kinematics(judged_.machine, {0.0, 0.0, -length_mm});
  Vertex& stands = *ends_.previous;
  if (ends_.has_previous) kinematics.solve_linear(stands.station.tip_P, kinematics.sines(stands.q), stands.q);
  record_.tool_length_mm = tool_.length_mm = length_mm;
  const DeviationMeter::Errors errors{options().truth, as_run_.offsets ? &*as_run_.offsets : nullptr};
  const DeviationMeter::Limits limits{options().tolerance_mm, options().axis_tolerance, options().certify};
  tool_.meter.emplace(judged_.machine, Vec3(0.0, 0.0, -length_mm), errors, limits);
  at_once_.begin(meter().kinematics());
  ends_.last.bows.reset();
  if (!ends_.has_previous) return;
  path::put_station(meter().kinematics(), stands.q, stands.station);
  meter().place_at_station(stands, stands.q, as_run_.state);
}

void MachineJudge::step(const BlockEnd& end) {
  Vertex& v = *ends_.present;
  static_cast<BlockEnd&>(v) = end;
  if (as_run_.late.are_late()) v.q = as_run_.late.follow(end, axes_.times);
  if (program_judge_) program_judge_->check_offset(v.nc_line);
  v.placed = false;
  // The leader has mostly been at the same place just before.
  const MachineJudge* leader = sharing_.leader;
  const bool is_leaders = leader != nullptr && leader->ends_.has_previous &&
                          leader->ends_.previous->q == v.q && leader->tool_.length_mm == tool_.length_mm;
  if (is_leaders)
    v.station = leader->ends_.previous->station;
  else
    path::put_station(meter().kinematics(), v.q, v.station);
  sharing_.same_block = is_leaders && is_block_of_leader(v);
  ends_.last.bows.reset();
  if (!(is_leaders && sharing_.same_words && leader->axes_.travel.is_within())) check_limits(v);
  meter().place_at_station(v, v.q, as_run_.state);
  if (options().collect && ends_.has_previous) record_.path_mm += (v.tip_P - ends_.previous->tip_P).norm();
  const bool was_away = progress_.away;
  if (!progress_.started) {
    start(v);
  } else if (v.rapid) {
    rapid(v);
  } else {
    feed(v);
  }
  const double seconds = sharing_.same_block ? seconds_of_leader(v) : block_seconds(v);
  if (!record_.report.blocks.empty()) record_.report.blocks.back().seconds = seconds;
  if (!trail_.empty()) trail_.last_takes(seconds);
  if (options().truth != nullptr && !meter().is_fixed())
    as_run_.state.move_to(v.q, seconds);  // nothing else asks for it
  elapse(seconds);
  const bool is_known = ends_.has_previous && !v.from_unknown;
  if (program_judge_) {
    program_judge_->lasts(
        is_known ? pace_of(*ends_.previous, v, seconds, ends_.last.speed_ratio * ends_.last.seconds)
                 : Pace{0.0, 0.0, 0.0, 0.0, v.feed_mode, v.feed},
        v.nc_line);
  }
  if (as_run_.feeds) {
    if (is_known)
      reach(v, seconds, v.rapid || was_away || progress_.away);
    else
      as_run_.feeds->wait(seconds);
  }
  ends_.go_on();
}

// --- time, speed, travel ---

void MachineJudge::elapse(double seconds) {
  record_.report.duration_s += seconds;
  as_run_.elapse(seconds);
}

void MachineJudge::reach(const Vertex& v, double seconds, bool apart) {
  reach({commanded_before(), commanded(v), seconds, apart, v.feed, v.nc_line});
}

void MachineJudge::reach(const ReachedFeeds::Block& block) {
  as_run_.feeds->add(block, program_judge_ ? program_judge_->take_slow() : std::nullopt);
}

Pace MachineJudge::pace_of(const Vertex& from, const Vertex& v, double seconds, double slowest_s) const {
  Pace out{(v.station.tip_P - from.station.tip_P).norm(), 0.0, seconds, slowest_s, v.feed_mode, v.feed};
  for (AxisId id = 0; id < axis_words().count; ++id)
    out.turn_rad = std::max(out.turn_rad, axis_words().of[id].rotary_share * std::abs(v.q[id] - from.q[id]));
  // One F must do for all directions of an arc or a cycle: it may be that of the slowest linear axis.
  if (v.off_chord_mm > 0.0F || v.in_cycle)
    out.slowest_s = std::max(out.slowest_s, out.way_mm / axes_.times.axes().linear_rate_mm_s());
  return out;
}

// The leader, which stands where `v` is, came from where this one comes from.
bool MachineJudge::is_block_of_leader(const Vertex& v) const {
  return sharing_.same_words && ends_.has_previous && sharing_.leader->ends_.previous->nc_line == v.nc_line &&
         sharing_.leader->ends_.present->q == ends_.previous->q;
}

double MachineJudge::seconds_of_leader(const Vertex& v) {
  const LastBlock& leaders = sharing_.leader->ends_.last;
  ends_.last.seconds = leaders.seconds;
  if (leaders.speed_ratio > 1.0)
    check_speed(v, ends_.last.seconds);
  else
    record_.report.max_speed_ratio = std::max(record_.report.max_speed_ratio, leaders.speed_ratio);
  return ends_.last.seconds;
}

// Time of the block as the control runs it; its speed is looked at, too.
double MachineJudge::block_seconds(const Vertex& v) {
  ends_.last.speed_ratio = 0.0;
  ends_.last.seconds = seconds_of(v);
  // Where it came from is not known: neither is its speed.
  if (!v.rapid && ends_.last.seconds > 0.0 && !v.from_unknown && v.tcp == ends_.previous->tcp)
    check_speed(v, ends_.last.seconds);
  return ends_.last.seconds;
}

double MachineJudge::seconds_of(const Vertex& v) const {
  if (!ends_.has_previous) return 0.0;
  const Vertex& from = *ends_.previous;
  const JointVector &begin = commanded_before(), &end = commanded(v);
  if (v.rapid) return axes_.times.axes().rapid_seconds(begin, end);
  const bool under_tcp = v.tcp && from.tcp;
  const auto way = under_tcp ? std::optional((v.word_tip_P - from.word_tip_P).norm()) : std::nullopt;
  return axes_.times.seconds(axes_.times.way(begin, end, way), v.feed_mode, v.feed);
}

const JointVector& MachineJudge::commanded(const Vertex& v) const {
  return as_run_.late.are_late() ? as_run_.late.commanded() : v.q;
}

const JointVector& MachineJudge::commanded_before() const {
  return as_run_.late.are_late() ? as_run_.late.from() : ends_.previous->q;
}

void MachineJudge::check_speed(const Vertex& v, double seconds) {
  const Vertex& from = *ends_.previous;
  const double needed_s =
      v.tcp ? axes_.times.axes().slowest_along_s([&](double t) { return meter().between(from, v, t); })
            : axes_.times.axes().slowest_axis_s(commanded_before(), commanded(v));
  const double ratio = needed_s / seconds;
  ends_.last.speed_ratio = ratio;
  VerifyReport& report = record_.report;
  report.max_speed_ratio = std::max(report.max_speed_ratio, ratio);
  if (ratio <= 1.0 + kSpeedRounding) return;
  ++report.too_fast_count;
  if (report.too_fast.size() >= options().worst_count) return;
  report.too_fast.push_back(
      {v.nc_line, path_.cl_line(),
       judged_.machine.axes[axes_.times.axes().slowest_axis(commanded_before(), commanded(v))].name, ratio});
}

void MachineJudge::check_limits(const Vertex& v) {
  const JointVector& q = commanded(v);
  if (axes_.travel.take(q, !ends_.has_previous)) return;
  VerifyReport& report = record_.report;
  for (const LimitViolation& violation : limit_violations(judged_.machine, q)) {
    // Half a quantum beyond is the rounding of a position at the limit.
    const double quantum = judged_.controller.numbers.axes.quantum(axis_words().letters[violation.axis]);
    if (violation.by <= 0.5 * quantum + 1e-12) continue;
    ++report.beyond_limits_count;
    if (report.beyond_limits.size() >= options().worst_count) continue;
    const Axis& axis = judged_.machine.axes[violation.axis];
    report.beyond_limits.push_back(
        {v.nc_line, path_.cl_line(), axis.name, axis.kind, violation.value, violation.by});
  }
}

void MachineJudge::report_travel() {
  const MachineJudge& judge = sharing_.same_words ? *sharing_.leader : *this;
  if (!judge.ends_.has_previous) return;
  record_.report.travel.reserve(axis_words().count);
  for (AxisId id = 0; id < axis_words().count; ++id)
    record_.report.travel.push_back(
        {judged_.machine.axes[id], judge.axes_.travel.smallest(id), judge.axes_.travel.largest(id)});
}

// --- along the CL path ---

void MachineJudge::start(const Vertex& v) {
  if (points().empty()) return;
  const Target& first = points()[0];
  // The program may first go to a safe height: the path begins where the first CL point is met.
  const bool met = path_.hits(v, first) || !v.rapid;
  if (met) {
    progress_.started = true;
    record_.point_hit((v.tip_P - first.tip_P).norm());
    if (program_judge_ && v.rapid) program_judge_->rapid_to(0, v.nc_line);
    if (program_judge_ && !v.rapid) program_judge_->comes_to(0);
    if (program_judge_ && first.rapid && !v.rapid) judge_feed_to(first, v.nc_line);
  } else if (program_judge_ && !v.up && !path_.is_above(v, first, -path_.hit_tolerance_mm())) {
    program_judge_->find(CheckOf::rapids, v.nc_line, [] {
      return std::string(
          "a rapid below the safe height that does not go to a place above the first CL point");
    });
  }
  record_.end_block(v, first.line, met);
}

void MachineJudge::hit_point(std::size_t point, const ToolPose& v) {
  record_.point_hit((v.tip_P - points()[point].tip_P).norm());
  path_.go_to(point);
}

void MachineJudge::rapid(const Vertex& v) {
  if (v.in_cycle && drills(v)) return;
  pass_repeated_points(v);
  pass_end_of_cut(v);
  match_end_of_cut();
  trail_.clear();
  if (program_judge_ && v.tcp) judge_swing(v);
  if (program_judge_ && !v.tcp) judge_whole_turn(v);
  if (rises(v)) {
    settle_rapid_end();
    progress_.away = true;
    return record_.end_block(v, path_.here().line, false);
  }
  if (is_back_at_rapid(v) || comes_nearer(v)) return;
  settle_rapid_end();
  const std::size_t next = path_.next();
  const Target* target = path_.target();
  const bool is_to_rapid = target != nullptr && target->rapid;
  const bool met = is_to_rapid && path_.hits(v, *target);
  if (met) {
    progress_.rapid_end =
        Progress::RapidEnd{*target, (v.tip_P - target->tip_P).norm(), path_.distance_to(v, *target)};
    progress_.away = false;
  }
  // On the way over the safe height there is no line to keep to.
  if (is_to_rapid && !v.from_unknown && !progress_.away) {
    const double off_mm =
        meter().sampled(*ends_.previous, v, {points()[next - 1], *target}, as_run_.state).tip_mm.upper;
    VerifyReport& report = record_.report;
    if (off_mm > report.max_rapid_deviation_mm) report.worst_rapid = {v.nc_line, target->line};
    report.max_rapid_deviation_mm = std::max(report.max_rapid_deviation_mm, off_mm);
  }
  if (program_judge_ && met) program_judge_->rapid_to(next, v.nc_line);
  if (program_judge_ && !met) judge_rapid(v);
  if (met) path_.go_to(next);
  record_.end_block(v, target != nullptr ? target->line : 0, met);
}

bool MachineJudge::rises(const Vertex& v) const {
  const Vertex& from = *ends_.previous;
  const auto z = judged_.machine.axis("Z");
  const Target* target = path_.target();
  if (!v.tcp || !judged_.controller.length.moves_at_once || v.from_unknown || progress_.away || !z)
    return false;
  if (target != nullptr && target->rapid && path_.hits(v, *target)) return false;
  // A shift of the work offset asks for room at the end of the travel, as for SafeWalk.
  const double room_mm = 1.0 + 2.0 * options().offset_limits.clamp_mm;
  const Vec3 way = v.tip_P - from.tip_P;
  return judged_.machine.safe.is_safe(v.q[*z], room_mm) && way.dot(from.axis_P) > (1.0 - 1e-6) * way.norm() &&
         angle_between(v.axis_P, from.axis_P).rad() <= kSameAxis_rad;
}

// The end of the rapid at which it left.
bool MachineJudge::is_back_at_rapid(const Vertex& v) {
  const Target& left = points()[at().segment];
  if (!progress_.away || at().t != 0.0 || !left.rapid || !path_.hits(v, left)) return false;
  const Target* next = path_.target();
  if (next != nullptr && path_.distance_to(v, *next) < path_.distance_to(v, left)) return false;
  progress_.away = false;
  record_.end_block(v, left.line, true);
  return true;
}

void MachineJudge::judge_rapid(const Vertex& v) {
  const Target* target = path_.target();
  const bool is_outside = progress_.away || v.from_unknown;
  if (v.up || turns_in_place(v)) return;
  // Holes whose clearances are so little apart are one height to the CL file, and two to a cycle's words.
  constexpr double kSameHeight_mm = 1e-3;
  const double way_mm = (v.station.tip_P - ends_.previous->station.tip_P).norm();
  if (v.in_cycle && way_mm <= kSameHeight_mm + words_rounding_mm()) return;
  // Held to its line.
  if (target != nullptr && target->rapid && !is_outside) return;
  const double near_mm = path_.hit_tolerance_mm();
  if (is_outside && target != nullptr && target->rapid && path_.is_above(v, *target, -near_mm)) return;
  const bool may_be_above = is_outside || target == nullptr || target->rapid;
  if (may_be_above && path_.is_above(v, path_.here(), target != nullptr ? near_mm : -near_mm)) return;
  // A cut may begin behind a tool change: above where it does.
  if (is_outside && target != nullptr && path_.is_above(v, *target, near_mm)) return;
  program_judge_->find(CheckOf::rapids, v.nc_line, [&] {
    return std::string(is_outside || target == nullptr
                           ? "a rapid below the safe height that the CL file does not ask for"
                           : "a rapid where the CL file cuts") +
           (target != nullptr ? cl_line(target->line) : "");
  });
}

void MachineJudge::judge_feed_to(const Target& target, std::uint32_t nc_line) {
  program_judge_->find(CheckOf::rapids, nc_line,
                       [&] { return "a feed where the CL file has a rapid" + cl_line(target.line); });
}

bool MachineJudge::turns_in_place(const Vertex& v) const {
  constexpr double kDigits = 4.0;
  return (v.station.tip_P - ends_.previous->station.tip_P).norm() <=
         kDigits * judged_.controller.numbers.axes.quantum(nc::AxisLetter::X);
}

// Where the tool is on its way to a rapid's end its axis is free between the two axes, and its rotary axes on
// their ways: what the CL file asks for. Anywhere else it stays as it is. Which way the axes go in a block
// that ends there is looked at, too.
void MachineJudge::judge_swing(const Vertex& v) {
  constexpr int kPlaces = 16;
  constexpr double kRounding_rad = 1e-4;
  const Vertex& from = *ends_.previous;
  const Target* target = path_.target();
  // Before a tool change no turn is asked for: it belongs to the safe height.
  const bool is_asked = target != nullptr && target->rapid && !progress_.away &&
                        !program_judge_->wants_another_tool(path_.next());
  // What leaves from a place that is not known is followed by SafeWalk.
  if (v.from_unknown || v.up || (is_asked && (!turns_in_place(v) || path_.hits(v, *target)))) return;
  if (stands_safe(from, v)) return;
  double turn_rad = 0.0;
  for (AxisId id = 0; id < axis_words().count; ++id)
    turn_rad = std::max(turn_rad, axis_words().of[id].rotary_share * std::abs(v.q[id] - from.q[id]));
  if (turn_rad <= kRounding_rad) return;
  const Vec3 here_P = path_.here().axis_P;
  const FollowLimits& limits = path_.limits();
  // Words may make up for errors of the machine.
  const double errors_rad = angle_between(v.axis_P, v.station.axis_P).rad();
  const double slack_rad =
      limits.axis_tolerance_rad + limits.pole_tolerance_rad + kRounding_rad + 2.0 * errors_rad;
  const double between_rad = is_asked ? angle_between(here_P, target->axis_P).rad() : 0.0;
  double farthest_rad = 0.0;
  for (int i = 1; i <= kPlaces; ++i) {
    const JointVector q = JointVector::interpolate(from.q, v.q, static_cast<double>(i) / kPlaces);
    const Vec3 axis_P = path::station(meter().kinematics(), q).axis_P;
    if (limits.in_cone(here_P) && limits.in_cone(axis_P)) continue;
    double off_rad = angle_between(here_P, axis_P).rad();
    if (is_asked) off_rad = std::max(off_rad, angle_between(target->axis_P, axis_P).rad());
    farthest_rad = std::max(farthest_rad, off_rad);
  }
  if (farthest_rad <= between_rad + slack_rad ||
      (is_asked && turns_towards(judged_.machine, from.q, v.q, *target)))
    return;
  program_judge_->find(CheckOf::rapids, v.nc_line, [&] {
    return "a rotary axis turns below the safe height and the CL file does not ask for it: the tool axis "
           "goes " +
           fixed_text(farthest_rad * kDegreePerRad, 3) + " deg off it" +
           (target != nullptr ? cl_line(target->line) : "");
  });
}

// More than half a turn at once ends where a shorter way, or none, does, and so does a turn to the other
// solution of the rotary axes: the table goes round under the tool, and the ends do not show it.
void MachineJudge::judge_whole_turn(const Vertex& v) {
  constexpr int kPlaces = 64;
  constexpr double kRounding_rad = 1e-4;
  const Vertex& from = *ends_.previous;
  if (v.from_unknown || v.up) return;
  double turn_rad = 0.0;
  for (AxisId id = 0; id < axis_words().count; ++id)
    turn_rad = std::max(turn_rad, axis_words().of[id].rotary_share * std::abs(v.q[id] - from.q[id]));
  const double between_rad = angle_between(from.station.axis_P, v.station.axis_P).rad();
  const bool is_one_pose = turns_in_place(v) && between_rad <= path_.limits().axis_tolerance_rad;
  if (turn_rad <= (is_one_pose ? 0.0 : kPi) + kRounding_rad || stands_safe(from, v)) return;
  double off_mm = 0.0, off_rad = 0.0;
  for (int i = 1; i < kPlaces; ++i) {
    const double share = static_cast<double>(i) / kPlaces;
    const path::Station here =
        path::station(meter().kinematics(), JointVector::interpolate(from.q, v.q, share));
    off_mm = std::max(off_mm, distance_to_segment(here.tip_P, from.station.tip_P, v.station.tip_P));
    off_rad = std::max({off_rad, angle_between(here.axis_P, from.station.axis_P).rad() - between_rad,
                        angle_between(here.axis_P, v.station.axis_P).rad() - between_rad});
  }
  const double slack_rad =
      path_.limits().axis_tolerance_rad + path_.limits().pole_tolerance_rad + kRounding_rad;
  if (off_mm <= options().rapid_tolerance_mm + options().tolerance_mm && off_rad <= slack_rad) return;
  program_judge_->find(CheckOf::rapids, v.nc_line, [&] {
    return "a rotary axis turns by " + fixed_text(turn_rad * kDegreePerRad, 1) +
           " deg below the safe height: the tip goes " + fixed_text(off_mm, 3) + " mm, and the tool axis " +
           fixed_text(off_rad * kDegreePerRad, 3) + " deg, off the way between the ends";
  });
}

bool MachineJudge::stands_safe(const Vertex& from, const Vertex& to) const {
  const SafeHeight& safe = judged_.machine.safe;
  const auto z = judged_.machine.axis("Z");
  const double quantum_mm = judged_.controller.numbers.axes.quantum(nc::AxisLetter::Z);
  return z && safe.is_safe(from.q[*z], quantum_mm) && safe.is_safe(to.q[*z], quantum_mm);
}

bool MachineJudge::comes_nearer(const Vertex& v) {
  auto& reached = progress_.rapid_end;
  if (!reached || at().t != 0.0 || points()[at().segment].tip_P != reached->target.tip_P) return false;
  const Target& end = reached->target;
  const double distance = path_.distance_to(v, end);
  // At the pole the inner axis may turn there, in several blocks.
  const Target* next = path_.target();
  const bool goes_on =
      next != nullptr && next->rapid &&
      combined_distance(v, next->tip_P, next->axis_P) < combined_distance(v, end.tip_P, end.axis_P);
  const bool stays = turns_in_place(v) && path_.hits(v, end) && !goes_on;
  if (distance >= reached->distance && !stays) return false;
  reached->distance = distance;
  reached->tip_mm = (v.tip_P - end.tip_P).norm();
  record_.end_block(v, end.line, true);
  return true;
}

void MachineJudge::settle_rapid_end() {
  if (progress_.rapid_end) record_.point_hit(progress_.rapid_end->tip_mm);
  progress_.rapid_end.reset();
}

double MachineJudge::words_rounding_mm() const {
  constexpr double kDigits = 2.0;
  return kDigits * judged_.controller.numbers.axes.quantum(nc::AxisLetter::X);
}

// The tool stands at the CL point before the block to `v`, and no block goes there.
bool MachineJudge::is_repeated(const Target& next, const Vertex& v) const {
  const Vertex& stands = *ends_.previous;
  const double off_mm = (stands.tip_P - next.tip_P).norm();
  const bool is_same = at().t == 0.0 && repeats(next);  // however far rounding is from both
  if (!is_same && off_mm > std::max(kSamePoint_mm, words_rounding_mm())) return false;
  const std::size_t behind = path_.next() + 1;
  const bool rapid_behind = behind < points().size() && points()[behind].rapid;
  // At the pole the inner axis may turn at a rapid's end, or before it, in blocks that leave it by a little.
  const double stays_mm =
      v.rapid ? options().rapid_tolerance_mm + options().tolerance_mm : options().tolerance_mm;
  // The tool axis stays with it.
  const double stays_rad = path_.limits().axis_tolerance_rad + path_.limits().pole_tolerance_rad;
  const bool stays = (v.tip_P - next.tip_P).norm() <= stays_mm &&
                     angle_between(v.axis_P, next.axis_P).rad() <= stays_rad &&
                     path_.distance_to(v, next) <= path_.hit_tolerance_mm() + stays_mm;
  const bool goes_on = behind < points().size() &&
                       (v.rapid ? rapid_behind && path_.hits(v, points()[behind])
                                : path_.distance_to(v, points()[behind]) < path_.distance_to(v, next));
  if (next.rapid && stays && !goes_on) return false;
  if (is_same) return true;
  // A rapid to where the tool stands has no words: the cut before it is over.
  if (rapid_behind && repeats(points()[behind]) && off_mm <= words_rounding_mm() && path_.hits(stands, next))
    return true;
  if (off_mm > kSamePoint_mm) return false;
  const double away_mm = combined_distance(stands, next.tip_P, next.axis_P);
  if (away_mm <= kSamePoint_mm) return true;
  // Near the pole the tool may stand there, tilted; not where the block turns it to the point. A feed does
  // not go to a rapid's.
  return path_.distance_to(stands, next) <= kSamePoint_mm &&
         ((next.rapid && !v.rapid) || combined_distance(v, next.tip_P, next.axis_P) >= away_mm);
}

void MachineJudge::pass_repeated_points(const Vertex& v) {
  for (const Target* next = path_.target(); next != nullptr; next = path_.target()) {
    if (!is_repeated(*next, v)) return;
    record_.mark_programmed();
    hit_point(path_.next(), *ends_.previous);
  }
}

// The CL point, or one that repeats it.
bool MachineJudge::ends_cut(std::size_t point) const {
  for (std::size_t i = point; i < points().size(); ++i) {
    if (i > point && !repeats(points()[i])) return false;
    if (points()[i].ends_cut) return true;
  }
  return true;
}

// The last point of a cut. Elsewhere the tool comes back to where it is and goes on, whether it stops or
// leaves the part to turn. Farther off than the tolerance a point is not met; on a machine with errors the
// last one may be. Of a program that has missed its tolerance there are figures only: any point is met that
// lies near.
void MachineJudge::pass_end_of_cut(const Vertex& v) {
  const Target* end = path_.target();
  if (end == nullptr || end->rapid || !path_.hits(*ends_.previous, *end)) return;
  if (comes_from_stop(v)) return;
  if (record_.report.cuts_within_tolerance()) {
    const bool is_off = (ends_.previous->tip_P - end->tip_P).norm() > options().tolerance_mm;
    const bool is_last = ends_cut(path_.next());
    if (path_.limits().on_truth ? is_off && !is_last : is_off || !is_last) return;
  }
  record_.mark_programmed();
  hit_point(path_.next(), *ends_.previous);
  // And those that repeat it, however far rounding of the words is from them all.
  for (const Target* next = path_.target(); next != nullptr && !next->rapid; next = path_.target()) {
    if (!repeats(*next)) return;
    hit_point(path_.next(), *ends_.previous);
  }
}

// To above where it left to stop, which the CL file asks for before the next point: it cuts on.
bool MachineJudge::comes_from_stop(const Vertex& v) const {
  const MachineJudge& asks = sharing_.leader != nullptr ? *sharing_.leader : *this;
  return progress_.away && asks.progress_.stopped_away && asks.program_judge_ &&
         asks.program_judge_->stops_before(path_.next()) &&
         path_.is_above(v, path_.here(), path_.hit_tolerance_mm());
}

void MachineJudge::feed(Vertex& v) {
  if (v.in_cycle && drills(v)) return trail_.clear();
  pass_repeated_points(v);
  if ((v.from_unknown || comes_with_new_tool(v)) && arrives(v)) return;
  if (path_.target() == nullptr && !progress_.away) return feed_beyond_end(v);
  if (progress_.away && meter().takes_up(*ends_.previous, v, as_run_.state))
    return record_.end_block(v, path_.here().line, false);
  if (progress_.away ? comes_back(v) : leaves(v)) return trail_.clear();
  if (path_.target() == nullptr) return feed_beyond_end(v);
  if (v.from_unknown && program_judge_ && !may_begin_cut())
    program_judge_->find(CheckOf::path, v.nc_line, [&] {
      return "the tool comes down from the safe height where the CL file cuts: the way there is left out" +
             cl_line(path_.target()->line);
    });
  note_on_trail(v);
  const Place place = path_.find(meter().kinematics(), *ends_.previous, v);
  v.placed = true;
  if (program_judge_) program_judge_->cut(at(), place);
  const CutBlock block{*ends_.previous, v, place};
  if (changes_no_figure(block)) {
    move_on(v, place);
    return;
  }
  const bool kept = record_.report.cuts_within_tolerance();
  const bool back = goes_back(v, place);
  const bool passed_point = cut_judge().judge(block);
  const std::uint32_t line = points()[place.segment + 1].line;
  const bool programmed = move_on(v, place);
  if (v.off_chord_mm > 0.0F) record_.bows_by(v.off_chord_mm, points().longest_flute_mm() > 0.0);
  if (kept && (back || !record_.report.cuts_within_tolerance()) && match_anew(LastBlockIs::at_hand)) return;
  record_.end_cut(v, line, programmed || passed_point);
}

// All of it is held to the last point of the path, and to as much of the way there as points on both sides of
// it may go back: where the inner axis turns at its end the tip swings.
void MachineJudge::feed_beyond_end(const Vertex& v) {
  trail_.clear();
  const Target& last = points().back();
  Target before = last;
  if (points().size() > 1 && !last.rapid && last.way_mm > 0.0) {
    const Target& from = points()[points().size() - 2];
    const double t = std::max(0.0, 1.0 - back_limit_mm() / last.way_mm);
    before.tip_P = from.tip_P + t * (last.tip_P - from.tip_P);
    before.axis_P = slerp(from.axis_P, last.axis_P, t);
  }
  record_.take_deviation(meter().of(*ends_.previous, v, {before, last}, as_run_.state, {}), last.in_cone);
  record_.take_flute(meter().beside({*ends_.previous, v, 1.0, 1.0}, before, last, as_run_.state, {}), last,
                     v.nc_line, last.in_cone);
  record_.end_cut(v, last.line, false);
}

// What the CL file cuts to the next point is cut from the one before it: but for another tool, which comes
// from anywhere.
bool MachineJudge::may_begin_cut() const {
  return path_.target()->rapid || (at().t == 0.0 && ends_cut(at().segment));
}

// Straight down from where words of the part have let it stand.
bool MachineJudge::comes_with_new_tool(const Vertex& v) const {
  const Target* target = path_.target();
  if (!progress_.away || target == nullptr || target->rapid || !may_begin_cut()) return false;
  const Vec3 way = ends_.previous->tip_P - v.tip_P;
  return way.dot(v.axis_P) >= (1.0 - 1e-6) * way.norm();
}

bool MachineJudge::arrives(const Vertex& v) {
  const Target* target = path_.target();
  if (target == nullptr || !path_.hits(v, *target) || !may_begin_cut()) return false;
  progress_.away = false;
  if (program_judge_) program_judge_->comes_to(path_.next());
  if (program_judge_ && target->rapid) judge_feed_to(*target, v.nc_line);
  hit_point(path_.next(), v);
  record_.end_block(v, target->line, true);
  return true;
}

bool MachineJudge::move_on(const ToolPose& v, const Place& place) {
  if (place.t >= 1.0) {
    record_.point_hit(place.off_tip_mm);
    path_.go_to({place.segment + 1, 0.0, 0.0, place.off_tip_mm, place.off_axis});
    return true;
  }
  const Target& end = points()[place.segment + 1];
  const double to_end2 = (v.tip_P - end.tip_P).squaredNorm();
  const bool programmed =
      to_end2 < kSamePoint_mm * kSamePoint_mm && path_.distance_to(v, end) < kSamePoint_mm;
  path_.go_to(place);
  if (programmed) {
    const double to_end_mm = std::sqrt(to_end2);
    record_.point_hit(to_end_mm);
    path_.go_to({place.segment + 1, 0.0, 0.0, to_end_mm, (v.axis_P - end.axis_P).norm()});
  }
  return programmed;
}

bool MachineJudge::leaves(const Vertex& v) {
  const Vertex& from = *ends_.previous;
  const Vec3 way = v.tip_P - from.tip_P;
  const bool along_axis = way.dot(from.axis_P) > (1.0 - 1e-6) * way.norm();
  if (!along_axis || way.norm() < path_.hit_tolerance_mm() ||
      angle_between(v.axis_P, from.axis_P).rad() > kSameAxis_rad)
    return false;
  // A motion of the CL file itself.
  if (path_.find(meter().kinematics(), from, v).distance <= path_.hit_tolerance_mm()) return false;
  progress_.away = true;
  record_.end_block(v, path_.here().line, false);
  return true;
}

// Rounding of the words decides how far before or behind a CL point the tool is said to have left the path,
// and the axis of that place, far up the tool, is another than the point's: where a point is so near, it is
// the place. Not where the tip stands and the axis turns: there the axis tells the place.
Target MachineJudge::place_left() const {
  Target here = path_.here();
  const double rounding_mm = words_rounding_mm();
  const std::size_t next = at().segment + 1;
  if (next >= points().size() || points()[next].way_mm <= 2.0 * rounding_mm) return here;
  for (const std::size_t i : {next - 1, next}) {
    const Target& point = points()[i];
    if ((point.tip_P - here.tip_P).norm() <= rounding_mm)
      return {point.tip_P, point.axis_P, here.line, false};
  }
  return here;
}

bool MachineJudge::comes_back(const Vertex& v) {
  progress_.away = false;
  const Target place = place_left();
  const Vec3 way = ends_.previous->tip_P - v.tip_P;
  if (!path_.hits(v, place)) return false;
  // Where its way down is not known, the place before is the one that it left.
  const bool is_there = v.from_unknown && way.norm() <= path_.hit_tolerance_mm();
  if (!is_there && way.dot(v.axis_P) < (1.0 - 1e-6) * way.norm()) return false;
  // Inside the pole's cone the tool may have been tilted: it comes back along its own axis then, as it is
  // commanded. That the machine's errors turn it moves the tip nowhere.
  const bool in_cone = path_.limits().in_cone(place.axis_P);
  const Vec3 along_P = in_cone ? path::station(meter().kinematics(), v.q).axis_P : place.axis_P;
  const Target out{place.tip_P + way.norm() * along_P, place.axis_P, place.line, false};
  record_.take_deviation(meter().of(*ends_.previous, v, {out, place}, as_run_.state, record_.uninteresting()),
                         in_cone);
  record_.end_cut(v, place.line, at().t == 0.0);
  if (program_judge_ && path_.target() != nullptr) program_judge_->comes_back(path_.next(), at());
  return true;
}

bool MachineJudge::drills(const Vertex& v) {
  std::size_t end = path_.next();
  if (end >= points().size() || points()[end].step == cl::Motion::Step::none) {
    progress_.drilled_mm = 0.0;
    return false;
  }
  const bool leaves = points()[end].step == cl::Motion::Step::leaves;
  while (end < points().size() && points()[end].step != cl::Motion::Step::none) ++end;
  if (end == points().size()) return false;
  const Target& top = points()[at().segment];
  const Target& bottom = points()[end];
  const Vec3 down = (bottom.tip_P - top.tip_P).normalized();
  const double length_mm = (bottom.tip_P - top.tip_P).norm();
  // The first stroke of the CL file begins above the hole, where a control begins to count: only from the
  // third one on it shows how much the others may take.
  double first_step_mm = 0.0, next_step_mm = 0.0, before_mm = 0.0;
  std::size_t strokes = 0;
  for (std::size_t j = path_.next(); j <= end; ++j) {
    if (points()[j].rapid) continue;
    const double depth_mm = down.dot(points()[j].tip_P - top.tip_P);
    double& largest_mm = strokes++ == 0 ? first_step_mm : next_step_mm;
    largest_mm = std::max(largest_mm, depth_mm - before_mm);
    before_mm = depth_mm;
  }
  const bool is_first = progress_.drilled_mm == 0.0 || strokes < 3;
  const double deepest_step_mm = is_first ? std::max(first_step_mm, next_step_mm) : next_step_mm;
  const double depth_mm = down.dot(v.tip_P - top.tip_P);
  // Small steps may back above where the feed begins: out of the hole, along it.
  Target highest = top;
  highest.tip_P += std::min({0.0, depth_mm, down.dot(ends_.previous->tip_P - top.tip_P)}) * down;
  record_.take_deviation(meter().of(*ends_.previous, v, {highest, bottom}, as_run_.state, {}));
  const double too_deep_mm = depth_mm - progress_.drilled_mm - (v.rapid ? 0.0 : deepest_step_mm);
  if (too_deep_mm > 0.0) record_.take_deviation({{0.0, too_deep_mm}, {0.0, 0.0}});
  const double up_from_mm = down.dot(ends_.previous->tip_P - top.tip_P);
  if (program_judge_ && leaves && v.rapid && depth_mm < up_from_mm &&
      depth_mm > options().tolerance_mm + words_rounding_mm()) {
    program_judge_->find(CheckOf::rapids, v.nc_line, [&] {
      return "the tool stays " + fixed_text(depth_mm, 3) +
             " mm deep in the hole between two steps; the CL file takes it out, chips with it" +
             cl_line(bottom.line);
    });
  }
  if (!v.rapid) progress_.drilled_mm = std::max(progress_.drilled_mm, depth_mm);
  // What is left to a control's last step may be less than the tolerance.
  const bool reached = !v.rapid && v.to_bottom && depth_mm > length_mm - options().tolerance_mm;
  if (reached) {
    hit_point(end, v);
    progress_.drilled_mm = 0.0;
  }
  record_.end_cut(v, bottom.line, reached);
  if (program_judge_ && !v.rapid) program_judge_->drills_to(end);
  return true;
}

bool MachineJudge::changes_no_figure(const CutBlock& block) {
  const Vertex& v = block.to;
  if (!block.from.placed || v.off_chord_mm > 0.0F || !meter().may_bow(block.from, v)) return false;
  const KnownFigures known = record_.known_figures(points().longest_flute_mm());
  if (!(std::max(at().off_tip_mm, block.place.off_tip_mm) < known.tip_mm &&
        std::max(at().off_axis, block.place.off_axis) < known.axis_limit))
    return false;
  auto& bows = ends_.last.bows;
  bows = sharing_.same_block && sharing_.leader->ends_.last.bows
             ? sharing_.leader->ends_.last.bows
             : meter().certifier().bows_from_norms(block.from.station, v.station);
  return cut_judge().changes_no_figure(block, *bows, known);
}

double MachineJudge::back_limit_mm() const {
  constexpr double kTolerances = 3.0;  // points on both sides of the path
  constexpr double kDigits = 4.0;
  return kTolerances * options().tolerance_mm +
         kDigits * judged_.controller.numbers.axes.quantum(nc::AxisLetter::X);
}

bool MachineJudge::goes_back(const Vertex& v, const Place& place) {
  if (!program_judge_ || place.segment != at().segment) return false;
  const Target& end = points()[place.segment + 1];
  const double off_mm = back_mm(v, points()[place.segment], end, at().t);
  if (!(off_mm > back_limit_mm())) return false;
  program_judge_->find(CheckOf::order, v.nc_line, [&] {
    return "the tip goes back on its path by " + fixed_text(off_mm, 3) + " mm" + cl_line(end.line);
  });
  return true;
}

// --- the end ---

VerifyReport MachineJudge::finish(const WordFigures& words, std::uint32_t nc_line) {
  progress_.all_expected = true;
  work();
  settle_rapid_end();
  match_end_of_cut();
  const Target* next = progress_.started ? path_.target() : nullptr;
  if (next != nullptr &&
      combined_distance(*ends_.previous, next->tip_P, next->axis_P) <= near_point_mm(path_, record_.of_block))
    record_.mark_programmed();
  // CL points behind the last block were met if the tool stands there (a repeated point), else they are
  // missed.
  VerifyReport& report = record_.report;
  if (as_run_.feeds) as_run_.feeds->finish();
  for (std::size_t i = progress_.started ? path_.next() : 0; i < points().size(); ++i) {
    const Target& target = points()[i];
    const Angle allowed = options().axis_tolerance +
                          (path_.limits().in_cone(target.axis_P) ? options().pole.tolerance : Angle{});
    const double d = progress_.started ? (ends_.previous->tip_P - target.tip_P).norm()
                                       : std::numeric_limits<double>::infinity();
    if (d <= options().tolerance_mm && angle_between(ends_.previous->axis_P, target.axis_P) <= allowed) {
      record_.point_hit(d);
    } else {
      ++report.points_missed;
    }
  }
  report_travel();
  report.flute_mm = points().longest_flute_mm();
  static_cast<WordFigures&>(report) = words;
  if (program_judge_) program_judge_->finish(report, nc_line);
  return std::move(report);
}

}  // namespace trunnion::post
