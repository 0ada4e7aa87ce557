#include "post/judging/flute_about.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "trunnion/path/flute.hpp"
#include "trunnion/path/smaller_of_two.hpp"

namespace trunnion::post {

bool FluteAbout::counts(std::size_t j, std::size_t segment) const {
  const PathPoints& points = path_.points();
  const Target& b = points[j + 1];
  return !b.rapid && b.flute_mm == points[segment + 1].flute_mm &&
         (in_cone_ || !PathFollower::near_pole(points[j], b));
}

namespace {

constexpr double kMidPlace = 0.5;   // where a search for the nearest place begins
constexpr double kNotKnown = -1.0;  // of a place

lanes::Triple<double> triple_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

double FluteAbout::passes_at(const Vertex& from, const Vertex& v, const Target& corner, double flute_mm) {
  const auto tip = triple_of(corner.tip_P - from.tip_P);
  const auto axis = triple_of(corner.axis_P - from.axis_P);
  const auto way = triple_of(v.tip_P - from.tip_P);
  const auto turn = triple_of(v.axis_P - from.axis_P);
  return path::smaller_of_two<double>(tip, way, tip + flute_mm * axis, way + flute_mm * turn);
}

bool FluteAbout::keeps_on(const Part& part, std::size_t j, double limit_mm) const {
  const Target& a = path_.points()[j];
  const Target& b = path_.points()[j + 1];
  const path::FluteSegment segment({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, b.flute_mm);
  const auto place = [&](const Vertex& end, double t) {
    return t < 0.0 ? segment.nearest(end.tip_P, end.axis_P, kMidPlace) : t;
  };
  return meter_.keeps_flute({part.from, part.to, place(part.from, part.t0), place(part.to, part.t1)}, segment,
                            limit_mm);
}

bool FluteAbout::keeps_between_corners(const Vertex& from, const Vertex& v, std::size_t segment,
                                       double limit_mm) const {
  const PathPoints& points = path_.points();
  const auto [first, last] = path_.segments_about(segment);
  const double flute_mm = points[segment + 1].flute_mm;
  const Vertex* at = &from;
  std::array<Vertex, 2> cuts;  // of which one is in use
  double begin = 0.0;
  for (std::size_t j = first; begin < 1.0; ++j) {
    const double end = j < last ? std::min(1.0, passes_at(from, v, points[j + 1], flute_mm)) : 1.0;
    if (!(end > begin)) continue;
    const Vertex* to = &v;
    if (end < 1.0) {
      Vertex& cut = cuts[at == cuts.data() ? 1 : 0];
      cut = v;
      cut.q = meter_.between(from, v, end);
      meter_.place(cut, v.q, program_);
      to = &cut;
    }
    const Part part{*at, *to, begin > 0.0 ? 0.0 : kNotKnown, end < 1.0 ? 1.0 : kNotKnown};
    if (!counts(j, segment) || !keeps_on(part, j, limit_mm)) return false;
    begin = end;
    at = to;
  }
  return true;
}

bool FluteAbout::keeps(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm,
                       int halvings) const {
  constexpr int kMostCuts = 14;
  const PathPoints& points = path_.points();
  const auto [first, last] = path_.segments_about(segment);
  for (std::size_t j = first; j <= last; ++j) {
    const Target& a = points[j];
    const Target& b = points[j + 1];
    if (!counts(j, segment)) continue;
    if (meter_.keeps_flute({from, v, 0.0, 1.0}, a, b, limit_mm)) return true;
  }
  if (halvings == kMostCuts) return false;
  const Vertex middle = meter_.middle_of(from, v, program_);
  return keeps(from, middle, segment, limit_mm, halvings + 1) &&
         keeps(middle, v, segment, limit_mm, halvings + 1);
}

DeviationMeter::Interval FluteAbout::of(const Vertex& from, const Vertex& v, std::size_t segment,
                                        double known_mm, int halvings) const {
  constexpr int kMostCuts = 12;
  constexpr double kSharp = 1.05;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const PathPoints& points = path_.points();
  const double flute_mm = points[segment + 1].flute_mm;
  DeviationMeter::Beside known;
  known.axis_rad.upper = kPi;  // not asked for
  known.flute_mm.upper = known_mm;
  DeviationMeter::Interval least{kInfinite, kInfinite};
  std::array<double, 2> at_end_mm = {kInfinite, kInfinite};  // the least of all segments
  const auto [first, last] = path_.segments_about(segment);
  for (std::size_t j = first; j <= last; ++j) {
    const Target& a = points[j];
    const Target& b = points[j + 1];
    if (!counts(j, segment)) continue;
    const auto beside = meter_.beside({from, v, 0.0, 1.0}, a, b, program_, known);
    if (beside.flute_mm.upper < least.upper) least = beside.flute_mm;
    const path::FluteSegment path({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, flute_mm);
    for (std::size_t k = 0; k < 2; ++k) {
      const ToolPose& end = k == 0 ? from : v;
      const double t = path.nearest(end.tip_P, end.axis_P, kMidPlace);
      at_end_mm[k] = std::min(at_end_mm[k], path.off(end.tip_P, end.axis_P, t).largest_mm(flute_mm));
    }
  }
  const double found_mm = std::max(at_end_mm[0], at_end_mm[1]);
  least.lower = std::min(found_mm, least.upper);
  const bool is_sharp = least.upper <= std::max({limit_mm_, known_mm, kSharp * found_mm});
  if (is_sharp || halvings == kMostCuts) return least;
  const Vertex middle = meter_.middle_of(from, v, program_);
  const auto before = of(from, middle, segment, known_mm, halvings + 1);
  const auto behind = of(middle, v, segment, known_mm, halvings + 1);
  return {std::max(before.lower, behind.lower), std::max(before.upper, behind.upper)};
}

}  // namespace trunnion::post
