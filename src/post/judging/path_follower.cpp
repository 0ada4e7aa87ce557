// Where a block of the program read back ends on the CL path.
#include "post/judging/path_follower.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::post {
namespace {

// The arc's point near fraction t of it: between ends as near as this where the chord is at t, which is the
// arc's fraction within 1e-6.
Vec3 point_of_arc(const Vec3& u0, const Vec3& u1, double t) {
  if (t >= 1.0) return u1;
  if (!((u1 - u0).squaredNorm() < kNearChord2)) return slerp(u0, u1, t);
  const Vec3 on_chord = u0 + t * (u1 - u0);
  return on_chord * (1.0 / on_chord.norm());
}

// How far a block goes that its rotary axes bend so much that its ends do not tell; null where they do. The
// parts' chords are shorter than the way by so little that reach_of has it.
std::optional<Way> bent_way(const TableKinematics& kinematics, const Vertex& from, const Vertex& v) {
  constexpr double kBends = kPi / 3.0;  // 1.05 of its chord
  constexpr double kMostParts = 600.0;  // a hundred turns: more is a slip of the hand
  if (v.tcp) return std::nullopt;
  double turn = 0.0;
  for (std::size_t k = 0; k < kinematics.rotary_count(); ++k)
    turn += std::abs(v.q[kinematics.rotary(k)] - from.q[kinematics.rotary(k)]);
  if (turn <= kBends) return std::nullopt;
  const int parts = static_cast<int>(std::ceil(std::min(turn / kBends, kMostParts)));
  Way way;
  ToolPose before = kinematics.pose(from.q);
  for (int i = 1; i <= parts; ++i) {
    const double t = static_cast<double>(i) / parts;
    const ToolPose part = kinematics.pose(JointVector::interpolate(from.q, v.q, t));
    way.tip_mm += (part.tip_P - before.tip_P).norm();
    way.axis_rad += turn_between(part.axis_P, before.axis_P);
    before = part;
  }
  return way;
}

}  // namespace

double PathFollower::hit_tolerance_mm() const {
  const double near_mm = limits_.on_truth ? 1.0 : 0.1;
  return limits_.tolerance_mm + near_mm;
}

Target PathFollower::here() const {
  const Target& a = points_[at_.segment];
  const Target& b = points_[std::min(at_.segment + 1, points_.size() - 1)];
  return {a.tip_P + at_.t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, at_.t), b.line, false};
}

double PathFollower::distance_to(const ToolPose& v, const Target& target) const {
  if (!limits_.in_cone(target.axis_P)) return combined_distance(v, target.tip_P, target.axis_P);
  const double angle = turn_between(v.axis_P, target.axis_P) - limits_.pole_tolerance_rad;
  return std::hypot((v.tip_P - target.tip_P).norm(), kAxisWeight_mm * std::max(0.0, angle));
}

bool PathFollower::is_above(const ToolPose& v, const Target& target, double least_mm) const {
  const double allowed_rad =
      limits_.axis_tolerance_rad + (limits_.in_cone(target.axis_P) ? limits_.pole_tolerance_rad : 0.0);
  if (turn_between(v.axis_P, target.axis_P) > allowed_rad) return false;
  const Vec3 d = v.tip_P - target.tip_P;
  const double along_mm = d.dot(target.axis_P);
  const double beside_mm = (d - along_mm * target.axis_P).norm();
  return along_mm >= least_mm && beside_mm <= hit_tolerance_mm() + std::abs(along_mm) * allowed_rad;
}

std::pair<std::size_t, std::size_t> PathFollower::segments_about(std::size_t segment) const {
  constexpr std::size_t kFarthest = 16;
  const double here_mm = points_[segment + 1].along_mm;
  const auto is_near = [&](std::size_t i) {
    return std::abs(points_[i].along_mm - here_mm) <= 2.0 * limits_.tolerance_mm;
  };
  std::size_t first = segment > 0 ? segment - 1 : 0;
  while (first > 0 && segment - first < kFarthest && is_near(first)) --first;
  std::size_t last = std::min(segment + 1, points_.size() - 2);
  while (last + 2 < points_.size() && last - segment < kFarthest && is_near(last)) ++last;
  return {first, last};
}

Place PathFollower::find(const TableKinematics& kinematics, const Vertex& from, const Vertex& v) const {
  if (const auto way = bent_way(kinematics, from, v)) return find_ahead(v, *way);
  if (const auto place = find_near(from, v, from.placed)) return *place;
  return find_ahead(v, {(v.tip_P - from.tip_P).norm(), turn_between(v.axis_P, from.axis_P)});
}

std::optional<Place> PathFollower::find_near(const ToolPose& from, const ToolPose& v,
                                             bool from_is_placed) const {
  // Nearly every block of a dense path ends at the next CL point.
  const Target& a = points_[at_.segment];
  const Target& next = points_[at_.segment + 1];
  const double off2_mm2 = (v.tip_P - next.tip_P).squaredNorm();
  const double chord2 = (v.axis_P - next.axis_P).squaredNorm();
  if (off2_mm2 < kSamePoint_mm * kSamePoint_mm) {
    // The chord of an angle is not below 2/pi of it.
    constexpr double kTurned_mm = 0.5 * kPi * kAxisWeight_mm;
    const double at_most2 = off2_mm2 + kTurned_mm * kTurned_mm * chord2;
    if (at_most2 < kSamePoint_mm * kSamePoint_mm || is_at_end(next, off2_mm2, chord2))
      return Place{at_.segment, 1.0, std::sqrt(at_most2), std::sqrt(off2_mm2), std::sqrt(chord2)};
    const Place end = placed_at(v, at_.segment, 1.0);
    if (end.distance < kSamePoint_mm) return end;
  }
  // Where the tool is within its tolerances of the segment that it is on, it is on that one still: near a CL
  // point the next one may be nearer to a displaced node.
  if (const auto t = still_on(v, a, next)) return placed_at(v, at_.segment, *t);
  // Nor can a block end beyond it that does not reach so far.
  if ((1.0 - at_.t) * next.way_mm > reach_of((v.tip_P - from.tip_P).norm(), limits_.tolerance_mm))
    return placed_at(v, at_.segment, std::max(fraction_of(v, a, next), at_.t));
  if (!from_is_placed) return std::nullopt;
  return find_at_corner(from, v, std::sqrt(chord2));
}

Place PathFollower::placed_at(const ToolPose& v, std::size_t segment, double t) const {
  const Target& a = points_[segment];
  const Target& b = points_[segment + 1];
  return placed_at(v, segment, t, (v.tip_P - a.tip_P - t * (b.tip_P - a.tip_P)).norm());
}

Place PathFollower::placed_at(const ToolPose& v, std::size_t segment, double t, double off_tip_mm) const {
  const Vec3 axis_P = point_of_arc(points_[segment].axis_P, points_[segment + 1].axis_P, t);
  const double chord2 = (v.axis_P - axis_P).squaredNorm();
  double turned = turn_between(v.axis_P, axis_P, chord2);
  if (limits_.in_cone(axis_P)) turned = std::max(0.0, turned - limits_.pole_tolerance_rad);
  const double turned_mm = kAxisWeight_mm * turned;
  return {segment, t, std::sqrt(off_tip_mm * off_tip_mm + turned_mm * turned_mm), off_tip_mm,
          std::sqrt(chord2)};
}

// find_ahead comes to the segment behind the corner, since what lies before it is not longer than its reach,
// and not to the next. The tip tells the place on both.
std::optional<Place> PathFollower::find_at_corner(const ToolPose& from, const ToolPose& v,
                                                  double off_axis) const {
  const std::size_t s = at_.segment;
  if (s + 3 >= points_.size()) return std::nullopt;
  const auto off2 = [&](const Target& target) { return (v.tip_P - target.tip_P).squaredNorm(); };
  const double reach_mm = reach_of((v.tip_P - from.tip_P).norm(), limits_.tolerance_mm);
  const double rest_mm = (1.0 - at_.t) * points_[s + 1].way_mm;
  // Where the block began a little before a CL point, the corner is the one behind that.
  const bool passes =
      rest_mm + points_[s + 2].way_mm <= reach_mm && off2(points_[s + 2]) < off2(points_[s + 1]);
  const std::size_t k = passes ? s + 1 : s;
  const Target& a = points_[k];
  const Target& corner = points_[k + 1];
  const Target& b = points_[k + 2];
  const Vec3 before = corner.tip_P - a.tip_P;
  const Vec3 behind = b.tip_P - corner.tip_P;
  const double before_mm = corner.way_mm;
  const double behind_mm = b.way_mm;
  if (!(std::min(before_mm, behind_mm) > kTipTells_mm) || b.rapid || (passes && corner.rapid) ||
      near_pole(points_[s], a) || near_pole(corner, b))
    return std::nullopt;
  const double ahead_mm = passes ? rest_mm + before_mm : rest_mm;
  if (!(ahead_mm <= reach_mm && ahead_mm + behind_mm > reach_mm)) return std::nullopt;
  // The block turned by what it has passed of the segment, less these two.
  const bool turns_enough = !passes && off_axis + at_.off_axis < 3.0 * limits_.axis_tolerance_rad;
  const double ahead_rad = (1.0 - at_.t) * points_[s + 1].turn + (passes ? corner.turn : 0.0);
  if (!turns_enough && ahead_rad > reach_of(turn_between(v.axis_P, from.axis_P), limits_.axis_tolerance_rad))
    return std::nullopt;
  const double t0 =
      std::clamp((v.tip_P - a.tip_P).dot(before) / before.squaredNorm(), passes ? 0.0 : at_.t, 1.0);
  const double t1 = std::clamp((v.tip_P - corner.tip_P).dot(behind) / behind.squaredNorm(), 0.0, 1.0);
  const double off0_mm = (v.tip_P - a.tip_P - t0 * before).norm();
  const double off1_mm = (v.tip_P - corner.tip_P - t1 * behind).norm();
  // The tip alone is no nearer than the tool.
  std::optional<Place> there;
  if (off0_mm >= off1_mm - kNearer_mm) there = placed_at(v, k + 1, t1, off1_mm);
  Place found = there && there->distance < off0_mm - kNearer_mm ? *there : placed_at(v, k, t0, off0_mm);
  if (there && there->distance < found.distance - kNearer_mm) found = *there;
  if (!passes) return found;
  const double t = std::max(fraction_of(v, points_[s], a), at_.t);
  const double off_mm = (v.tip_P - points_[s].tip_P - t * (a.tip_P - points_[s].tip_P)).norm();
  return found.distance < off_mm - 2.0 * kNearer_mm ? std::optional(found) : std::nullopt;
}

Place PathFollower::find_ahead(const ToolPose& v, const Way& way) const {
  const double reach_mm = reach_of(way.tip_mm, limits_.tolerance_mm);
  const double reach_rad = reach_of(way.axis_rad, limits_.axis_tolerance_rad);
  Place best;
  best.segment = at_.segment;
  double ahead_mm = 0.0;
  double ahead_rad = 0.0;
  for (std::size_t j = at_.segment; j + 1 < points_.size() && j < at_.segment + kLookAhead; ++j) {
    const Target& a = points_[j];
    const Target& b = points_[j + 1];
    if (j > at_.segment && b.rapid) break;
    double t = fraction_of(v, a, b);
    if (j == at_.segment) t = std::max(t, at_.t);
    // The tip alone may be too far off.
    if ((v.tip_P - a.tip_P - t * (b.tip_P - a.tip_P)).norm() < best.distance - kNearer_mm) {
      const Place place = placed_at(v, j, t);
      if (place.distance < best.distance - kNearer_mm) best = place;
    }
    const double rest = j == at_.segment ? 1.0 - at_.t : 1.0;
    ahead_mm += rest * b.way_mm;
    if (ahead_mm > reach_mm) break;
    ahead_rad += rest * b.turn;
    if (ahead_rad > reach_rad) break;
  }
  // The tool axis may have drawn the place over a CL point that the tip has not passed yet.
  if (best.segment > at_.segment) {
    const Target& a = points_[best.segment - 1];
    const Target& b = points_[best.segment];
    const double here = distance_to_segment(v.tip_P, b.tip_P, points_[best.segment + 1].tip_P);
    const double t = fraction_of(v, a, b);
    const double before = best.segment - 1 == at_.segment ? std::max(t, at_.t) : t;
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
bool PathFollower::is_at_end(const Target& b, double off2_mm2, double chord2) const {
  if (!limits_.on_truth || off2_mm2 > kSamePoint_mm * kSamePoint_mm) return false;
  if (b.way_mm < kTellsPoints * kSamePoint_mm) return false;
  // The chord of an angle is not below 2/pi of it.
  const double tolerance = limits_.axis_tolerance_rad;
  return 0.25 * kPi * kPi * chord2 <= tolerance * tolerance;
}

std::optional<double> PathFollower::still_on(const ToolPose& v, const Target& a, const Target& b) const {
  const Vec3 way = b.tip_P - a.tip_P;
  const double length2 = way.squaredNorm();
  const double t = length2 > 0.0 ? (v.tip_P - a.tip_P).dot(way) / length2 : 1.0;
  if (!(t < 1.0)) return std::nullopt;
  if ((v.tip_P - a.tip_P - std::max(t, at_.t) * way).norm() > limits_.tolerance_mm) return std::nullopt;
  const double turn = b.turn;
  const double turned = turn > 0.0 ? std::min(1.0, turn_between(a.axis_P, v.axis_P) / turn) : 0.0;
  const double off = turn_between(v.axis_P, slerp(a.axis_P, b.axis_P, turned));
  return off <= limits_.axis_tolerance_rad ? std::optional(std::max(t, at_.t)) : std::nullopt;
}

}  // namespace trunnion::post
