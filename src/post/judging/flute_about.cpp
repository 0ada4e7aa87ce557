#include "post/judging/flute_about.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "trunnion/path/flute.hpp"

namespace trunnion::post {

bool FluteAbout::counts(std::size_t j, std::size_t segment) const {
  const PathPoints& points = path_.points();
  const Target& b = points[j + 1];
  return !b.rapid && b.flute_mm == points[segment + 1].flute_mm &&
         (in_cone_ || !PathFollower::near_pole(points[j], b));
}

bool FluteAbout::keeps(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm,
                       int halvings) const {
  constexpr int kMostHalvings = 14;
  if (!meter_.may_bow(from, v)) return false;
  const PathPoints& points = path_.points();
  const auto [first, last] = path_.segments_about(segment);
  for (std::size_t j = first; j <= last; ++j) {
    const Target& a = points[j];
    const Target& b = points[j + 1];
    if (!counts(j, segment)) continue;
    if (meter_.keeps_flute({from, v, 0.0, 1.0}, a, b, limit_mm)) return true;
  }
  if (halvings == kMostHalvings) return false;
  const Vertex middle = meter_.middle_of(from, v, program_);
  return keeps(from, middle, segment, limit_mm, halvings + 1) &&
         keeps(middle, v, segment, limit_mm, halvings + 1);
}

DeviationMeter::Interval FluteAbout::of(const Vertex& from, const Vertex& v, std::size_t segment,
                                        double known_mm, int halvings) const {
  constexpr int kMostHalvings = 12;
  constexpr double kSharp = 1.05;
  constexpr double kMiddle = 0.5;
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
    const auto beside = meter_.beside(from, v, a, b, 0.0, 1.0, program_, known);
    if (beside.flute_mm.upper < least.upper) least = beside.flute_mm;
    const path::FluteSegment path({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, flute_mm);
    for (std::size_t k = 0; k < 2; ++k) {
      const ToolPose& end = k == 0 ? from : v;
      const double t = path.nearest(end.tip_P, end.axis_P, kMiddle);
      at_end_mm[k] = std::min(at_end_mm[k], path.off(end.tip_P, end.axis_P, t).largest_mm(flute_mm));
    }
  }
  const double found_mm = std::max(at_end_mm[0], at_end_mm[1]);
  least.lower = std::min(found_mm, least.upper);
  const bool is_sharp = least.upper <= std::max({limit_mm_, known_mm, kSharp * found_mm});
  if (is_sharp || halvings == kMostHalvings) return least;
  const Vertex middle = meter_.middle_of(from, v, program_);
  const auto before = of(from, middle, segment, known_mm, halvings + 1);
  const auto behind = of(middle, v, segment, known_mm, halvings + 1);
  return {std::max(before.lower, behind.lower), std::max(before.upper, behind.upper)};
}

}  // namespace trunnion::post
