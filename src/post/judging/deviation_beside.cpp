// The tool beside the path: its axis where the tip is, and the points up its flute.

#include "post/judging/path_place.hpp"

namespace trunnion::post {

struct DeviationMeter::BesidePath {
  const Target& a;
  const Target& b;
  path::FluteSegment segment;
  const ProgramState& program;
  const Beside& uninteresting;
};

namespace {

constexpr double kSlack = 0.02;      // of the figure
constexpr double kEnough = 1e-3;     // of the tolerance
constexpr int kMostHalvings = 8;     // what bows is 1/65536 of it then
constexpr int kSampledHalvings = 4;  // where no bound is known
constexpr double kMiddle = 0.5;      // where a search for the nearest place begins
constexpr double kAsParabola = 2.0;  // nowhere are places off by more than twice what they are half way

}  // namespace

void DeviationMeter::take(Interval& largest, double lower, double upper) {
  largest.lower = std::max(largest.lower, lower);
  largest.upper = std::max(largest.upper, upper);
}

// Bounds on how far the tip and the tool axis leave the straight way between the ends; nothing where none are
// known.
std::optional<path::Certifier::Bows> DeviationMeter::bows_between(const Vertex& from,
                                                                  const Vertex& to) const {
  const bool along_line = from.tcp && to.tcp;
  if (along_line ? !certify_ : !may_bow(from, to)) return std::nullopt;
  path::Certifier::Bows nominal = certifier_.bows_from_norms(from.station, to.station);
  if (along_line) nominal.tip_mm = 0.0;
  return bow_at_most(from, to, nominal);
}

Vertex DeviationMeter::middle_of(const Vertex& from, const Vertex& to, const ProgramState& program) const {
  Vertex middle = to;
  middle.q = between(from, to, 0.5);
  place(middle, to.q, program);
  return middle;
}

DeviationMeter::Beside DeviationMeter::beside(const Stretch& part, const Target& a, const Target& b,
                                              const ProgramState& program,
                                              const Beside& uninteresting) const {
  const auto& [from, to, t0, t1] = part;
  Beside out;
  const BesidePath path{a, b, path::FluteSegment({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, b.flute_mm), program,
                        uninteresting};
  // Lost motion that is taken up counts at its end only.
  const bool end_only = takes_up(from, to, program);
  const Vertex& begin = end_only ? to : from;
  if (uninteresting.axis_rad.upper < kPi) look_at_axis({begin, to, end_only ? t1 : t0, t1}, path, 0, out);
  if (b.flute_mm == 0.0) return out;
  if (!end_only && prove_flute(from, to, path, {t0, t1}, out)) return out;
  const auto near = [&](const Vertex& v) { return path.segment.nearest(v.tip_P, v.axis_P, kMiddle); };
  look_at_flute({begin, to, near(begin), near(to)}, path, 0, out);
  return out;
}

// The places of the path are those of the tip at both ends, evenly between: then the difference between the
// tool's axis and the path's is one of straight lines, which is largest at an end, but for what the axis bows
// and the path's arc.
void DeviationMeter::look_at_axis(const Stretch& part, const BesidePath& path, int halvings,
                                  Beside& sum) const {
  const auto& [from, to, t0, t1] = part;
  const Vec3 axis0_P = path.segment.axis_P(t0);
  const Vec3 axis1_P = path.segment.axis_P(t1);
  const auto angle = [](double chord) { return 2.0 * std::asin(std::min(1.0, 0.5 * chord)); };
  const double chord = std::max((from.axis_P - axis0_P).norm(), (to.axis_P - axis1_P).norm());
  const auto bow = bows_between(from, to);
  const double turn = turn_between(axis0_P, axis1_P);
  const double slack = bow ? bow->axis + turn * turn / 8.0 : 0.0;
  const double room = path.uninteresting.axis_rad.upper - angle(chord + slack);
  const bool counts = !bow || room < 0.0;
  // Wherever the tip's places are, they are on this part of the arc.
  if (!counts && turn <= room) return;
  if (halvings < (bow ? kMostHalvings : kSampledHalvings) && !part.is_point()) {
    const double enough = std::max(kSlack * chord, kEnough * axis_tolerance_.rad());
    if (!counts && halvings == 0 && runs_evenly(part, path, room)) return;
    const Vertex middle = middle_of(from, to, path.program);
    const double t = std::clamp(fraction_of(middle, path.a, path.b), std::min(t0, t1), std::max(t0, t1));
    // The tip may lead, or wait at a corner: then its places do not run evenly.
    const double uneven = kAsParabola * std::abs(t - 0.5 * (t0 + t1)) * path.segment.turn();
    const bool even = uneven <= enough || (!counts && uneven <= room);
    if (!bow || !even || (counts && slack > enough)) {
      look_at_axis({from, middle, t0, t}, path, halvings + 1, sum);
      return look_at_axis({middle, to, t, t1}, path, halvings + 1, sum);
    }
  }
  if (!counts) return;
  sum.proved = sum.proved && bow.has_value();
  take(sum.axis_rad, angle(chord), angle(chord + slack));
}

// The places of the tip are never farther from an even course than the path's axis turns by `room_rad` on.
// What the errors bend the way by leads the tip along the segment by that much.
bool DeviationMeter::runs_evenly(const Stretch& part, const BesidePath& path, double room_rad) const {
  const auto& [from, to, t0, t1] = part;
  if (certify_ || from.tcp || to.tcp) return false;
  const auto errors = bend_at_most(from.q, to.q);
  const double length_mm = (path.b.tip_P - path.a.tip_P).norm();
  if (!errors || !(length_mm > 0.0)) return false;
  const path::Station half = path::halfway(kinematics(), actual(from), actual(to));
  const ToolPose middle{half.tip_P, half.axis_P};
  const double t = std::clamp(fraction_of(middle, path.a, path.b), std::min(t0, t1), std::max(t0, t1));
  const double off = std::abs(t - 0.5 * (t0 + t1)) + errors->tip_mm / length_mm;
  return kAsParabola * off * path.segment.turn() <= room_rad;
}

// On a machine with errors between the actual places of the ends, with what the errors bend the way between
// them. False where that is not known, or would make up too much of the figure.
bool DeviationMeter::prove_flute(const Vertex& from, const Vertex& to, const BesidePath& path,
                                 const path::FluteCertifier::Places& about, Beside& sum) const {
  using Tip = path::FluteCertifier::Tip;
  if (!certify_ && !may_bow(from, to)) return false;
  double slack_mm = 0.0;
  path::Station begin = from.station;
  path::Station end = to.station;
  if (!certify_) {
    const auto errors = bend_at_most(from.q, to.q);
    if (!errors) return false;
    slack_mm = errors->tip_mm + path.segment.flute_mm() * errors->axis_rad;
    begin = actual(from);
    end = actual(to);
  }
  const path::FluteCertifier certifier(kinematics(), from.tcp && to.tcp ? Tip::straight : Tip::as_axes_go);
  const auto within = [&](double limit_mm) {
    return limit_mm > slack_mm &&
           certifier.within(begin, end, path.segment, limit_mm - slack_mm, about) == path::Within::yes;
  };
  if (within(path.uninteresting.flute_mm.upper)) return true;
  const path::Bound bound = certifier.deviation(begin, end, path.segment);
  if (slack_mm > std::max(kSlack * bound.lower, kEnough * tolerance_mm_)) return false;
  const double upper = bound.upper + slack_mm;
  const bool straddles = bound.lower <= tolerance_mm_ && upper > tolerance_mm_;
  take(sum.flute_mm, std::max(0.0, bound.lower - slack_mm),
       straddles && within(tolerance_mm_) ? tolerance_mm_ : upper);
  return true;
}

// Without a proof for the whole: the places of the path run evenly from the nearest at one end to that at the
// other, so that what is said of the axis above holds of tip and flute.
void DeviationMeter::look_at_flute(const Stretch& part, const BesidePath& path, int halvings,
                                   Beside& sum) const {
  const auto& [from, to, t0, t1] = part;
  const double flute = path.segment.flute_mm();
  const double off_mm = std::max(path.segment.off(from.tip_P, from.axis_P, t0).largest_mm(flute),
                                 path.segment.off(to.tip_P, to.axis_P, t1).largest_mm(flute));
  const auto bow = bows_between(from, to);
  const double turn = (t1 - t0) * path.segment.turn();
  const double slack_mm = bow ? bow->tip_mm + flute * (bow->axis + turn * turn / 8.0) : 0.0;
  if (bow && off_mm + slack_mm <= path.uninteresting.flute_mm.upper) return;
  const bool sharp = bow && slack_mm <= std::max(kSlack * off_mm, kEnough * tolerance_mm_);
  if (halvings < (bow ? kMostHalvings : kSampledHalvings) && !sharp && !part.is_point()) {
    const Vertex middle = middle_of(from, to, path.program);
    const double t = path.segment.nearest(middle.tip_P, middle.axis_P, 0.5 * (t0 + t1));
    look_at_flute({from, middle, t0, t}, path, halvings + 1, sum);
    return look_at_flute({middle, to, t, t1}, path, halvings + 1, sum);
  }
  sum.proved = sum.proved && bow.has_value();
  take(sum.flute_mm, off_mm, off_mm + slack_mm);
}

}  // namespace trunnion::post
