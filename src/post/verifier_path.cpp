// How the program read back is followed along the CL path.
#include <algorithm>
#include <cmath>

#include "post/verifier_state.hpp"

namespace trunnion::post {
namespace {

constexpr double kStill_mm =
    1e-3 * kAxisWeight_mm;                        // of the turn's weight: then rounding of XYZ would decide
constexpr double kTipTells_mm = kStill_mm * kPi;  // whatever the turn

// How far along a-b a position is. Where the tip stands nearly still the tool axis tells.
double parameter_of(const Vertex& v, const Target& a, const Target& b) {
  const Vec3 d = b.tip_P - a.tip_P;
  const double l2 = d.squaredNorm();
  // No turn is above half a one: mostly that decides.
  double turn = kPi;
  if (l2 <= kStill_mm * turn * kStill_mm * turn) turn = angle_between(a.axis_P, b.axis_P).rad();
  if (l2 > kStill_mm * turn * kStill_mm * turn) {
    return l2 > 0.0 ? std::clamp((v.tip_P - a.tip_P).dot(d) / l2, 0.0, 1.0) : 1.0;
  }
  return turn > 0.0 ? std::clamp(angle_between(a.axis_P, v.axis_P).rad() / turn, 0.0, 1.0) : 1.0;
}

// Goes along the chord of a block, to the feet of the CL points that it passes.
struct Foot {
  Foot(const Vertex& a, const Vertex& b)
      : from(a), way(b.tip_P - a.tip_P), turn(b.axis_P - a.axis_P), length2(way.squaredNorm()) {}
  void go_to(const Target& corner) {
    t = length2 > 0.0 ? std::clamp((corner.tip_P - from.tip_P).dot(way) / length2, t, 1.0) : 1.0;
  }
  Vec3 tip_P() const { return from.tip_P + t * way; }
  Vec3 axis_P() const { return from.axis_P + t * turn; }

  const Vertex& from;
  Vec3 way, turn;
  double length2;
  double t = 0.0;
};

// The arc's point near fraction t of it: between ends as near as this where the chord is at t, which is the
// arc's fraction within 1e-6.
Vec3 point_of_arc(const Vec3& u0, const Vec3& u1, double t) {
  constexpr double kNearChord2 = 2.5e-3;
  if (t >= 1.0) return u1;
  if (!((u1 - u0).squaredNorm() < kNearChord2)) return slerp(u0, u1, t);
  const Vec3 on_chord = u0 + t * (u1 - u0);
  return on_chord * (1.0 / on_chord.norm());
}

constexpr double kNearer_mm = 1e-7;  // a later place must be nearer by more than rounding

// Two positions that differ by the rounding of words only.
constexpr double kSamePoint_mm = 5e-4;

}  // namespace

double Verifier::State::hit_tolerance() const {
  const double near_mm = report.on_truth ? 1.0 : 0.1;
  return options.tolerance_mm + near_mm;
}

void Verifier::State::start(const Vertex& v) {
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

void Verifier::State::point_hit(double tip_mm) {
  report.max_point_deviation_mm = std::max(report.max_point_deviation_mm, tip_mm);
}

void Verifier::State::rapid(const Vertex& v) {
  if (v.in_cycle && steps(v)) return;
  pass_repeated_points();
  pass_end_of_cut();
  if (comes_nearer(v)) return;
  settle_rapid_end();
  const std::size_t next = at.segment + 1;
  const Target* target = next < targets.size() ? &targets[next] : nullptr;
  const bool met =
      target != nullptr && target->rapid && distance_to(v, target->tip_P, target->axis_P) <= hit_tolerance();
  if (met) {
    rapid_end =
        RapidEnd{*target, (v.tip_P - target->tip_P).norm(), distance_to(v, target->tip_P, target->axis_P)};
    const auto d = meter.sampled(*previous, v, targets[next - 1], *target, program);
    report.max_rapid_deviation_mm = std::max(report.max_rapid_deviation_mm, d.tip_mm.upper);
    at = {next, 0.0, 0.0};
  }
  record(v, 0.0, 0.0, target != nullptr ? target->line : 0, met);
}

bool Verifier::State::comes_nearer(const Vertex& v) {
  if (!rapid_end || at.t != 0.0 || targets[at.segment].tip_P != rapid_end->target.tip_P) return false;
  const Target& end = rapid_end->target;
  const double distance = distance_to(v, end.tip_P, end.axis_P);
  if (distance >= rapid_end->distance) return false;
  rapid_end->distance = distance;
  rapid_end->tip_mm = (v.tip_P - end.tip_P).norm();
  record(v, 0.0, 0.0, end.line, true);
  return true;
}

void Verifier::State::settle_rapid_end() {
  if (rapid_end) point_hit(rapid_end->tip_mm);
  rapid_end.reset();
}

void Verifier::State::pass_repeated_points() {
  for (std::size_t next = at.segment + 1; next < targets.size(); ++next) {
    if ((previous->tip_P - targets[next].tip_P).squaredNorm() > kSamePoint_mm * kSamePoint_mm) return;
    const double d = distance_to(*previous, targets[next].tip_P, targets[next].axis_P);
    if (d > kSamePoint_mm) return;
    mark_programmed();
    point_hit((previous->tip_P - targets[next].tip_P).norm());
    at = {next, 0.0, 0.0};
  }
}

void Verifier::State::pass_end_of_cut() {
  const std::size_t next = at.segment + 1;
  if (next >= targets.size() || targets[next].rapid) return;
  const Target& end = targets[next];
  if (distance_to(*previous, end.tip_P, end.axis_P) > hit_tolerance()) return;
  mark_programmed();
  point_hit((previous->tip_P - end.tip_P).norm());
  at = {next, 0.0, 0.0};
}

void Verifier::State::feed(Vertex& v) {
  if (v.in_cycle && steps(v)) return;
  pass_repeated_points();
  if (at.segment + 1 >= targets.size()) {  // beyond the end of the CL path: compared with its last point
    const Target& last = targets.back();
    take_deviation({{(v.tip_P - last.tip_P).norm(), (v.tip_P - last.tip_P).norm()},
                    {0.0, angle_between(v.axis_P, last.axis_P).rad()}});
    record_feed(v, last.line, false);
    return;
  }
  if (away && meter.takes_up(*previous, v, program)) return record(v, 0.0, 0.0, place_of_path().line, false);
  if (away ? comes_back(v) : leaves(v)) return;
  const Place place = find(v);
  const bool quiet = changes_no_figure(v, place);
  const bool passed_point = !quiet && judge(v, place);
  const Target& end = targets[place.segment + 1];
  const double to_end2 = (v.tip_P - end.tip_P).squaredNorm();
  const bool programmed = place.t >= 1.0 || (to_end2 < kSamePoint_mm * kSamePoint_mm &&
                                             distance_to(v, end.tip_P, end.axis_P) < kSamePoint_mm);
  if (programmed) {
    point_hit(std::sqrt(to_end2));
    at = {place.segment + 1, 0.0, 0.0, std::sqrt(to_end2), (v.axis_P - end.axis_P).norm()};
  } else {
    at = place;
  }
  v.placed = true;
  if (quiet) return;
  if (v.off_chord_mm > 0.0F) bows_by(v.off_chord_mm);
  record_feed(v, end.line, programmed || passed_point);
}

// The block is within its bow of the chord between its ends, and that, cut at the feet of the CL points that
// it passes, is no farther from each (convex) piece of the path than where it is cut: no place on the way is
// evaluated.
bool Verifier::State::changes_no_figure(const Vertex& v, const Place& place) {
  if (!previous->placed || v.off_chord_mm > 0.0F || !meter.may_bow(*previous, v)) return false;
  const DeviationMeter::Deviation known = uninteresting();
  // Differences that Certifier::axis does not tell: where the tool axis stands, all blocks miss it alike.
  constexpr double kSameAxis = 1e-9;
  const double known_axis = path::sine_at_least(known.axis_rad.upper);
  const double axis_limit = std::min(known_axis + kSameAxis,
                                     std::max(known_axis, path::sine_at_least(options.axis_tolerance.rad())));
  double tip_mm = std::max(at.off_tip_mm, place.off_tip_mm);
  double axis = std::max(at.off_axis, place.off_axis);
  if (!(tip_mm < known.tip_mm.upper && axis < axis_limit)) return false;
  bows = shares_block && leader->bows ? leader->bows
                                      : meter.certifier().bows_from_norms(previous->station, v.station);
  const auto bow = meter.bow_at_most(*previous, v, *bows);
  if (!bow) return false;
  bool surely = true;
  Foot foot(*previous, v);
  for (std::size_t j = at.segment; j < place.segment; ++j) {
    const Target& corner = targets[j + 1];
    foot.go_to(corner);
    const double off_mm = (foot.tip_P() - corner.tip_P).norm();
    surely = surely && off_mm + bow->tip_mm <= report.max_point_deviation_mm;
    tip_mm = std::max(tip_mm, off_mm);
    axis = std::max(axis, (foot.axis_P() - corner.axis_P).norm());
  }
  if (axis + bow->axis > axis_limit) return false;
  // Figures of the pole's cone are others; between opposite axes there is no arc.
  for (std::size_t j = at.segment; j <= place.segment; ++j) {
    if (near_pole(targets[j], targets[j + 1]) || targets[j].axis_P.dot(targets[j + 1].axis_P) < 0.0)
      return false;
  }
  if (!(surely && tip_mm + bow->tip_mm <= known.tip_mm.upper) && !keeps_tip(v, place, known.tip_mm.upper))
    return false;
  if (axis + bow->axis > known_axis) {
    report.max_axis_deviation =
        std::max(report.max_axis_deviation, Angle::radians(std::asin(axis + bow->axis)));
  }
  return true;
}

// The same cuts, with the tip's curve on each side of them.
bool Verifier::State::keeps_tip(const Vertex& v, const Place& place, double limit_mm) const {
  constexpr std::size_t kMostCuts = 2;
  if (place.segment - at.segment > kMostCuts) return false;
  std::array<Vertex, kMostCuts>& cuts = cut_at;
  const Vertex* from = previous;
  Foot foot(*previous, v);
  for (std::size_t j = at.segment; j < place.segment; ++j) {
    foot.go_to(targets[j + 1]);
    Vertex& cut = cuts[j - at.segment];
    cut.q = JointVector::interpolate(previous->q, v.q, foot.t);
    meter.place(cut, v.q, program);
    if ((cut.tip_P - targets[j + 1].tip_P).norm() > report.max_point_deviation_mm ||
        !meter.keeps_tip(*from, cut, targets[j], targets[j + 1], limit_mm))
      return false;
    from = &cut;
  }
  return meter.keeps_tip(*from, v, targets[place.segment], targets[place.segment + 1], limit_mm);
}

bool Verifier::State::judge(const Vertex& v, const Place& place) {
  const Vertex* from = previous;
  std::optional<Vertex> passed;
  // What a block is off its chord comes on top: then the figure itself is needed.
  const DeviationMeter::Deviation known =
      v.off_chord_mm > 0.0F ? DeviationMeter::Deviation{} : uninteresting();
  bool passed_point = false;  // the block ends at a CL point and a little beyond it
  for (std::size_t j = at.segment; j < place.segment; ++j) {  // CL points that the block passes
    const Vertex to = meter.nearest_between(*from, v, targets[j + 1], program);
    point_hit((to.tip_P - targets[j + 1].tip_P).norm());
    take_deviation(meter.of(*from, to, targets[j], targets[j + 1], program, known),
                   near_pole(targets[j], targets[j + 1]));
    passed_point |= options.collect && mark_nearer(v, targets[j + 1]);
    passed = to;
    from = &*passed;
  }
  const Target& end = targets[place.segment + 1];
  take_deviation(meter.of(*from, v, targets[place.segment], end, program, known),
                 near_pole(targets[place.segment], end));
  return passed_point;
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
  return kSamePoint_mm + kAlong * std::hypot(block_tip_mm, kAxisWeight_mm * block_axis_rad);
}

void Verifier::State::mark_programmed() {
  if (options.collect && !report.blocks.empty()) report.blocks.back().programmed = true;
}

Target Verifier::State::place_of_path() const {
  const Target& a = targets[at.segment];
  const Target& b = targets[std::min(at.segment + 1, targets.size() - 1)];
  return {a.tip_P + at.t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, at.t), b.line, false};
}

bool Verifier::State::leaves(const Vertex& v) {
  const Vec3 way = v.tip_P - previous->tip_P;
  const bool along_axis = way.dot(previous->axis_P) > (1.0 - 1e-6) * way.norm();
  constexpr double kSameAxis_rad = 1e-5;  // the rounding of the angles
  if (!along_axis || way.norm() < hit_tolerance() ||
      angle_between(v.axis_P, previous->axis_P).rad() > kSameAxis_rad)
    return false;
  if (find(v).distance <= hit_tolerance()) return false;  // a motion of the CL file itself
  away = true;
  record(v, 0.0, 0.0, place_of_path().line, false);
  return true;
}

bool Verifier::State::comes_back(const Vertex& v) {
  away = false;
  const Target place = place_of_path();
  const Vec3 way = previous->tip_P - v.tip_P;
  if (distance_to(v, place.tip_P, place.axis_P) > hit_tolerance()) return false;
  if (way.dot(v.axis_P) < (1.0 - 1e-6) * way.norm()) return false;
  // Inside the pole's cone the tool may have been tilted: it comes back along its own axis then.
  const bool in_cone = this->in_cone(place.axis_P);
  const bool tilted = in_cone && angle_between(v.axis_P, place.axis_P) > options.axis_tolerance;
  const Target out{place.tip_P + way.norm() * (tilted ? v.axis_P : place.axis_P), place.axis_P, place.line,
                   false};
  take_deviation(meter.of(*previous, v, out, place, program, uninteresting()), in_cone);
  record_feed(v, place.line, at.t == 0.0);
  return true;
}

Place Verifier::State::find(const Vertex& v) const {
  // Nearly every block of a dense path ends at the next CL point.
  const Target& a = targets[at.segment];
  const Target& next = targets[at.segment + 1];
  const double off2_mm2 = (v.tip_P - next.tip_P).squaredNorm();
  const double chord2 = (v.axis_P - next.axis_P).squaredNorm();
  // The chord of an angle is not below 2/pi of it.
  constexpr double kTurned_mm = 0.5 * kPi * kAxisWeight_mm;
  const double at_most2 = off2_mm2 + kTurned_mm * kTurned_mm * chord2;
  if (at_most2 < kSamePoint_mm * kSamePoint_mm || is_at_end(v, a, next))
    return {at.segment, 1.0, std::sqrt(at_most2), std::sqrt(off2_mm2), std::sqrt(chord2)};
  if (off2_mm2 < kSamePoint_mm * kSamePoint_mm) {
    const Place end = placed_at(v, at.segment, 1.0);
    if (end.distance < kSamePoint_mm) return end;
  }
  // Where the tool is within its tolerances of the segment that it is on, it is on that one still: near a CL
  // point the next one may be nearer to a displaced node.
  if (const auto t = still_on(v, a, next)) return placed_at(v, at.segment, *t);
  if (const auto place = find_at_corner(v, std::sqrt(chord2))) return *place;
  return find_ahead(v);
}

Place Verifier::State::placed_at(const Vertex& v, std::size_t segment, double t) const {
  const Target& a = targets[segment];
  const Target& b = targets[segment + 1];
  return placed_at(v, segment, t, (v.tip_P - a.tip_P - t * (b.tip_P - a.tip_P)).norm());
}

Place Verifier::State::placed_at(const Vertex& v, std::size_t segment, double t, double off_tip_mm) const {
  const Vec3 axis_P = point_of_arc(targets[segment].axis_P, targets[segment + 1].axis_P, t);
  const double chord2 = (v.axis_P - axis_P).squaredNorm();
  double turned = turn_between(v.axis_P, axis_P, chord2);
  if (in_cone(axis_P)) turned = std::max(0.0, turned - options.pole.tolerance.rad());
  const double turned_mm = kAxisWeight_mm * turned;
  return {segment, t, std::sqrt(off_tip_mm * off_tip_mm + turned_mm * turned_mm), off_tip_mm,
          std::sqrt(chord2)};
}

// find_ahead comes to the segment behind the corner, since what lies before it is not longer than its reach,
// and not to the next. The tip tells the place on both.
std::optional<Place> Verifier::State::find_at_corner(const Vertex& v, double off_axis) const {
  const std::size_t s = at.segment;
  if (!previous->placed || s + 3 >= targets.size()) return std::nullopt;
  const auto off2 = [&](const Target& target) { return (v.tip_P - target.tip_P).squaredNorm(); };
  // Where the block began a little before a CL point, the corner is the one behind that.
  const bool passes = off2(targets[s + 2]) < off2(targets[s + 1]);
  const std::size_t k = passes ? s + 1 : s;
  const Target& a = targets[k];
  const Target& corner = targets[k + 1];
  const Target& b = targets[k + 2];
  const Vec3 before = corner.tip_P - a.tip_P;
  const Vec3 behind = b.tip_P - corner.tip_P;
  const double before_mm = before.norm();
  const double behind_mm = behind.norm();
  if (!(std::min(before_mm, behind_mm) > kTipTells_mm) || b.rapid || (passes && corner.rapid) ||
      near_pole(targets[s], a) || near_pole(corner, b))
    return std::nullopt;
  const double reach_mm = reach_of((v.tip_P - previous->tip_P).norm());
  const double rest_mm = (1.0 - at.t) * (targets[s + 1].tip_P - targets[s].tip_P).norm();
  const double ahead_mm = passes ? rest_mm + before_mm : rest_mm;
  if (!(ahead_mm <= reach_mm && ahead_mm + behind_mm > reach_mm)) return std::nullopt;
  if (passes) {
    const double ahead_rad =
        (1.0 - at.t) * turn_between(targets[s].axis_P, a.axis_P) + turn_between(a.axis_P, corner.axis_P);
    if (ahead_rad > reach_of(turn_between(v.axis_P, previous->axis_P), options.axis_tolerance))
      return std::nullopt;
  } else if (!(off_axis + at.off_axis < 3.0 * options.axis_tolerance.rad())) {
    // Else the block turned by what it has passed of the segment, less these two.
    return std::nullopt;
  }
  const double t0 =
      std::clamp((v.tip_P - a.tip_P).dot(before) / (before_mm * before_mm), passes ? 0.0 : at.t, 1.0);
  const double t1 = std::clamp((v.tip_P - corner.tip_P).dot(behind) / (behind_mm * behind_mm), 0.0, 1.0);
  const double off0_mm = (v.tip_P - a.tip_P - t0 * before).norm();
  const double off1_mm = (v.tip_P - corner.tip_P - t1 * behind).norm();
  Place found = placed_at(v, k, t0, off0_mm);
  if (off0_mm >= off1_mm - kNearer_mm) {
    const Place there = placed_at(v, k + 1, t1, off1_mm);
    if (there.distance < found.distance - kNearer_mm) found = there;
  }
  if (!passes) return found;
  const double t = std::max(parameter_of(v, targets[s], a), at.t);
  const double off_mm = (v.tip_P - targets[s].tip_P - t * (a.tip_P - targets[s].tip_P)).norm();
  return found.distance < off_mm - 2.0 * kNearer_mm ? std::optional(found) : std::nullopt;
}

double Verifier::State::reach_of(double way_mm) const {
  return 1.1 * way_mm + 4.0 * options.tolerance_mm;
}
double Verifier::State::reach_of(double turn_rad, Angle tolerance) {
  return 1.1 * turn_rad + 4.0 * tolerance.rad();
}

Place Verifier::State::find_ahead(const Vertex& v) const {
  const double reach_mm = reach_of((v.tip_P - previous->tip_P).norm());
  const double reach_rad = reach_of(turn_between(v.axis_P, previous->axis_P), options.axis_tolerance);
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
    const Vec3 way = b.tip_P - a.tip_P;
    // The tip alone may be too far off.
    if ((v.tip_P - a.tip_P - t * way).norm() < best.distance - kNearer_mm) {
      const Place place = placed_at(v, j, t);
      if (place.distance < best.distance - kNearer_mm) best = place;
    }
    const double rest = j == at.segment ? 1.0 - at.t : 1.0;
    ahead_mm += rest * way.norm();
    if (ahead_mm > reach_mm) break;
    ahead_rad += rest * turn_between(a.axis_P, b.axis_P);
    if (ahead_rad > reach_rad) break;
  }
  // The tool axis may have drawn the place over a CL point that the tip has not passed yet.
  if (best.segment > at.segment) {
    const Target& a = targets[best.segment - 1];
    const Target& b = targets[best.segment];
    const double here = distance_to_segment(v.tip_P, b.tip_P, targets[best.segment + 1].tip_P);
    const double t = parameter_of(v, a, b);
    const double before = best.segment - 1 == at.segment ? std::max(t, at.t) : t;
    // Where the path comes back along itself what lies behind is as near.
    const double there = before > t ? (v.tip_P - a.tip_P - before * (b.tip_P - a.tip_P)).norm()
                                    : distance_to_segment(v.tip_P, a.tip_P, b.tip_P);
    if (there < here - kNearer_mm) {
      const double distance = best.distance;
      best = placed_at(v, best.segment - 1, before);
      best.distance = distance;
    }
  }
  return best;
}

// On a machine with errors the tool axis is off its place even where the tip is not. Where the tip tells the
// place, and the axis is within its tolerance, that is the end of the segment.
bool Verifier::State::is_at_end(const Vertex& v, const Target& a, const Target& b) const {
  constexpr double kTells = 20.0;  // of what counts as the same point: a shorter way may be one of the axis
  if (!report.on_truth) return false;
  if ((v.tip_P - b.tip_P).squaredNorm() > kSamePoint_mm * kSamePoint_mm) return false;
  if ((b.tip_P - a.tip_P).squaredNorm() < kTells * kTells * kSamePoint_mm * kSamePoint_mm) return false;
  // The chord of an angle is not below 2/pi of it.
  return 0.5 * kPi * (v.axis_P - b.axis_P).norm() <= options.axis_tolerance.rad();
}

std::optional<double> Verifier::State::still_on(const Vertex& v, const Target& a, const Target& b) const {
  const Vec3 way = b.tip_P - a.tip_P;
  const double length2 = way.squaredNorm();
  const double t = length2 > 0.0 ? (v.tip_P - a.tip_P).dot(way) / length2 : 1.0;
  if (!(t < 1.0)) return std::nullopt;
  if ((v.tip_P - a.tip_P - std::max(t, at.t) * way).norm() > options.tolerance_mm) return std::nullopt;
  const double turn = turn_between(a.axis_P, b.axis_P);
  const double turned = turn > 0.0 ? std::min(1.0, turn_between(a.axis_P, v.axis_P) / turn) : 0.0;
  const double off = turn_between(v.axis_P, slerp(a.axis_P, b.axis_P, turned));
  return off <= options.axis_tolerance.rad() ? std::optional(std::max(t, at.t)) : std::nullopt;
}

DeviationMeter::Deviation Verifier::State::uninteresting() const {
  if (options.collect || report.worst.size() < options.worst_count || report.worst.empty()) return {};
  return {{0.0, report.worst.back().tip_mm}, {0.0, judged_axis_rad}};
}

bool Verifier::State::near_pole(const Target& a, const Target& b) const {
  return in_cone(a.axis_P) || in_cone(b.axis_P);
}

bool Verifier::State::in_cone(const Vec3& axis_P) const {
  if (options.pole.tolerance.rad() <= 0.0 || meter.kinematics().rotary_count() < 2) return false;
  return std::abs(meter.kinematics().direction(1).dot(axis_P)) >= cone_cosine;
}

double Verifier::State::distance_to(const Vertex& v, const Vec3& tip_P, const Vec3& axis_P) const {
  if (!in_cone(axis_P)) return combined_distance(v, tip_P, axis_P);
  const double angle = turn_between(v.axis_P, axis_P) - options.pole.tolerance.rad();
  return std::hypot((v.tip_P - tip_P).norm(), kAxisWeight_mm * std::max(0.0, angle));
}

}  // namespace trunnion::post
