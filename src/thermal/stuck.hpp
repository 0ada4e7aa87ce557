#pragma once
#include "trunnion/thermal/condition.hpp"

namespace trunnion::thermal {

/// Readings of one sensor that stand at one value. Rows of the run.
struct Standstill {
  std::size_t run = 0;
  std::size_t from = 0, to = 0;
  std::size_t readings = 0;
};

/// Every standstill of a sensor that is long enough while another sensor moved far enough.
std::vector<Standstill> standstills(const Log& log, std::size_t sensor, const SensorLimits& limits);

/// Judges standstills by what the other sensors let expect: their rises and lags, fitted to the sensor's own
/// readings elsewhere in the log. A standstill is a fault when the expected change is beyond what the steps
/// of the sensor and the scatter of that expectation (runs held out) explain; the scatter does not count
/// where a sensor whose noise turned its readings round all the time stopped doing so. A sensor that never
/// moves is stuck.
void report_stuck(const Log& log, const SensorLimits& limits, std::vector<SensorFault>& faults);

}  // namespace trunnion::thermal
