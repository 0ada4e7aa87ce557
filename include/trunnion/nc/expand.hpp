#pragma once
#include <array>
#include <vector>

#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

/// What a control makes of one block of a shape: where the axes go, in mm, Z along the third axis word.
namespace trunnion::nc {

/// Places of an arc that was read (Arc::from known), behind its start, the last one its end.
struct ArcCourse {
  std::vector<std::array<double, 3>> xyz_mm;
  /// The course leaves the chords between them by at most this: the bow of a chord, and what the control may
  /// make of radii to start and end that differ by rounding.
  double off_chord_mm = 0.0;
  double radius_mm = 0.0;
  double sweep_rad = 0.0;
};
/// Chords bow by at most `chord_mm` (> 0).
ArcCourse course_of(const Arc& arc, const AxisFormat& format, double chord_mm);

/// One straight motion of a hole; what the control does at its end.
struct Stroke {
  bool rapid = true;
  std::array<double, 3> xyz_mm{};
  double dwell_s = 0.0;  // behind it
};
/// All motions of a hole that was read (Hole::from known). Where the control's own parameters decide
/// (Controller::Cycles::back_mm) they are what the controller file says.
std::vector<Stroke> strokes_of(const Hole& hole, const Controller::Cycles& cycles, const AxisFormat& format);

}  // namespace trunnion::nc
