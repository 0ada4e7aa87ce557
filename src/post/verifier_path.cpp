// How the program read back is followed along the CL path.
#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"

#include "post/verifier_state.hpp"

namespace trunnion::post {
namespace {

// Goes along the chord of a block, to the feet of the CL points that it passes.
struct Foot {
  Foot(const ToolPose& a, const ToolPose& b)
      : from(a), way(b.tip_P - a.tip_P), turn(b.axis_P - a.axis_P), length2(way.squaredNorm()) {}
  void go_to(const Target& corner) {
    t = length2 > 0.0 ? std::clamp((corner.tip_P - from.tip_P).dot(way) / length2, t, 1.0) : 1.0;
  }
  Vec3 tip_P() const { return from.tip_P + t * way; }
  Vec3 axis_P() const { return from.axis_P + t * turn; }

  const ToolPose& from;
  Vec3 way, turn;
  double length2;
  double t = 0.0;
};

}  // namespace

double Verifier::State::hit_tolerance() const {
  const double near_mm = report.on_truth ? 1.0 : 0.1;
  return options.tolerance_mm + near_mm;
}

void Verifier::State::start(const Vertex& v) {
  if (targets().empty()) return;
  const Target& first = targets()[0];
  // The program may first go to a safe height: the path begins where the first CL point is met.
  const bool met = distance_to(v, first.tip_P, first.axis_P) <= hit_tolerance() || !v.rapid;
  if (met) {
    progress.started = true;
    point_hit((v.tip_P - first.tip_P).norm());
    if (program_judge && v.rapid) program_judge->rapid_to(0, v.nc_line);
    if (program_judge && !v.rapid) program_judge->comes_to(0);
    if (program_judge && first.rapid && !v.rapid) judge_feed_to(first, v.nc_line);
  } else if (program_judge && !v.up && !is_above(v, first, -hit_tolerance())) {
    program_judge->find(CheckOf::rapids, v.nc_line, [] {
      return std::string("a rapid below the safe height to elsewhere than above the first CL point");
    });
  }
  record(v, 0.0, 0.0, first.line, met);
}

void Verifier::State::point_hit(double tip_mm) {
  report.max_point_deviation_mm = std::max(report.max_point_deviation_mm, tip_mm);
}

void Verifier::State::rapid(const Vertex& v) {
  if (v.in_cycle && steps(v)) return;
  pass_repeated_points();
  pass_end_of_cut();
  match_end_of_cut();
  trail.clear();
  if (comes_nearer(v)) return;
  settle_rapid_end();
  const std::size_t next = at.segment + 1;
  const Target* target = next < targets().size() ? &targets()[next] : nullptr;
  const bool met =
      target != nullptr && target->rapid && distance_to(v, target->tip_P, target->axis_P) <= hit_tolerance();
  if (met) {
    progress.rapid_end = PathProgress::RapidEnd{*target, (v.tip_P - target->tip_P).norm(),
                                                distance_to(v, target->tip_P, target->axis_P)};
    progress.away = false;
  }
  // On the way over the safe height there is no line to keep to.
  if (target != nullptr && target->rapid && !v.from_unknown && !progress.away) {
    const double off_mm =
        meter().sampled(*previous, v, targets()[next - 1], *target, as_run.state).tip_mm.upper;
    if (off_mm > report.max_rapid_deviation_mm) report.worst_rapid = {v.nc_line, target->line};
    report.max_rapid_deviation_mm = std::max(report.max_rapid_deviation_mm, off_mm);
  }
  if (program_judge && met) program_judge->rapid_to(next, v.nc_line);
  if (program_judge && !met) judge_rapid(v);
  if (met) at = {next, 0.0, 0.0};
  record(v, 0.0, 0.0, target != nullptr ? target->line : 0, met);
}

void Verifier::State::judge_rapid(const Vertex& v) {
  const std::size_t next = at.segment + 1;
  const Target* target = next < targets().size() ? &targets()[next] : nullptr;
  const bool is_outside = progress.away || v.from_unknown;
  if (v.up || turns_in_place(v)) return;
  // Held to its line.
  if (target != nullptr && target->rapid && !is_outside) return;
  const double near_mm = hit_tolerance();
  if (is_outside && target != nullptr && target->rapid && is_above(v, *target, -near_mm)) return;
  const bool may_be_above = is_outside || target == nullptr || target->rapid;
  if (may_be_above && is_above(v, place_of_path(), target != nullptr ? near_mm : -near_mm)) return;
  // A cut may begin behind a tool change: above where it does.
  if (is_outside && target != nullptr && is_above(v, *target, near_mm)) return;
  program_judge->find(CheckOf::rapids, v.nc_line, [&] {
    return std::string(is_outside || target == nullptr
                           ? "a rapid below the safe height that the CL file does not ask for"
                           : "a rapid where the CL file cuts") +
           (target != nullptr ? " (CL line " + std::to_string(target->line) + ")" : "");
  });
}

void Verifier::State::judge_feed_to(const Target& target, std::uint32_t nc_line) {
  program_judge->find(CheckOf::rapids, nc_line, [&] {
    return "a feed where the CL file has a rapid (CL line " + std::to_string(target.line) + ")";
  });
}

bool Verifier::State::is_above(const ToolPose& v, const Target& target, double least_mm) const {
  const Angle allowed = options.axis_tolerance + (in_cone(target.axis_P) ? options.pole.tolerance : Angle{});
  const double angle = turn_between(v.axis_P, target.axis_P);
  if (angle > allowed.rad()) return false;
  const Vec3 d = v.tip_P - target.tip_P;
  const double along_mm = d.dot(target.axis_P);
  const double beside_mm = (d - along_mm * target.axis_P).norm();
  return along_mm >= least_mm && beside_mm <= hit_tolerance() + std::abs(along_mm) * allowed.rad();
}

bool Verifier::State::turns_in_place(const Vertex& v) const {
  constexpr double kDigits = 4.0;
  return (v.station.tip_P - previous->station.tip_P).norm() <=
         kDigits * controller.numbers.axes.quantum(nc::AxisLetter::X);
}

bool Verifier::State::comes_nearer(const Vertex& v) {
  if (!progress.rapid_end || at.t != 0.0 || targets()[at.segment].tip_P != progress.rapid_end->target.tip_P)
    return false;
  const Target& end = progress.rapid_end->target;
  const double distance = distance_to(v, end.tip_P, end.axis_P);
  if (distance >= progress.rapid_end->distance) return false;
  progress.rapid_end->distance = distance;
  progress.rapid_end->tip_mm = (v.tip_P - end.tip_P).norm();
  record(v, 0.0, 0.0, end.line, true);
  return true;
}

void Verifier::State::settle_rapid_end() {
  if (progress.rapid_end) point_hit(progress.rapid_end->tip_mm);
  progress.rapid_end.reset();
}

void Verifier::State::pass_repeated_points() {
  for (std::size_t next = at.segment + 1; next < targets().size(); ++next) {
    if ((previous->tip_P - targets()[next].tip_P).squaredNorm() > kSamePoint_mm * kSamePoint_mm) return;
    const double d = distance_to(*previous, targets()[next].tip_P, targets()[next].axis_P);
    if (d > kSamePoint_mm) return;
    mark_programmed();
    point_hit((previous->tip_P - targets()[next].tip_P).norm());
    at = {next, 0.0, 0.0};
  }
}

void Verifier::State::pass_end_of_cut() {
  const std::size_t next = at.segment + 1;
  if (next >= targets().size() || targets()[next].rapid) return;
  const Target& end = targets()[next];
  if (distance_to(*previous, end.tip_P, end.axis_P) > hit_tolerance()) return;
  mark_programmed();
  point_hit((previous->tip_P - end.tip_P).norm());
  at = {next, 0.0, 0.0};
}

void Verifier::State::feed(Vertex& v) {
  if (v.in_cycle && steps(v)) return trail.clear();
  pass_repeated_points();
  if (v.from_unknown && arrives(v)) return;
  if (at.segment + 1 >=
      targets().size()) {  // beyond the end of the CL path: all of it is held to its last point
    trail.clear();
    const Target& last = targets().back();
    take_deviation(meter().of(*previous, v, last, last, as_run.state, {}), near_pole(last, last));
    take_flute(meter().beside(*previous, v, last, last, 0.0, 0.0, as_run.state, {}), last);
    record_feed(v, last.line, false);
    return;
  }
  if (progress.away && meter().takes_up(*previous, v, as_run.state))
    return record(v, 0.0, 0.0, place_of_path().line, false);
  if (progress.away ? comes_back(v) : leaves(v)) return trail.clear();
  note_on_trail(v);
  const Place place = find(*previous, v);
  v.placed = true;
  if (program_judge) program_judge->cut(at, place);
  if (changes_no_figure(v, place)) {
    move_on(v, place);
    return;
  }
  const bool kept = report.cuts_within_tolerance();
  const bool back = goes_back(v, place);
  const bool passed_point = judge(v, place);
  const std::uint32_t line = targets()[place.segment + 1].line;
  const bool programmed = move_on(v, place);
  if (v.off_chord_mm > 0.0F) bows_by(v.off_chord_mm);
  if (kept && (back || !report.cuts_within_tolerance()) && match_anew()) return;
  record_feed(v, line, programmed || passed_point);
}

// From the safe height down to the next CL point.
bool Verifier::State::arrives(const Vertex& v) {
  const std::size_t next = at.segment + 1;
  if (next >= targets().size()) return false;
  const Target& target = targets()[next];
  if (distance_to(v, target.tip_P, target.axis_P) > hit_tolerance()) return false;
  progress.away = false;
  point_hit((v.tip_P - target.tip_P).norm());
  if (program_judge) program_judge->comes_to(next);
  if (program_judge && target.rapid) judge_feed_to(target, v.nc_line);
  at = {next, 0.0, 0.0};
  record(v, 0.0, 0.0, target.line, true);
  return true;
}

bool Verifier::State::move_on(const ToolPose& v, const Place& place) {
  if (place.t >= 1.0) {
    point_hit(place.off_tip_mm);
    at = {place.segment + 1, 0.0, 0.0, place.off_tip_mm, place.off_axis};
    return true;
  }
  const Target& end = targets()[place.segment + 1];
  const double to_end2 = (v.tip_P - end.tip_P).squaredNorm();
  const bool programmed =
      to_end2 < kSamePoint_mm * kSamePoint_mm && distance_to(v, end.tip_P, end.axis_P) < kSamePoint_mm;
  at = place;
  if (programmed) {
    const double to_end_mm = std::sqrt(to_end2);
    point_hit(to_end_mm);
    at = {place.segment + 1, 0.0, 0.0, to_end_mm, (v.axis_P - end.axis_P).norm()};
  }
  return programmed;
}

KnownFigures Verifier::State::known_figures() const {
  const DeviationMeter::Deviation known = uninteresting();
  // Differences that Certifier::axis does not tell: where the tool axis stands, all blocks miss it alike.
  constexpr double kSameAxis = 1e-9;
  const double axis = path::sine_at_least(known.axis_rad.upper);
  return {known.tip_mm.upper, axis,
          std::min(axis + kSameAxis, std::max(axis, path::sine_at_least(options.axis_tolerance.rad()))),
          targets().longest_flute_mm(), report.certified_flute_deviation_mm};
}

bool Verifier::State::changes_no_figure(const Vertex& v, const Place& place) {
  if (!previous->placed || v.off_chord_mm > 0.0F || !meter().may_bow(*previous, v)) return false;
  const KnownFigures known = known_figures();
  if (!(std::max(at.off_tip_mm, place.off_tip_mm) < known.tip_mm &&
        std::max(at.off_axis, place.off_axis) < known.axis_limit))
    return false;
  last_block.bows = shared.same_block && shared.leader->last_block.bows
                        ? shared.leader->last_block.bows
                        : meter().certifier().bows_from_norms(previous->station, v.station);
  const auto bow = meter().bow_at_most(*previous, v, *last_block.bows);
  if (!bow) return false;
  double axis = 0.0;
  const Quiet quiet = is_quiet(*previous, v, place, *bow, known, axis);
  return proves_quiet(quiet, v, place, known, axis);
}

bool Verifier::State::proves_quiet(Quiet quiet, const Vertex& v, const Place& place,
                                   const KnownFigures& known, double axis) {
  if (!quiet.may_be || (!quiet.tip_keeps && !keeps_tip(v, place, known.tip_mm))) return false;
  if (!quiet.axis_keeps) {  // then it is below what was judged already
    if (!meter().keeps_axis(*previous, v, targets()[place.segment], targets()[place.segment + 1],
                            uninteresting().axis_rad.upper))
      return false;
    take_beside(*previous, v, place.segment, at.t, place.t);
    return true;
  }
  note_axis(axis, quiet.axis_at_tip, known);
  return true;
}

void Verifier::State::note_axis(double axis, double at_tip, const KnownFigures& known) {
  if (axis > known.axis)
    report.max_axis_deviation = std::max(report.max_axis_deviation, Angle::radians(std::asin(axis)));
  report.max_axis_deviation_at_tip =
      std::max(report.max_axis_deviation_at_tip, Angle::radians(std::asin(std::min(1.0, at_tip))));
}

// The block is within its bow of the chord between its ends, and that, cut at the feet of the CL points that
// it passes, is no farther from each (convex) piece of the path than where it is cut: no place on the way is
// evaluated.
Verifier::State::Quiet Verifier::State::is_quiet(const ToolPose& from, const ToolPose& v, const Place& place,
                                                 const path::Certifier::Bows& bow, const KnownFigures& known,
                                                 double& axis) const {
  double tip_mm = std::max(at.off_tip_mm, place.off_tip_mm);
  axis = std::max(at.off_axis, place.off_axis);
  if (!(tip_mm < known.tip_mm && axis < known.axis_limit)) return {};
  // Figures of the pole's cone are others; between opposite axes there is no arc.
  for (std::size_t j = at.segment; j <= place.segment; ++j) {
    if (near_pole(targets()[j], targets()[j + 1]) || targets()[j + 1].turn > 0.5 * kPi) return {};
  }
  bool surely = true;
  if (place.segment > at.segment) {
    Foot foot(from, v);
    for (std::size_t j = at.segment; j < place.segment; ++j) {
      const Target& corner = targets()[j + 1];
      foot.go_to(corner);
      const double off_mm = (foot.tip_P() - corner.tip_P).norm();
      surely = surely && off_mm + bow.tip_mm <= report.max_point_deviation_mm;
      tip_mm = std::max(tip_mm, off_mm);
      axis = std::max(axis, (foot.axis_P() - corner.axis_P).norm());
    }
  }
  const double chord2 = (v.axis_P - from.axis_P).squaredNorm();
  const double more = path_bow(chord2, axis);
  axis = axis * arc_beyond_chord(chord2) + bow.axis;
  const double at_tip = axis + more;
  if (known.flute_mm > 0.0 && tip_mm + bow.tip_mm + known.flute_mm * at_tip > known.flute_limit_mm) return {};
  const bool axis_keeps = axis <= known.axis_limit;
  // A block that passes CL points is not looked at once more.
  return {axis_keeps || place.segment == at.segment, surely && tip_mm + bow.tip_mm <= known.tip_mm,
          axis_keeps, at_tip};
}

Verifier::State::Quiet Verifier::State::is_quiet(const ToolPose& from, const ToolPose& v,
                                                 const path::Certifier::Bows& bow, const KnownFigures& known,
                                                 Place& place, double& axis) const {
  // A CL point at which the tool stands.
  if ((from.tip_P - targets()[at.segment + 1].tip_P).squaredNorm() <= kSamePoint_mm * kSamePoint_mm)
    return {};
  // What may be a way out along the tool axis.
  const Vec3 way = v.tip_P - from.tip_P;
  const double out = way.dot(from.axis_P);
  if (out > 0.0 && out * out > kAlong2 * way.squaredNorm()) return {};
  const auto near = find_near(from, v);
  if (!near) return {};
  place = *near;
  return is_quiet(from, v, place, bow, known, axis);
}

// The same cuts, with the tip's curve on each side of them.
bool Verifier::State::keeps_tip(const Vertex& v, const Place& place, double limit_mm) const {
  constexpr std::size_t kMostCuts = 2;
  if (place.segment - at.segment > kMostCuts) return false;
  std::array<Vertex, kMostCuts>& cuts = cut_at;
  const Vertex* from = previous;
  Foot foot(*previous, v);
  for (std::size_t j = at.segment; j < place.segment; ++j) {
    foot.go_to(targets()[j + 1]);
    Vertex& cut = cuts[j - at.segment];
    cut.q = JointVector::interpolate(previous->q, v.q, foot.t);
    meter().place(cut, v.q, as_run.state);
    if ((cut.tip_P - targets()[j + 1].tip_P).norm() > report.max_point_deviation_mm ||
        !meter().keeps_tip(*from, cut, targets()[j], targets()[j + 1], limit_mm))
      return false;
    from = &cut;
  }
  return meter().keeps_tip(*from, v, targets()[place.segment], targets()[place.segment + 1], limit_mm);
}

bool Verifier::State::judge(const Vertex& v, const Place& place) {
  const Vertex* from = previous;
  std::optional<Vertex> passed;
  // What a block is off its chord comes on top: then the figure itself is needed.
  const DeviationMeter::Deviation known =
      v.off_chord_mm > 0.0F ? DeviationMeter::Deviation{} : uninteresting();
  bool passed_point = false;  // the block ends at a CL point and a little beyond it
  for (std::size_t j = at.segment; j < place.segment; ++j) {  // CL points that the block passes
    const Vertex to = meter().nearest_between(*from, v, targets()[j + 1], as_run.state);
    point_hit((to.tip_P - targets()[j + 1].tip_P).norm());
    take_deviation(meter().of(*from, to, targets()[j], targets()[j + 1], as_run.state, known),
                   near_pole(targets()[j], targets()[j + 1]));
    take_beside(*from, to, j, j == at.segment ? at.t : 0.0, 1.0);
    passed_point |= options.collect && mark_nearer(v, targets()[j + 1]);
    passed = to;
    from = &*passed;
  }
  const Target& end = targets()[place.segment + 1];
  take_deviation(meter().of(*from, v, targets()[place.segment], end, as_run.state, known),
                 near_pole(targets()[place.segment], end));
  take_beside(*from, v, place.segment, place.segment == at.segment ? at.t : 0.0, place.t);
  return passed_point;
}

double Verifier::State::back_limit_mm() const {
  constexpr double kTolerances = 3.0;  // points on both sides of the path
  constexpr double kDigits = 4.0;
  return kTolerances * options.tolerance_mm + kDigits * controller.numbers.axes.quantum(nc::AxisLetter::X);
}

bool Verifier::State::goes_back(const Vertex& v, const Place& place) {
  if (!program_judge || place.segment != at.segment) return false;
  const double off_mm = back_mm(v, targets()[place.segment], targets()[place.segment + 1], at.t);
  if (!(off_mm > back_limit_mm())) return false;
  program_judge->find(CheckOf::order, v.nc_line, [&] {
    return "the tip goes back on its path by " + fixed_text(off_mm, 3) + " mm (CL line " +
           std::to_string(targets()[place.segment + 1].line) + ")";
  });
  return true;
}

bool Verifier::State::mark_nearer(const Vertex& v, const Target& target) {
  const double near_mm = near_point_mm();
  const double before = distance_to(*previous, target.tip_P, target.axis_P);
  const double after = distance_to(v, target.tip_P, target.axis_P);
  if (std::min(before, after) > near_mm) return false;
  if (before < after) mark_programmed();
  return after <= before;
}

double Verifier::State::near_point_mm() const {
  constexpr double kAlong = 3.0;  // along the path a deviation may be larger than across it
  if (report.on_truth) return hit_tolerance();
  return kSamePoint_mm + kAlong * std::hypot(of_block.tip_mm, kAxisWeight_mm * of_block.axis_rad);
}

void Verifier::State::mark_programmed() {
  if (options.collect && !report.blocks.empty()) report.blocks.back().programmed = true;
}

Target Verifier::State::place_of_path() const {
  const Target& a = targets()[at.segment];
  const Target& b = targets()[std::min(at.segment + 1, targets().size() - 1)];
  return {a.tip_P + at.t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, at.t), b.line, false};
}

bool Verifier::State::leaves(const Vertex& v) {
  const Vec3 way = v.tip_P - previous->tip_P;
  const bool along_axis = way.dot(previous->axis_P) > (1.0 - 1e-6) * way.norm();
  constexpr double kSameAxis_rad = 1e-5;  // the rounding of the angles
  if (!along_axis || way.norm() < hit_tolerance() ||
      angle_between(v.axis_P, previous->axis_P).rad() > kSameAxis_rad)
    return false;
  if (find(*previous, v).distance <= hit_tolerance()) return false;  // a motion of the CL file itself
  progress.away = true;
  record(v, 0.0, 0.0, place_of_path().line, false);
  return true;
}

bool Verifier::State::comes_back(const Vertex& v) {
  progress.away = false;
  const Target place = place_of_path();
  const Vec3 way = previous->tip_P - v.tip_P;
  if (distance_to(v, place.tip_P, place.axis_P) > hit_tolerance()) return false;
  if (way.dot(v.axis_P) < (1.0 - 1e-6) * way.norm()) return false;
  // Inside the pole's cone the tool may have been tilted: it comes back along its own axis then, as it is
  // commanded. That the machine's errors turn it moves the tip nowhere.
  const bool in_cone = this->in_cone(place.axis_P);
  const Vec3 along_P = in_cone ? path::station(meter().kinematics(), v.q).axis_P : place.axis_P;
  const Target out{place.tip_P + way.norm() * along_P, place.axis_P, place.line, false};
  take_deviation(meter().of(*previous, v, out, place, as_run.state, uninteresting()), in_cone);
  record_feed(v, place.line, at.t == 0.0);
  if (program_judge && at.segment + 1 < targets().size()) program_judge->comes_to(at.segment + 1);
  return true;
}

DeviationMeter::Deviation Verifier::State::uninteresting() const {
  if (options.collect || report.worst.size() < options.worst_count || report.worst.empty()) return {};
  return {{0.0, report.worst.back().tip_mm}, {0.0, judged_axis_rad}};
}

bool Verifier::State::near_pole(const Target& a, const Target& b) const {
  return a.in_cone || b.in_cone;
}

bool Verifier::State::in_cone(const Vec3& axis_P) const {
  return limits.has_cone && std::abs(meter().kinematics().direction(1).dot(axis_P)) >= limits.cone_cosine;
}

double Verifier::State::distance_to(const ToolPose& v, const Vec3& tip_P, const Vec3& axis_P) const {
  if (!in_cone(axis_P)) return combined_distance(v, tip_P, axis_P);
  const double angle = turn_between(v.axis_P, axis_P) - options.pole.tolerance.rad();
  return std::hypot((v.tip_P - tip_P).norm(), kAxisWeight_mm * std::max(0.0, angle));
}

}  // namespace trunnion::post
