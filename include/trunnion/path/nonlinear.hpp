#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "trunnion/path/point.hpp"
#include "trunnion/path/predictor.hpp"

namespace trunnion::path {

/// What is done about the nonlinear error of a segment.
enum class Method : std::uint8_t {
  none,      // nothing: the error is only reported
  reinsert,  // points on the chord wherever the predicted midpoint error exceeds the tolerance, then checked
             // (paper 001, 3.2.1)
  subtract,  // intermediate points whose linear axes are moved by -R_MP e(t), rotary axes left (paper 001,
             // Eq. 3.4)
  adaptive   // fewest points: points on both sides of the path, each piece proved within tolerance
};

std::optional<Method> method_from_text(std::string_view text);

/// What a piece of the path must keep to, against the programmed segment and the great circle of its tool
/// axes.
struct Tolerance {
  double tip_mm = 0.01;
  Angle axis = Angle::degrees(0.05);
  /// Of a tool that counts from its tip up its axis: every point of it, all at one place of the path.
  struct Flute {
    double length_mm = 0.0;  // 0: the tip counts alone
    double off_mm = 0.0;     // the largest distance of its points
  };
  Flute flute{};

  /// How far the tool axis may be from its place: its own tolerance, or what the end of the flute allows.
  Angle axis_room() const {
    if (flute.length_mm == 0.0) return axis;
    return std::min(axis, Angle::radians(flute.off_mm / flute.length_mm));
  }
};

struct NonlinearOptions {
  Method method = Method::adaptive;
  Predictor predictor;
  bool one_sided = false;  // adaptive: nodes stay on the chord
  bool thin = false;       // drop CL points that the tolerance does not need (see refine_run)
  bool move_programmed_points =
      false;  // adaptive: programmed points may leave their place by up to the tolerance (see refine_run)
  bool certify = true;        // prove each piece; else it is sampled
  bool straight_tip = false;  // tool-centre-point control: between blocks the tip goes straight
};

/// What came of one programmed segment.
struct SegmentReport {
  double predicted_mm = 0.0;   // largest distance from the segment that the predictor expects, as programmed
  double midpoint_mm = 0.0;    // |e(1/2)|, as programmed
  double programmed_mm = 0.0;  // largest distance as programmed (bound or sample, see `certified`)
  double tip_mm = 0.0;         // largest distance of the tip from the programmed segment, after insertion
  Angle axis;                  // largest angle of the tool axis from its great circle, after insertion
  double flute_mm = 0.0;       // largest distance of the tool up to its flute length, after insertion
  bool certified = false;      // the three are proved upper bounds; else the largest of samples
  std::uint32_t inserted = 0;
  bool linear_nodes = false;  // nodes are linear in the rotary axes, not on the great circle (near the pole)
  bool harmonic_fails =
      false;  // a rotary step over 60 degrees, or the largest error is not in the middle (S-shaped)
  bool converged = true;  // tip_mm, axis and flute_mm are within the tolerance
};

/// Refines one segment after the other; keeps its scratch memory, so one Refiner per thread.
///
/// The points handed in have their rotary branch and turns chosen and are on the word grid (round_to_words);
/// so are those that come back. Pieces are judged as a control without tool-centre-point control runs them: q
/// linear between blocks, on the nominal machine.
class Refiner {
 public:
  Refiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
          const NonlinearOptions& options);
  ~Refiner();
  Refiner(Refiner&&) noexcept;
  Refiner& operator=(Refiner&&) noexcept;

  /// Appends to `out` the points to insert between `a` and `b` (neither of the two themselves).
  SegmentReport refine(const Point& a, const Point& b, const Tolerance& tolerance, std::vector<Point>& out);
  /// A segment, and the sines of the rotary positions of its ends where they are known.
  struct Ends {
    const Point& a;
    const Point& b;
    const TableKinematics::Sines* sines_a = nullptr;
    const TableKinematics::Sines* sines_b = nullptr;
  };
  /// As `refine`, without the figures that only a report of the segment wants: `programmed_mm`, `tip_mm`,
  /// `axis` and `harmonic_fails` stay as they are, and so do `predicted_mm` and `midpoint_mm` where both are
  /// proved to be at most `known_mm`.
  SegmentReport decide(const Ends& ends, const Tolerance& tolerance, double known_mm,
                       std::vector<Point>& out);
  /// The first bounds of `decide` settle what they can: no predictor is asked what it thinks of such a
  /// segment. Then its report is `kept`.
  bool bounds_decide() const;
  SegmentReport kept() const;
  /// The segment as it stands, nothing inserted.
  SegmentReport measure(const Point& a, const Point& b, const Tolerance& tolerance);

  /// A run of cutting moves of one feed: `run` are programmed points, every two neighbours a segment. Appends
  /// the whole new run to `out`, its first and last point as they are, and one report per programmed segment
  /// to `reports`. This is where `thin` (points are left out) and `move_programmed_points` (q of a programmed
  /// point changes, its tip_P stays what was prescribed) act; without them it is `refine` on every segment.
  void refine_run(std::span<const Point> run, const Tolerance& tolerance, std::vector<Point>& out,
                  std::vector<SegmentReport>& reports);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace trunnion::path
