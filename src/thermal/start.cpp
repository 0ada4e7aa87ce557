#include "thermal/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "trunnion/base/median.hpp"

namespace trunnion::thermal {
namespace {

// Smallest step between two readings behind the first one; infinite where there is none.
double least_step_K(std::span<const TimedReading> readings) {
  double out = std::numeric_limits<double>::infinity();
  for (std::size_t i = 2; i < readings.size(); ++i) {
    // Differences of decimals are not exact.
    constexpr double kNone_K = 1e-6;
    const double step = std::abs(readings[i].degC - readings[i - 1].degC);
    if (step > kNone_K) out = std::min(out, step);
  }
  return out;
}

}  // namespace

std::size_t start_of(std::span<const TimedReading> readings) {
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const double since_s = readings[i].time_s - readings.front().time_s;
    if (since_s > kStartAtMost_s) return std::max<std::size_t>(i, 1);
    if (since_s >= kStart_s && i + 1 >= kStartReadings) return i + 1;
  }
  return 0;
}

std::size_t wrong_at_start(std::span<const TimedReading> start) {
  if (start.size() < kStartReadings) return 0;
  // A line of a hundred readings is as good as one of all that a fast logger takes.
  constexpr std::size_t kMany = 100;
  const std::size_t stride = (start.size() + kMany - 1) / kMany;
  std::vector<double> slopes;
  for (std::size_t i = 0; i < start.size(); i += stride) {
    for (std::size_t k = 0; k < i; k += stride) {
      const double dt = start[i].time_s - start[k].time_s;
      if (dt > 0.0) slopes.push_back((start[i].degC - start[k].degC) / dt);
    }
  }
  const double slope = median(slopes);
  const auto above = [&](const TimedReading& r) {
    return r.degC - slope * (r.time_s - start.front().time_s);
  };
  std::vector<double> levels;
  for (std::size_t i = 0; i < start.size(); i += stride) levels.push_back(above(start[i]));
  const double level = median(levels);
  for (double& l : levels) l = std::abs(l - level);
  constexpr double kScatters = 6.0;
  constexpr double kLeast_K = 1.0;  // a door that stood open
  constexpr double kSteps = 2.5;
  constexpr double kCoarsest_K = 1.0;  // the step of a sensor that showed none
  const double step_K = std::min(least_step_K(start), kCoarsest_K);
  const double limit_K = std::max({kLeast_K, kSteps * step_K, kScatters * kMadToSigma * median(levels)});
  std::size_t wrong = 0;
  while (2 * (wrong + 1) < start.size() && std::abs(above(start[wrong]) - level) > limit_K) ++wrong;
  // What goes over into the line is the machine that begins to move, not a fault.
  if (wrong > 0 && std::abs(start[wrong].degC - start[wrong - 1].degC) <= limit_K) return 0;
  return wrong;
}

}  // namespace trunnion::thermal
