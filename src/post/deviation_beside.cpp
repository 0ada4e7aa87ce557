// The tool beside the place of the path at which its tip is: its axis, and points up its flute.
#include "post/path_place.hpp"

namespace trunnion::post {

struct DeviationMeter::BesidePath {
  const Target& a;
  const Target& b;
  double flute_mm;
  const ProgramState& program;
  const Beside& uninteresting;
};

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

DeviationMeter::Beside DeviationMeter::beside(const Vertex& from, const Vertex& to, const Target& a,
                                              const Target& b, double t0, double t1, double flute_mm,
                                              const ProgramState& program,
                                              const Beside& uninteresting) const {
  Beside out;
  const BesidePath path{a, b, flute_mm, program, uninteresting};
  // Lost motion that is taken up counts at its end only.
  if (takes_up(from, to, program)) {
    look_beside(to, to, t1, t1, path, 0, out);
  } else {
    look_beside(from, to, t0, t1, path, 0, out);
  }
  return out;
}

// The places of the path are those of the tip at both ends, evenly between: then the difference between the
// tool and the path is one of straight lines, which is largest at an end, but for what the tool bows and the
// path's arc. (What is true of the tip and of a point up the tool is so of all between, at the same place.)
void DeviationMeter::look_beside(const Vertex& from, const Vertex& to, double t0, double t1,
                                 const BesidePath& path, int halvings, Beside& sum) const {
  constexpr double kSlack = 0.02;      // of the figure
  constexpr double kEnough = 1e-3;     // of the tolerance
  constexpr int kMostHalvings = 8;     // what bows is 1/65536 of it then
  constexpr int kSampledHalvings = 4;  // where no bound is known
  const auto axis_at = [&](double t) { return slerp(path.a.axis_P, path.b.axis_P, t); };
  const Vec3 axis0_P = axis_at(t0);
  const Vec3 axis1_P = axis_at(t1);
  const auto off_flute = [&](const Vertex& v, double t, const Vec3& axis_P) {
    const Vec3 tip_P = path.a.tip_P + t * (path.b.tip_P - path.a.tip_P);
    return (v.tip_P - tip_P + path.flute_mm * (v.axis_P - axis_P)).norm();
  };
  const auto angle = [](double chord) { return 2.0 * std::asin(std::min(1.0, 0.5 * chord)); };
  const double chord = std::max((from.axis_P - axis0_P).norm(), (to.axis_P - axis1_P).norm());
  const double flute_mm = std::max(off_flute(from, t0, axis0_P), off_flute(to, t1, axis1_P));
  const auto bow = bows_between(from, to);
  const double turn = turn_between(axis0_P, axis1_P);
  const double slack = bow ? bow->axis + turn * turn / 8.0 : 0.0;
  const double slack_mm = bow ? bow->tip_mm + path.flute_mm * slack : 0.0;
  if (bow && angle(chord + slack) <= path.uninteresting.axis_rad.upper &&
      flute_mm + slack_mm <= path.uninteresting.flute_mm.upper)
    return;
  const bool sharp =
      slack <= std::max(kSlack * chord, kEnough * axis_tolerance_.rad()) &&
      (path.flute_mm == 0.0 || slack_mm <= std::max(kSlack * flute_mm, kEnough * tolerance_mm_));
  if (halvings < (bow ? kMostHalvings : kSampledHalvings) && !(bow && sharp) && &from != &to) {
    Vertex middle = to;
    middle.q = between(from, to, 0.5);
    place(middle, to.q, path.program);
    const double t = std::clamp(fraction_of(middle, path.a, path.b), std::min(t0, t1), std::max(t0, t1));
    look_beside(from, middle, t0, t, path, halvings + 1, sum);
    return look_beside(middle, to, t, t1, path, halvings + 1, sum);
  }
  sum.proved = sum.proved && bow.has_value();
  const auto take = [](Interval& largest, double lower, double upper) {
    largest.lower = std::max(largest.lower, lower);
    largest.upper = std::max(largest.upper, upper);
  };
  take(sum.axis_rad, angle(chord), angle(chord + slack));
  take(sum.flute_mm, flute_mm, flute_mm + slack_mm);
}

}  // namespace trunnion::post
