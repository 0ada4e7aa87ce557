#include "diagnosis/fit/measured_tools.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/effects/measured_tools.hpp"

namespace trunnion::diagnosis {

MeasuredRanges ranges_of_readings(const Machine& machine, const Dataset& data) {
  MeasuredRanges out = ranges_of(machine, data.context.names, data.readings.size(),
                                 [&](std::size_t i) { return data.track.state(data.readings[i].row); });
  if (data.readings.empty()) return out;
  double shortest = INFINITY, longest = -INFINITY;
  for (const Reading& reading : data.readings) {
    const double length = -data.rows[reading.row].tool_mm.z();
    shortest = std::min(shortest, length);
    longest = std::max(longest, length);
  }
  out.push_back({kToolLengthKey, shortest, longest});
  return out;
}

}  // namespace trunnion::diagnosis
