#pragma once
#include <string>

#include "trunnion/trace/compare.hpp"

namespace trunnion::trace {

struct AsMeasurements {
  std::string run_id = "trace";  // of the runs, a cut each: "trace-1", "trace-2", ...
  /// Moments that are kept, about, each with one reading: half of them and more evenly over the trace, the
  /// others where axes reverse. No two are means of the same row, so that there may be fewer.
  std::size_t most_rows = 10000;
};

struct TraceMeasurements {
  std::string text;                // measurement file
  double lag_of_all_axes_s = 0.0;  // as FollowedTrace has it
  double sigma_s = 0.0;            // of it
};

/// A trace along its program as a measurement file: the commanded place at each time with the axes' senses
/// and velocities; in turn readings of the tip along X, Y and Z of the machine and of the rotation about each
/// rotary axis' direction, actual minus commanded, of the tool relative to the part; behind a reversal that
/// which shows the axis. Their errors are independent: one reading a moment, of rows of its own. The
/// uncertainty is the scatter from row to row, and more where the velocity changes. Machine axes; um and
/// urad. Fails as `follow` does.
Result<TraceMeasurements> measurements_of(const Trace& trace, const Machine& machine, const Plan& plan,
                                          const AsMeasurements& how = {});

}  // namespace trunnion::trace
