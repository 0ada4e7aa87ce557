#pragma once
#include "trunnion/path/certificate.hpp"
#include "trunnion/path/tool_off.hpp"

namespace trunnion::path {

/// A segment of the path as a tool with a flute has to follow it: at the fraction t the tip is at
/// tip0 + t (tip1 - tip0), the axis on the great circle t of the way from axis0 to axis1.
class FluteSegment {
 public:
  /// `flute_mm` >= 0: the tool counts from its tip up to there.
  FluteSegment(const Reference& reference, double flute_mm);

  double flute_mm() const { return flute_mm_; }
  /// Angle of the axis' arc, rad.
  double turn() const { return turn_; }
  /// Opposite axes have no arc.
  bool has_arc() const { return has_arc_; }
  Vec3 axis_P(double t) const;
  ToolOff off(const Vec3& tip_P, const Vec3& axis_P, double t) const;
  /// The fraction of the segment at which the tool is nearest: where the larger of both distances, that of
  /// the tip and that of the point `flute_mm` up, is smallest. `near`: where the search begins.
  double nearest(const Vec3& tip_P, const Vec3& axis_P, double near) const;

 private:
  Vec3 tip0_P_, chord_;
  Vec3 axis0_P_, tangent_P_;  // unit vectors of the arc's plane
  // Of a small angle without a call.
  struct Direction {
    double cosine, sine;
  };
  Direction direction(double t) const;
  double best_of_grid(const Vec3& tip_P, const Vec3& axis_P, double near) const;

  double turn_ = 0.0;
  double flute_mm_;
  bool has_arc_ = true;
};

/// Proved bounds on how far the whole tool, from its tip to its flute length, is off the path: for every
/// place of a piece there is one of the segment at which both are within them, and so are all points between.
/// Mathematics: README of this layer, "The flute". No allocation; one may serve many threads.
class FluteCertifier {
 public:
  /// How the tip goes between two stations: as the axes take it, or, under tool-centre-point control,
  /// straight.
  enum class Tip : std::uint8_t { as_axes_go, straight };
  /// `kinematics` must outlive the object.
  explicit FluteCertifier(const TableKinematics& kinematics, Tip tip = Tip::as_axes_go)
      : kinematics_(kinematics), tip_(tip) {}

  /// The largest distance, mm. upper <= ratio * lower, or upper <= floor_mm.
  Bound deviation(const Station& a, const Station& b, const FluteSegment& segment, double ratio = 1.05,
                  double floor_mm = 1e-7) const;
  /// Is the piece within the tolerance? `about`: fractions of the segment that a and b stand at, about.
  struct Places {
    double a = 0.0;
    double b = 1.0;
  };
  Within within(const Station& a, const Station& b, const FluteSegment& segment, double tolerance_mm,
                const Places& about = {0.0, 1.0}) const;

 private:
  const TableKinematics& kinematics_;
  Tip tip_;
};

}  // namespace trunnion::path
