#pragma once
#include <cstddef>
#include <span>

namespace trunnion::thermal {

/// One reading of one sensor.
struct TimedReading {
  double time_s = 0.0, degC = 0.0;
};

/// The first readings of a run, on which all rises count: so long, and at least so many of them, but no
/// longer than kStartAtMost_s (where a sensor is read more seldom, a machine may do anything between two
/// readings, and they are believed).
inline constexpr double kStart_s = 300.0;
inline constexpr std::size_t kStartReadings = 5;
inline constexpr double kStartAtMost_s = 900.0;

/// How many of the first readings of a sensor are needed to judge them; 0 while more must come.
std::size_t start_of(std::span<const TimedReading> readings);

/// How many of the readings at the very beginning cannot be true, judged by the others of the start: they lie
/// apart from the straight line of most of them (Theil and Sen) by more than these scatter and than the
/// sensor's steps.
/// @param start  all readings of the start
std::size_t wrong_at_start(std::span<const TimedReading> start);

}  // namespace trunnion::thermal
