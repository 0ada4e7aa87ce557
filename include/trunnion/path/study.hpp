#pragma once
#include <span>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"
#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// A run of programmed points to be studied: cutting moves, or a link (rapid) of two points.
struct StudyRun {
  std::vector<Point> points;
  bool link = false;
};

/// The runs of a CL program on this machine, its rotary solutions chosen over the whole program; not rounded.
/// Fails as choose_solutions does.
Result<std::vector<StudyRun>> study_runs(const Machine& machine, const Vec3& tool_mm,
                                         const cl::Program& program);

struct StudyOptions {
  std::vector<double> tolerances_mm{0.01, 0.005, 0.002, 0.001, 0.0005};
  Angle axis_tolerance = Angle::degrees(0.05);
  double flute_mm = 0.0;    // Tolerance::Flute of every tool
  std::size_t listed = 50;  // segments listed by name
};

/// What a predictor leaves: max |e - predicted| / max |e| over the cutting segments whose error is above
/// kStudiedError_mm.
struct PredictorStudy {
  Predictor predictor;
  std::size_t segments = 0;
  double rms = 0.0, median = 0.0, p99 = 0.0, worst = 0.0;
  double worst_left_mm = 0.0;    // largest |e - predicted|
  std::uint32_t worst_line = 0;  // CL line of the segment with the worst share
};
inline constexpr double kStudiedError_mm = 1e-5;

/// One placement of points at one tolerance, summed over the segments.
struct PlacementStudy {
  std::string placement;  // on_chord, two_sided, moved
  std::size_t inserted = 0;
  std::size_t inserted_many = 0;  // on segments that need 8 pieces or more on the chord
  std::size_t unconverged = 0;
  std::size_t more_than_on_chord = 0;  // segments on which it needs more points than on_chord
  double largest_certified_mm = 0.0;
  Angle largest_axis;
};

/// Counts at one tolerance, of the cutting segments or of the links.
struct ToleranceStudy {
  double tolerance_mm = 0.0;
  bool links = false;
  std::size_t segments = 0;
  std::size_t over = 0;           // segments that exceed the tolerance as programmed
  std::size_t greedy = 0;         // points that the longest steps on the chord need: the on-chord optimum
  std::size_t two_sided_law = 0;  // sum of ceil((I + 1.172)/4) - 1
  std::vector<PlacementStudy> placements;
};

/// One segment, predicted beside proved.
struct SegmentStudy {
  SourceRef where;
  Angle largest_turn;
  double certified_mm = 0.0;         // bound, within 5 % of the truth
  std::vector<double> predicted_mm;  // by the predictors, in the order of StudyResult::predictors
  bool harmonic_fails = false;       // an error above kStudiedError_mm of another shape
};

struct StudyResult {
  std::vector<PredictorStudy> predictors;
  std::vector<ToleranceStudy> tolerances;
  std::vector<SegmentStudy> worst;  // largest certified error first
};

/// Predictors against the truth, and placements against the on-chord optimum and the lower bound, on the
/// nominal machine, words not rounded.
StudyResult study_nonlinear(const Machine& machine, const Vec3& tool_mm, std::span<const StudyRun> runs,
                            const StudyOptions& options);

}  // namespace trunnion::path
