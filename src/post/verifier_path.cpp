// How the program read back is followed along the CL path.
#include <algorithm>
#include <cmath>

#include "post/verifier_state.hpp"

namespace trunnion::post {
namespace {

// How far along a-b a position is. Where the tip stands nearly still the tool axis tells.
double parameter_of(const Vertex& v, const Target& a, const Target& b) {
  const Vec3 d = b.tip_P - a.tip_P;
  const double l2 = d.squaredNorm();
  constexpr double kStill_mm =
      1e-3 * kAxisWeight_mm;  // of the turn's weight: then rounding of XYZ would decide
  // No turn is above half a one: mostly that decides.
  double turn = kPi;
  if (l2 <= kStill_mm * turn * kStill_mm * turn) turn = angle_between(a.axis_P, b.axis_P).rad();
  if (l2 > kStill_mm * turn * kStill_mm * turn) {
    return l2 > 0.0 ? std::clamp((v.tip_P - a.tip_P).dot(d) / l2, 0.0, 1.0) : 1.0;
  }
  return turn > 0.0 ? std::clamp(angle_between(a.axis_P, v.axis_P).rad() / turn, 0.0, 1.0) : 1.0;
}

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
  const std::size_t next = at.segment + 1;
  const Target* target = next < targets.size() ? &targets[next] : nullptr;
  const bool met =
      target != nullptr && target->rapid && distance_to(v, target->tip_P, target->axis_P) <= hit_tolerance();
  if (met) {
    point_hit((v.tip_P - target->tip_P).norm());
    const auto d = meter.sampled(*previous, v, targets[next - 1], *target, program);
    report.max_rapid_deviation_mm = std::max(report.max_rapid_deviation_mm, d.tip_mm.upper);
    at = {next, 0.0, 0.0};
  }
  record(v, 0.0, 0.0, target != nullptr ? target->line : 0, met);
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

void Verifier::State::feed(const Vertex& v) {
  if (v.in_cycle && steps(v)) return;
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
    passed_point |= mark_nearer(v, targets[j + 1]);
    passed = to;
    from = &*passed;
  }
  const Target& end = targets[place.segment + 1];
  take_deviation(meter.of(*from, v, targets[place.segment], end, program, known),
                 near_pole(targets[place.segment], end));
  const bool programmed = place.t >= 1.0 || distance_to(v, end.tip_P, end.axis_P) < kSamePoint_mm;
  if (programmed) point_hit((v.tip_P - end.tip_P).norm());
  at = programmed ? Place{place.segment + 1, 0.0, 0.0} : place;
  if (v.off_chord_mm > 0.0F) bows_by(v.off_chord_mm);
  record_feed(v, end.line, programmed || passed_point);
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
  // Inside the pole's cone the tool may stand off the CL file's axis: it comes back along its own.
  const bool tilted = in_cone(place.axis_P);
  const Target out{place.tip_P + way.norm() * (tilted ? v.axis_P : place.axis_P), place.axis_P, place.line,
                   false};
  take_deviation(meter.of(*previous, v, out, place, program, uninteresting()), tilted);
  record_feed(v, place.line, at.t == 0.0);
  return true;
}

Place Verifier::State::find(const Vertex& v) const {
  // Nearly every block of a dense path ends at the next CL point.
  const Target& next = targets[at.segment + 1];
  // The chord of an angle is not below 2/pi of it.
  const double turned_mm = 0.5 * kPi * kAxisWeight_mm * (v.axis_P - next.axis_P).norm();
  const double at_most2 = (v.tip_P - next.tip_P).squaredNorm() + turned_mm * turned_mm;
  if (at_most2 < kSamePoint_mm * kSamePoint_mm) return {at.segment, 1.0, std::sqrt(at_most2)};
  if (is_at_end(v, targets[at.segment], next)) return {at.segment, 1.0, std::sqrt(at_most2)};
  const double to_next = distance_to(v, next.tip_P, next.axis_P);
  if (to_next < kSamePoint_mm) return {at.segment, 1.0, to_next};
  // Where the tool is within its tolerances of the segment that it is on, it is on that one still: near a CL
  // point the next one may be nearer to a displaced node.
  if (const auto t = still_on(v, targets[at.segment], next)) {
    const Target& a = targets[at.segment];
    return {at.segment, *t,
            distance_to(v, a.tip_P + *t * (next.tip_P - a.tip_P), slerp(a.axis_P, next.axis_P, *t))};
  }
  const double reach_mm = 1.1 * (v.tip_P - previous->tip_P).norm() + 4.0 * options.tolerance_mm;
  const double reach_rad =
      1.1 * angle_between(v.axis_P, previous->axis_P).rad() + 4.0 * options.axis_tolerance.rad();
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
    if (there < here - 1e-7) best = {best.segment - 1, before, best.distance};
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
  const double turn = angle_between(a.axis_P, b.axis_P).rad();
  const double turned = turn > 0.0 ? std::min(1.0, angle_between(a.axis_P, v.axis_P).rad() / turn) : 0.0;
  const Angle off = angle_between(v.axis_P, slerp(a.axis_P, b.axis_P, turned));
  return off <= options.axis_tolerance ? std::optional(std::max(t, at.t)) : std::nullopt;
}

DeviationMeter::Deviation Verifier::State::uninteresting() const {
  if (options.collect || report.worst.size() < options.worst_count) return {};
  return {{0.0, report.worst.back().tip_mm}, {0.0, report.max_axis_deviation.rad()}};
}

bool Verifier::State::near_pole(const Target& a, const Target& b) const {
  return in_cone(a.axis_P) || in_cone(b.axis_P);
}

bool Verifier::State::in_cone(const Vec3& axis_P) const {
  if (options.pole.tolerance.rad() <= 0.0 || meter.kinematics().rotary_count() < 2) return false;
  const double cosine = std::abs(meter.kinematics().direction(1).dot(axis_P));
  return cosine >= std::cos(options.pole.cone.rad());
}

double Verifier::State::distance_to(const Vertex& v, const Vec3& tip_P, const Vec3& axis_P) const {
  if (!in_cone(axis_P)) return combined_distance(v, tip_P, axis_P);
  const double angle = angle_between(v.axis_P, axis_P).rad() - options.pole.tolerance.rad();
  return std::hypot((v.tip_P - tip_P).norm(), kAxisWeight_mm * std::max(0.0, angle));
}

}  // namespace trunnion::post
