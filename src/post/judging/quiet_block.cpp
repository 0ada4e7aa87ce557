#include "post/judging/quiet_block.hpp"

#include <algorithm>

namespace trunnion::post {

// The block is within its bow of the chord between its ends, and that, cut at the feet of the CL points that
// it passes, is no farther from each (convex) piece of the path than where it is cut: no place on the way is
// evaluated.
QuietBlock QuietTest::of(const ToolPose& from, const ToolPose& v, const Place& place,
                         const path::Certifier::Bows& bow) const {
  const PathPoints& points = path.points();
  const Place& at = path.at();
  double tip_mm = std::max(at.off_tip_mm, place.off_tip_mm);
  double axis = std::max(at.off_axis, place.off_axis);
  if (!(tip_mm < known.tip_mm && axis < known.axis_limit)) return {};
  // Figures of the pole's cone are others; between opposite axes there is no arc.
  for (std::size_t j = at.segment; j <= place.segment; ++j) {
    if (PathFollower::near_pole(points[j], points[j + 1]) || points[j + 1].turn > 0.5 * kPi) return {};
  }
  bool surely = true;
  if (place.segment > at.segment) {
    ChordFoot foot(from, v);
    for (std::size_t j = at.segment; j < place.segment; ++j) {
      const Target& corner = points[j + 1];
      foot.go_to(corner);
      const double off_mm = (foot.tip_P() - corner.tip_P).norm();
      surely = surely && off_mm + bow.tip_mm <= most_off_mm;
      tip_mm = std::max(tip_mm, off_mm);
      axis = std::max(axis, (foot.axis_P() - corner.axis_P).norm());
    }
  }
  const double chord2 = (v.axis_P - from.axis_P).squaredNorm();
  const double more = path_bow(chord2, axis);
  axis = axis * arc_beyond_chord(chord2) + bow.axis;
  const double at_tip = axis + more;
  const bool flute_keeps =
      known.flute_mm == 0.0 || tip_mm + bow.tip_mm + known.flute_mm * at_tip <= known.flute_limit_mm;
  const bool axis_keeps = axis <= known.axis_limit;
  // A block that passes CL points is not looked at once more.
  return {axis_keeps || place.segment == at.segment,
          surely && tip_mm + bow.tip_mm <= known.tip_mm,
          axis_keeps,
          flute_keeps,
          axis,
          at_tip};
}

std::optional<Place> QuietTest::place(const ToolPose& from, const ToolPose& v) const {
  // A CL point at which the tool stands.
  if ((from.tip_P - path.points()[path.next()].tip_P).squaredNorm() <= kSamePoint_mm * kSamePoint_mm)
    return std::nullopt;
  // What may be a way out along the tool axis.
  const Vec3 way = v.tip_P - from.tip_P;
  const double out = way.dot(from.axis_P);
  if (out > 0.0 && out * out > kAlong2 * way.squaredNorm()) return std::nullopt;
  return path.find_near(from, v, true);
}

}  // namespace trunnion::post
