#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <variant>

#include "trunnion/nc/reader.hpp"
#include "trunnion/post/plane_frame.hpp"
#include "trunnion/post/verify.hpp"

#include "post/deviation_meter.hpp"
#include "post/feed_plan.hpp"
#include "post/work_shift.hpp"

namespace trunnion::post {
namespace {

// A place on the CL path: segment `segment` runs from target `segment` to target `segment + 1`.
struct Place {
  std::size_t segment = 0;
  double t = 0.0;
  double distance = std::numeric_limits<double>::infinity();  // combined measure, mm
};

// How far along a-b a position is. Where the tip stands nearly still the tool axis tells.
double parameter_of(const Vertex& v, const Target& a, const Target& b) {
  const Vec3 d = b.tip_P - a.tip_P;
  const double turn = angle_between(a.axis_P, b.axis_P).rad();
  constexpr double kStill = 1e-3;  // of the turn's weight: then rounding of XYZ would decide
  if (d.norm() > kStill * kAxisWeight_mm * turn) {
    const double l2 = d.squaredNorm();
    return l2 > 0.0 ? std::clamp((v.tip_P - a.tip_P).dot(d) / l2, 0.0, 1.0) : 1.0;
  }
  return turn > 0.0 ? std::clamp(angle_between(a.axis_P, v.axis_P).rad() / turn, 0.0, 1.0) : 1.0;
}

// Two positions that differ by the rounding of words only.
constexpr double kSamePoint_mm = 5e-4;

// Far more CL points than one block of a thinned program passes.
constexpr std::size_t kLookAhead = 1024;

}  // namespace

bool VerifyReport::within_tolerance() const {
  // A hair for the rounding errors of the evaluation itself.
  constexpr double kRounding_mm = 1e-9;
  constexpr double kRounding_rad = 1e-12;
  return certified_tip_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_point_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_axis_deviation.rad() <= axis_tolerance.rad() + kRounding_rad &&
         max_pole_axis_deviation.rad() <= axis_tolerance.rad() + pole_tolerance.rad() + kRounding_rad &&
         (!rapid_tolerance_mm || max_rapid_deviation_mm <= *rapid_tolerance_mm + kRounding_mm);
}

struct Verifier::State {
  State(const Machine& m, const nc::Controller& c, const Vec3& tool, const VerifyOptions& o,
        std::string nc_file, Diagnostics& diagnostics)
      : machine(m),
        controller(c),
        tool_mm(tool),
        options(o),
        offsets(o.offsets != nullptr
                    ? std::optional<OffsetTracker>(std::in_place, *o.offsets, unlimited(o.offset_limits))
                    : std::nullopt),
        meter(m, tool, o.truth, offsets ? &*offsets : nullptr, o.certify, o.tolerance_mm, o.axis_tolerance),
        planner(m, c, FeedOutput::inverse),
        shift(m, c, tool),
        program(m.axes.size(), o.truth != nullptr ? o.truth->lags() : std::vector<LagRequest>{},
                o.temperatures),
        reader(
            c, std::move(nc_file), diagnostics, [this](const nc::Block& block) { take(block); },
            reader_options(o)) {
    report.tolerance_mm = o.tolerance_mm;
    report.axis_tolerance = o.axis_tolerance;
    report.pole_tolerance = o.pole.tolerance;
    report.rapid_tolerance_mm = o.rapid_tolerance_mm;
    report.on_truth = o.truth != nullptr || o.offsets != nullptr;
    report.certified = meter.proves();
    for (AxisId id = 0; id < m.axes.size(); ++id) {
      letters[id] = *nc::axis_letter(m.axes[id].name);
      needed = static_cast<std::uint16_t>(needed | nc::AxisWords::bit(letters[id]));
      if (m.axes[id].kind == AxisKind::linear)
        linear = static_cast<std::uint16_t>(linear | nc::AxisWords::bit(letters[id]));
    }
  }

  static nc::ReaderOptions reader_options(const VerifyOptions& o) {
    nc::ReaderOptions r;
    r.raw_lines = o.raw_lines;
    return r;
  }

  void take(const nc::Block& block) {
    if (const auto* motion = std::get_if<nc::Motion>(&block)) take(*motion);
    if (const auto* control = std::get_if<nc::TcpControl>(&block)) tcp = control->on;
    if (const auto* offset = std::get_if<nc::WorkOffset>(&block)) shift.read(*offset);
    if (const auto* offset = std::get_if<nc::OffsetShift>(&block)) shift.read(*offset);
    // What the machine does takes its turn among the motions, which may have to wait for theirs.
    if (const auto* comment = std::get_if<nc::Comment>(&block); comment != nullptr && offsets)
      waiting.emplace_back(*comment);
    if (const auto* dwell = std::get_if<nc::Dwell>(&block)) waiting.emplace_back(*dwell);
    if (const auto* spindle = std::get_if<nc::Spindle>(&block)) waiting.emplace_back(*spindle);
    if (const auto* tilted = std::get_if<nc::TiltedPlane>(&block)) take(*tilted);
  }

  void step(const nc::Comment& comment) { offsets->comment(comment.text); }
  void step(const nc::Dwell& dwell) {
    const double seconds = static_cast<double>(dwell.milliseconds) / 1000.0;
    program.wait(seconds);
    elapse(seconds);
  }
  void step(const nc::Spindle& spindle) { program.spindle(static_cast<double>(spindle.rpm)); }

  void take(const nc::Motion& motion) {
    ++report.points_out;
    const bool rapid = motion.kind == nc::MotionKind::rapid;
    ++(rapid ? report.rapid_blocks : report.feed_blocks);
    // Positions are not all known at the start of a program and after a retract to machine coordinates.
    JointVector words;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      words[id] = controller.numbers.axes.internal(letters[id], motion.words[letters[id]]);
      if (machine.axes[id].kind == AxisKind::rotary && motion.words.has(letters[id])) rotary[id] = words[id];
    }
    const std::uint16_t wanted = plane ? linear : needed;
    // In a tilted plane the control keeps the rotary axes: words for them leave it.
    const bool leaves_plane = plane && (motion.words.mask & needed & ~linear) != 0;
    if ((motion.words.mask & wanted) != wanted || leaves_plane) {
      from_unknown = true;
      return;
    }
    Vertex v;
    v.tcp = tcp && !plane;
    v.from_unknown = std::exchange(from_unknown, false);
    if (tcp && !plane) v.word_tip_P = tip_of(words);
    v.q = plane ? joints_of_plane_words(words)
                : shift.joints(tcp ? joints_of_part_words(words) : joints_of_words(machine, words, tool_mm),
                               tcp);
    v.nc_line = motion.source.line;
    v.feed_mode = motion.feed_mode;
    v.feed = motion.feed;
    v.rapid = rapid;
    waiting.emplace_back(v);
    work();
  }

  // The control turns its rotary axes until the tool stands along Z of the plane: the solution nearest to
  // where they stand.
  void take(const nc::TiltedPlane& block) {
    plane.reset();
    from_unknown = true;
    if (!block.on) return;
    plane = PlaneFrame::of(controller, block);
    const auto found = inverse(machine, {plane->X_PF.p, plane->X_PF.R.col(2)}, rotary);
    plane_q = found.empty() ? rotary : found[0].q;
  }
  JointVector joints_of_plane_words(const JointVector& words) const {
    JointVector q = plane_q;
    meter.kinematics().solve_linear(plane->X_PF * tip_of(words), meter.kinematics().sines(q), q);
    return q;
  }

  // Under tool-centre-point control X Y Z are the tip in P.
  Vec3 tip_of(const JointVector& words) const {
    Vec3 tip_P = Vec3::Zero();
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      if (machine.axes[id].kind == AxisKind::linear)
        tip_P[static_cast<Eigen::Index>(nc::index(letters[id]))] = words[id];
    }
    return tip_P;
  }
  JointVector joints_of_part_words(const JointVector& words) const {
    JointVector q = words;
    meter.kinematics().solve_linear(tip_of(words), meter.kinematics().sines(q), q);
    return q;
  }

  // A block can be judged when the CL motions are known up to well beyond it.
  void work() {
    while (!waiting.empty() && (all_expected || targets.size() > at.segment + kLookAhead)) {
      const auto next = std::move(waiting.front());
      waiting.pop_front();
      std::visit([this](const auto& what) { step(what); }, next);
    }
    if (at.segment > kLookAhead) {
      targets.erase(targets.begin(), targets.begin() + static_cast<std::ptrdiff_t>(at.segment));
      at.segment = 0;
    }
  }

  void step(Vertex v) {
    check_limits(v);
    meter.place(v, program.towards(v.q, v.q), program.lagged());
    if (have_previous) path_mm += (v.tip_P - previous.tip_P).norm();
    if (!started) {
      start(v);
    } else if (v.rapid) {
      rapid(v);
    } else {
      feed(v);
    }
    const double seconds = block_seconds(v);
    if (!report.blocks.empty()) report.blocks.back().seconds = seconds;
    program.move_to(v.q, seconds);
    elapse(seconds);
    previous = v;
    have_previous = true;
  }

  void elapse(double seconds) {
    report.duration_s += seconds;
    if (offsets) offsets->advance(seconds);
  }

  // Time of the block as the control runs it.
  double block_seconds(const Vertex& v) {
    if (!have_previous) return 0.0;
    if (v.rapid) return planner.rapid_seconds(previous.q, v.q);
    const bool under_tcp = v.tcp && previous.tcp;
    const auto way = under_tcp ? std::optional((v.word_tip_P - previous.word_tip_P).norm()) : std::nullopt;
    const double seconds = planner.seconds_of(previous.q, v.q, way, v.feed_mode, v.feed);
    // Where it came from is not known: neither is its speed.
    if (seconds > 0.0 && !v.from_unknown && v.tcp == previous.tcp) check_speed(v, seconds);
    return seconds;
  }

  void check_speed(const Vertex& v, double seconds) {
    const double needed_s =
        v.tcp ? planner.slowest_along_s([&](double t) { return meter.between(previous, v, t); })
              : planner.slowest_axis_s(previous.q, v.q);
    const double ratio = needed_s / seconds;
    report.max_speed_ratio = std::max(report.max_speed_ratio, ratio);
    constexpr double kRounding = 1e-6;  // of the evaluation itself
    if (ratio <= 1.0 + kRounding) return;
    ++report.too_fast_count;
    if (report.too_fast.size() >= options.worst_count) return;
    const std::size_t next = std::min(at.segment + 1, targets.size() - 1);
    report.too_fast.push_back({v.nc_line, targets.empty() ? 0 : targets[next].line,
                               machine.axes[planner.slowest_axis(previous.q, v.q)].name, ratio});
  }

  // How near a block must come to a CL point that is reached by a rapid to be that point; blocks on the way
  // may be anywhere. Above compensation and rounding, on a machine with errors above those; below the length
  // of rapids.
  double hit_tolerance() const {
    const double near_mm = report.on_truth ? 1.0 : 0.1;
    return options.tolerance_mm + near_mm;
  }

  void start(const Vertex& v) {
    if (targets.empty()) return;
    const Target& first = targets[0];
    // The program may first go to a safe height: the path begins where the first CL point is met.
    const bool met = distance_to(v, first.tip_P, first.axis_P) <= hit_tolerance() || !v.rapid;
    if (met) {
      started = true;
      point_hit((v.tip_P - first.tip_P).norm());
    }
    record(v, 0.0, 0.0, first.line, met);
  }

  void point_hit(double tip_mm) {
    report.max_point_deviation_mm = std::max(report.max_point_deviation_mm, tip_mm);
  }

  void rapid(const Vertex& v) {
    pass_repeated_points();
    pass_end_of_cut();
    const std::size_t next = at.segment + 1;
    const Target* target = next < targets.size() ? &targets[next] : nullptr;
    const bool met = target != nullptr && target->rapid &&
                     distance_to(v, target->tip_P, target->axis_P) <= hit_tolerance();
    if (met) {
      point_hit((v.tip_P - target->tip_P).norm());
      const auto d = meter.sampled(previous, v, targets[next - 1], *target, program);
      report.max_rapid_deviation_mm = std::max(report.max_rapid_deviation_mm, d.tip_mm.upper);
      at = {next, 0.0, 0.0};
    }
    record(v, 0.0, 0.0, target != nullptr ? target->line : 0, met);
  }

  // CL points at which the tool stands already ask for no block.
  void pass_repeated_points() {
    for (std::size_t next = at.segment + 1; next < targets.size(); ++next) {
      const double d = distance_to(previous, targets[next].tip_P, targets[next].axis_P);
      if (d > kSamePoint_mm) return;
      mark_programmed();
      point_hit((previous.tip_P - targets[next].tip_P).norm());
      at = {next, 0.0, 0.0};
    }
  }

  // A rapid begins where the cut ended: within rounding or the tolerance of the CL point there.
  void pass_end_of_cut() {
    const std::size_t next = at.segment + 1;
    if (next >= targets.size() || targets[next].rapid) return;
    const Target& end = targets[next];
    if (distance_to(previous, end.tip_P, end.axis_P) > hit_tolerance()) return;
    mark_programmed();
    point_hit((previous.tip_P - end.tip_P).norm());
    at = {next, 0.0, 0.0};
  }

  void feed(const Vertex& v) {
    pass_repeated_points();
    if (at.segment + 1 >= targets.size()) {  // beyond the end of the CL path: compared with its last point
      const Target& last = targets.back();
      take_deviation({{(v.tip_P - last.tip_P).norm(), (v.tip_P - last.tip_P).norm()},
                      {0.0, angle_between(v.axis_P, last.axis_P).rad()}});
      record_feed(v, last.line, false);
      return;
    }
    if (away ? comes_back(v) : leaves(v)) return;
    const Place place = find(v);
    Vertex from = previous;
    bool passed_point = false;  // the block ends at a CL point and a little beyond it
    for (std::size_t j = at.segment; j < place.segment; ++j) {  // CL points that the block passes
      const Vertex to = meter.nearest_between(from, v, targets[j + 1], program);
      point_hit((to.tip_P - targets[j + 1].tip_P).norm());
      take_deviation(meter.of(from, to, targets[j], targets[j + 1], program, uninteresting()),
                     near_pole(targets[j], targets[j + 1]));
      passed_point |= mark_nearer(v, targets[j + 1]);
      from = to;
    }
    const Target& end = targets[place.segment + 1];
    take_deviation(meter.of(from, v, targets[place.segment], end, program, uninteresting()),
                   near_pole(targets[place.segment], end));
    const bool programmed = place.t >= 1.0 || distance_to(v, end.tip_P, end.axis_P) < kSamePoint_mm;
    if (programmed) point_hit((v.tip_P - end.tip_P).norm());
    at = programmed ? Place{place.segment + 1, 0.0, 0.0} : place;
    record_feed(v, end.line, programmed || passed_point);
  }

  // A CL point that lies between the ends of a block belongs to the nearer end when that is as near as
  // compensation, tolerance or the machine's errors explain. True when it is the end `v`.
  bool mark_nearer(const Vertex& v, const Target& target) {
    const double near_mm = near_point_mm();
    const double before = distance_to(previous, target.tip_P, target.axis_P);
    const double after = distance_to(v, target.tip_P, target.axis_P);
    if (std::min(before, after) > near_mm) return false;
    if (before < after) mark_programmed();
    return after <= before;
  }
  double near_point_mm() const {
    constexpr double kAlong = 3.0;  // along the path a deviation may be larger than across it
    if (report.on_truth) return hit_tolerance();
    return kSamePoint_mm + kAlong * std::hypot(block_tip_mm, kAxisWeight_mm * block_axis_rad);
  }
  void mark_programmed() {
    if (options.collect && !report.blocks.empty()) report.blocks.back().programmed = true;
  }

  Target present() const {
    const Target& a = targets[at.segment];
    const Target& b = targets[std::min(at.segment + 1, targets.size() - 1)];
    return {a.tip_P + at.t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, at.t), b.line, false};
  }

  // The tool leaves the path along its axis, away from the part, to turn elsewhere (wind-up, limits).
  bool leaves(const Vertex& v) {
    const Vec3 way = v.tip_P - previous.tip_P;
    const bool along_axis = way.dot(previous.axis_P) > (1.0 - 1e-6) * way.norm();
    constexpr double kSameAxis_rad = 1e-5;  // the rounding of the angles
    if (!along_axis || way.norm() < hit_tolerance() ||
        angle_between(v.axis_P, previous.axis_P).rad() > kSameAxis_rad)
      return false;
    if (find(v).distance <= hit_tolerance()) return false;  // a motion of the CL file itself
    away = true;
    record(v, 0.0, 0.0, present().line, false);
    return true;
  }

  // Back along the tool axis to the place that was left. Whatever else a feed move does out there is judged
  // as a motion of the path.
  bool comes_back(const Vertex& v) {
    away = false;
    const Target place = present();
    const Vec3 way = previous.tip_P - v.tip_P;
    if (distance_to(v, place.tip_P, place.axis_P) > hit_tolerance()) return false;
    if (way.dot(v.axis_P) < (1.0 - 1e-6) * way.norm()) return false;
    const Target out{place.tip_P + way.norm() * place.axis_P, place.axis_P, place.line, false};
    take_deviation(meter.of(previous, v, out, place, program, uninteresting()));
    record_feed(v, place.line, at.t == 0.0);
    return true;
  }

  // Place on the CL path where the block ends: the nearest one ahead, no farther along the path than the
  // block can have come.
  Place find(const Vertex& v) const {
    // Nearly every block of a dense path ends at the next CL point.
    const Target& next = targets[at.segment + 1];
    const double to_next = distance_to(v, next.tip_P, next.axis_P);
    if (to_next < kSamePoint_mm) return {at.segment, 1.0, to_next};
    const double reach_mm = 1.1 * (v.tip_P - previous.tip_P).norm() + 4.0 * options.tolerance_mm;
    const double reach_rad =
        1.1 * angle_between(v.axis_P, previous.axis_P).rad() + 4.0 * options.axis_tolerance.rad();
    Place best;
    best.segment = at.segment;
    double ahead_mm = 0.0;
    double ahead_rad = 0.0;
    for (std::size_t j = at.segment; j + 1 < targets.size() && j < at.segment + kLookAhead; ++j) {
      const Target& a = targets[j];
      const Target& b = targets[j + 1];
      if (j > at.segment && b.rapid) break;
      double t = parameter_of(v, a, b);
      if (j == at.segment) t = std::max(t, at.t);
      const double d = distance_to(v, a.tip_P + t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, t));
      // A later place must be nearer by more than rounding, else the first one is it.
      if (d < best.distance - 1e-7) best = {j, t, d};
      const double rest = j == at.segment ? 1.0 - at.t : 1.0;
      ahead_mm += rest * (b.tip_P - a.tip_P).norm();
      ahead_rad += rest * angle_between(a.axis_P, b.axis_P).rad();
      if (ahead_mm > reach_mm || ahead_rad > reach_rad) break;
    }
    return best;
  }

  // Deviations that change no figure of the report: below the last of the worst places, and below the largest
  // of the axis.
  DeviationMeter::Deviation uninteresting() const {
    if (options.collect || report.worst.size() < options.worst_count) return {};
    return {{0.0, report.worst.back().tip_mm}, {0.0, report.max_axis_deviation.rad()}};
  }

  // Between these two the tool axis may be off by the pole's tolerance more.
  bool near_pole(const Target& a, const Target& b) const { return in_cone(a.axis_P) || in_cone(b.axis_P); }
  bool in_cone(const Vec3& axis_P) const {
    if (options.pole.tolerance.rad() <= 0.0 || meter.kinematics().rotary_count() < 2) return false;
    const double cosine = std::abs(meter.kinematics().direction(1).dot(axis_P));
    return cosine >= std::cos(options.pole.cone.rad());
  }
  // Combined measure of how far `v` is from a place of the path; what the pole allows is no distance.
  double distance_to(const Vertex& v, const Vec3& tip_P, const Vec3& axis_P) const {
    if (!in_cone(axis_P)) return combined_distance(v, tip_P, axis_P);
    const double angle = angle_between(v.axis_P, axis_P).rad() - options.pole.tolerance.rad();
    return std::hypot((v.tip_P - tip_P).norm(), kAxisWeight_mm * std::max(0.0, angle));
  }

  void take_deviation(const DeviationMeter::Deviation& d, bool in_cone = false) {
    block_proved = block_proved && d.proved;
    if (d.unbounded != nullptr) {
      auto& ids = report.unproved_effects;
      const std::string& id = d.unbounded->info().id;
      if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
    }
    block_tip_mm = std::max(block_tip_mm, d.tip_mm.upper);
    block_axis_rad = std::max(block_axis_rad, d.axis_rad.upper);
    report.max_tip_deviation_mm = std::max(report.max_tip_deviation_mm, d.tip_mm.lower);
    report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, d.tip_mm.upper);
    Angle& largest = in_cone ? report.max_pole_axis_deviation : report.max_axis_deviation;
    largest = std::max(largest, Angle::radians(d.axis_rad.upper));
  }

  void record_feed(const Vertex& v, std::uint32_t cl_line, bool programmed) {
    auto& worst = report.worst;
    if (worst.size() < options.worst_count || (!worst.empty() && block_tip_mm > worst.back().tip_mm)) {
      const WorstPlace place{v.nc_line, cl_line, block_tip_mm, Angle::radians(block_axis_rad), v.tip_P};
      const auto by_tip = [](const WorstPlace& x, const WorstPlace& y) { return x.tip_mm > y.tip_mm; };
      worst.insert(std::upper_bound(worst.begin(), worst.end(), place, by_tip), place);
      if (worst.size() > options.worst_count) worst.pop_back();
    }
    record(v, block_tip_mm, block_axis_rad, cl_line, programmed);
    if (!block_proved) {
      ++report.sampled_blocks;
      report.certified = false;
    }
    block_proved = true;
    block_tip_mm = 0.0;
    block_axis_rad = 0.0;
  }

  void record(const Vertex& v, double tip_mm, double axis_rad, std::uint32_t cl_line, bool programmed) {
    if (!options.collect) return;
    report.blocks.push_back({v.q, v.tip_P, static_cast<float>(tip_mm), static_cast<float>(axis_rad), path_mm,
                             0.0, v.nc_line, cl_line, v.rapid, programmed, block_proved});
  }

  void check_limits(const Vertex& v) {
    for (const LimitViolation& violation : limit_violations(machine, v.q)) {
      // Half a quantum beyond is the rounding of a position at the limit.
      if (violation.by <= 0.5 * controller.numbers.axes.quantum(letters[violation.axis]) + 1e-12) continue;
      ++report.beyond_limits_count;
      if (report.beyond_limits.size() >= options.worst_count) continue;
      const std::size_t next = std::min(at.segment + 1, targets.size() - 1);
      report.beyond_limits.push_back({v.nc_line, targets.empty() ? 0 : targets[next].line,
                                      machine.axes[violation.axis].name, violation.value, violation.by});
    }
  }

  const Machine& machine;
  const nc::Controller& controller;
  Vec3 tool_mm;
  VerifyOptions options;
  std::optional<OffsetTracker> offsets;
  DeviationMeter meter;
  FeedPlanner planner;
  WorkShift shift;
  ProgramState program;
  std::array<nc::AxisLetter, kMaxAxes> letters{};
  std::uint16_t needed = 0;
  std::uint16_t linear = 0;  // of those
  bool tcp = false;
  std::optional<PlaneFrame> plane;
  JointVector rotary;         // as the last words had them
  JointVector plane_q;        // where the control has the rotary axes in the plane
  bool from_unknown = false;  // a motion of which not all positions were known was left out

  std::vector<Target> targets;
  Place at;
  bool started = false;
  bool all_expected = false;
  bool away = false;  // the tool has left the path along its axis
  std::deque<std::variant<Vertex, nc::Comment, nc::Dwell, nc::Spindle>> waiting;
  Vertex previous;
  bool have_previous = false;
  double path_mm = 0.0;
  double block_tip_mm = 0.0;
  double block_axis_rad = 0.0;
  bool block_proved = true;
  VerifyReport report;
  nc::Reader reader;
};

Verifier::Verifier(const Machine& machine, const nc::Controller& controller, const Vec3& tool_mm,
                   const VerifyOptions& options, std::string nc_file, Diagnostics& diagnostics)
    : state_(
          std::make_unique<State>(machine, controller, tool_mm, options, std::move(nc_file), diagnostics)) {}
Verifier::~Verifier() = default;

void Verifier::expect(const cl::Motion& motion, SourceRef where) {
  ++state_->report.points_in;
  state_->targets.push_back({motion.tip_P, motion.axis_P, where.line, motion.rapid});
}

void Verifier::text(std::string_view piece) {
  state_->reader.feed(piece);
}

Result<VerifyReport> Verifier::finish() {
  State& s = *state_;
  if (auto read = s.reader.finish(); !read) return tl::unexpected(read.error());
  s.all_expected = true;
  s.work();
  if (s.started && s.at.segment + 1 < s.targets.size()) {
    const Target& next = s.targets[s.at.segment + 1];
    if (combined_distance(s.previous, next.tip_P, next.axis_P) <= s.near_point_mm()) s.mark_programmed();
  }
  // CL points behind the last block were met if the tool stands there (a repeated point), else they are
  // missed.
  for (std::size_t i = s.started ? s.at.segment + 1 : 0; i < s.targets.size(); ++i) {
    const Target& target = s.targets[i];
    const Angle allowed =
        s.options.axis_tolerance + (s.in_cone(target.axis_P) ? s.options.pole.tolerance : Angle{});
    const double d =
        s.started ? (s.previous.tip_P - target.tip_P).norm() : std::numeric_limits<double>::infinity();
    if (d <= s.options.tolerance_mm && angle_between(s.previous.axis_P, target.axis_P) <= allowed) {
      s.point_hit(d);
    } else {
      ++s.report.points_missed;
    }
  }
  return std::move(s.report);
}

Result<VerifyReport> verify(std::unique_ptr<cl::TextSource> cl, const std::string& cl_file,
                            std::unique_ptr<cl::TextSource> nc, const std::string& nc_file,
                            const Machine& machine, const nc::Controller& controller,
                            const cl::ReaderOptions& reading, const VerifyOptions& options,
                            Diagnostics& diagnostics) {
  Verifier verifier(machine, controller, machine.tool_vector(), options, nc_file, diagnostics);
  const std::size_t errors = diagnostics.error_count();
  cl::Reader reader(std::move(cl), cl_file, reading, diagnostics);
  cl::Record record;
  while (reader.next(record)) {
    if (const auto* motion = std::get_if<cl::Motion>(&record.data)) verifier.expect(*motion, record.where);
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const auto size = nc->read(buffer.data(), buffer.size());
    if (!size) return tl::unexpected(size.error());
    if (*size == 0) break;
    verifier.text({buffer.data(), *size});
  }
  return verifier.finish();
}

}  // namespace trunnion::post
