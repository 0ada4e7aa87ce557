#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/diagnosis/iso230_lines.hpp"

namespace trunnion::iso230 {

inline constexpr std::string_view kCircularStandard = "ISO 230-4:2005";

/// A circle and the deviations from it: angle (rad) and radial deviation (mm), > 0 away from the centre.
struct RadialPoint {
  double angle_rad = 0.0;
  double radial_mm = 0.0;
};

/// Which concentric circles measure the width of a polar plot.
enum class Centre { polar_chart, least_squares, minimum_zone, maximum_inscribed, minimum_circumscribed };
std::string_view text_of(Centre centre);  // "PC", "LSC", "MZC", "MIC", "MCC"

/// Centre (x, y) and radius offset of a circle fitted to radial deviations that are small against the radius
/// (limacon): residual_i = radial_i - radius - x cos(angle_i) - y sin(angle_i).
struct CircleFit {
  double x = 0.0, y = 0.0;
  double radius =
      0.0;  // mean radius (PC, LSC, MZC), inner (MIC) or outer (MCC) circle, less the nominal radius
  double width = 0.0;  // radial separation of the two concentric circles that hold all points
};
/// MZC, MIC and MCC are exact linear programmes (cutting planes; tests compare with closed forms). Needs 3
/// points at least.
CircleFit fit_circle(const std::vector<RadialPoint>& points, Centre centre);

/// One path of a circular test.
struct CircularPath {
  std::string plane;              // "XY": first and second axis
  bool counter_clockwise = true;  // from the first axis to the second
  double radius_mm = 0.0;         // nominal
  Vec3 centre_M = Vec3::Zero();
  std::vector<RadialPoint> points;
};

/// The paths of a file: runs of displacement readings on a circle, n pointing away from (or to) its centre. A
/// run that turns round is split where it does. Fails when a run lies on no circle in a principal plane or n
/// is not radial.
Result<std::vector<CircularPath>> circular_paths(const Readings& readings);

/// ISO 230-4 for one plane and radius (mm). Paths in one direction are averaged where they are repeated only
/// through their own values: G is the largest over repetitions.
struct CircularTest {
  std::string plane;
  double radius_mm = 0.0;
  struct OneWay {
    double G = 0.0;      // circular deviation: least separation of two concentric circles (MZC)
    double G_lsc = 0.0;  // the same about the least-squares centre
    double F_max = 0.0,
           F_min = 0.0;  // radial deviation, least-squares centre (a full circle) or as measured (an arc)
    bool full_circle = true;
  };
  std::optional<OneWay> clockwise, counter_clockwise;
  std::optional<double> G_b;  // bi-directional circular deviation of both paths together
  std::optional<double>
      D;  // mean bi-directional radial deviation: radius of the common least-squares circle less nominal
  /// What shapes the circle (mean of both directions), from its harmonics; mm on the radius.
  double scale_mismatch = 0.0;  // (e_1 - e_2) R of the axes' scales: twice the cos 2t amplitude
  double opening_rad =
      0.0;  // angle between the positive axes above 90 degrees: -2/R times the sin 2t amplitude
};
Result<std::vector<CircularTest>> evaluate_circles(const std::vector<CircularPath>& paths);

/// One cause of a circle's shape, as the report of a ball bar lists them.
struct CircleCause {
  enum class Kind {
    scale_mismatch,
    squareness,
    lost_motion_first,
    lost_motion_second,
    servo_mismatch,
    radius
  };
  Kind kind = Kind::scale_mismatch;
  double share = 0.0;    // of the mean square about each path's centre and the common radius
  double size_mm = 0.0;  // on the radius: scales and squareness twice the amplitude, lost motion its b,
                         // servo mismatch the amplitude, radius counter-clockwise less clockwise
};
/// The causes of the shape of one circle's paths, all fitted together; what they leave is 1 less the sum of
/// the shares. Servo mismatch and radius are told from the others by both directions only. Empty where the
/// paths go through less than half a turn, or deviate by nothing.
std::vector<CircleCause> circle_causes(const std::vector<const CircularPath*>& paths);

}  // namespace trunnion::iso230
