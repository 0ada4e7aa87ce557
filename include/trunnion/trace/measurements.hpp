#pragma once
#include <string>

#include "trunnion/trace/compare.hpp"

namespace trunnion::trace {

struct AsMeasurements {
  std::string run_id = "trace";
  /// Rows that are kept at most, evenly over the trace.
  std::size_t most_rows = 2000;
};

/// A trace along its program as a measurement file: the commanded place at each time with the axes' senses
/// and velocities; readings of the tip along X, Y and Z of the machine and of the rotation about each rotary
/// axis' direction, actual minus commanded, of the tool relative to the part. The uncertainty is the scatter
/// from row to row. Machine axes; um and urad. Fails as `follow` does.
Result<std::string> measurements_of(const Trace& trace, const Machine& machine, const Plan& plan,
                                    const AsMeasurements& how = {});

}  // namespace trunnion::trace
